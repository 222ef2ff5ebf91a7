"""Spectra and envelopes of the report against closed forms."""

import math

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from tbatch.campaign.estimates.envelope import envelope
from tbatch.view.report.spectra import THIRD_OCTAVES, third_octaves


def test_a_sine_is_in_its_own_third_octave_with_its_rms():
    step, frequency, amplitude = 1e-4, 100.0, 3.0
    time = step * np.arange(40_000)
    found = third_octaves(np.append(amplitude * np.sin(2 * math.pi * frequency * time), np.full(50, np.nan)), step)
    levels = dict(zip(np.round(found[:, 0], 3), found[:, 1], strict=True))
    # A Hann window spreads the line over three bins of 1 Hz, all within the band of 89 to 112 Hz.
    assert levels[100.0] == pytest.approx(amplitude / math.sqrt(2.0), rel=1e-3)
    assert levels[50.119] < 1e-3 * amplitude


def test_white_noise_has_its_density_times_the_bandwidth_within_the_interval():
    step, covered, bands = 1e-3, 0, 0
    for draw in range(100):
        noise = np.random.Generator(np.random.Philox(key=[3, draw])).normal(size=8_000)
        for middle, _, low, high in third_octaves(noise, step)[-12:-1]:
            expected = math.sqrt(2.0 * step * middle * (10**0.05 - 10**-0.05))
            # Whole bins stand for the band, which is ten of them and more here.
            covered += low * 0.98 <= expected <= high * 1.02
            bands += 1
    assert covered >= 0.93 * bands


def test_bands_are_a_tenth_of_a_decade_apart_and_hold_one_kilohertz():
    assert np.allclose(np.diff(np.log10(THIRD_OCTAVES)), 0.1)
    assert np.isclose(THIRD_OCTAVES, 1000.0).any()


def test_an_envelope_holds_the_quantiles_of_the_runs_at_each_place():
    values = np.tile(np.arange(1.0, 101.0)[:, None], (1, 3)) * [1.0, 2.0, np.nan]
    found = envelope(np.array([10.0, 11.0, 12.0]), values)
    assert found.x.tolist() == [10.0, 11.0]  # no run has a value at the last
    assert (found.least.tolist(), found.most.tolist()) == ([1.0, 2.0], [100.0, 200.0])
    assert {share: curve.value.tolist() for share, curve in found.curves.items()} == {
        0.05: [5.0, 10.0],
        0.5: [50.0, 100.0],
        0.95: [95.0, 190.0],
    }
    assert all(np.isfinite(curve.low).all() and np.isfinite(curve.high).all() for curve in found.curves.values())


def test_the_band_of_an_envelope_covers_the_true_quantile():
    source = np.random.Generator(np.random.Philox(key=[3, 999]))
    curve = envelope(np.arange(1000.0), source.normal(size=(64, 1000))).curves[0.95]
    covered = np.mean((curve.low <= 1.6448536) & (curve.high >= 1.6448536))
    assert covered >= 0.94  # 1000 places scatter by 0.007, the interval is conservative
