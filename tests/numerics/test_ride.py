"""The weighting is the table of ISO 2631-1; the filters pass what they should."""

import math

import numpy as np
import pytest

from tbatch.numerics.ride import band_passed, weighted, weighting_response

# ISO 2631-1:1997, table 3: third octave centre [Hz], factor of Wk times 1000.
TABLE = {
    0.1: 31.2, 0.125: 48.6, 0.16: 79.0, 0.2: 121, 0.25: 182, 0.315: 263, 0.4: 352, 0.5: 418, 0.63: 459, 0.8: 477,
    1.0: 482, 1.25: 484, 1.6: 494, 2.0: 531, 2.5: 631, 3.15: 804, 4.0: 967, 5.0: 1039, 6.3: 1054, 8.0: 1036,
    10.0: 988, 12.5: 902, 16.0: 768, 20.0: 636, 25.0: 513, 31.5: 405, 40.0: 314, 50.0: 246, 63.0: 186, 80.0: 132,
    100.0: 88.7,
}  # fmt: skip
STEP = 5e-4


def rms_of(filtered: np.ndarray) -> float:
    """Over the last ten seconds of twenty: the filters have settled by then."""
    return float(np.sqrt((filtered[len(filtered) // 2 :] ** 2).mean()))


@pytest.mark.parametrize(("frequency", "factor"), TABLE.items())
def test_the_weighting_is_that_of_the_standard(frequency: float, factor: float) -> None:
    # The table gives three digits, at centres that are 10**(n/10) or their round names, 1.8 % apart at most.
    names = np.array([frequency, 10 ** (round(10 * math.log10(frequency)) / 10)])
    found = 1e3 * np.abs(weighting_response(names))
    assert found.min() - 0.005 * factor <= factor <= found.max() + 0.005 * factor


@pytest.mark.parametrize("frequency", [1.0, 5.0, 8.0, 31.5])
def test_a_sine_comes_out_weighted(frequency: float) -> None:
    time = STEP * np.arange(int(20.0 / STEP))
    found = rms_of(weighted(3.0 * np.sin(2.0 * math.pi * frequency * time), STEP))
    expected = 3.0 / math.sqrt(2.0) * abs(weighting_response(np.array([frequency]))[0])
    # The bilinear transform bends frequencies: 0.1 % of the weight at 31.5 Hz.
    assert found == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("frequency", "gain"), [(0.1, 0.0), (0.4, 0.5**0.5), (2.0, 1.0), (10.0, 0.5**0.5), (40.0, 0.0)]
)
def test_the_band_passes_what_lies_within(frequency: float, gain: float) -> None:
    time = STEP * np.arange(int(40.0 / STEP))
    found = rms_of(band_passed(np.sin(2.0 * math.pi * frequency * time), STEP)) * math.sqrt(2.0)
    # Butterworth: half the power at either end; two octaves beyond, 1/4**4.
    assert found == pytest.approx(gain, abs=5e-3)
