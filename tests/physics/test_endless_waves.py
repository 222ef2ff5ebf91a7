"""A line without end: the stated variance and density everywhere, one function of place, the same cost per metre."""

import math

import numpy as np
import pytest

from tbatch.physics.irregularity import Irregularity
from tbatch.physics.long_profile import PIECE, LongProfile
from tbatch.physics.spectra import Density

BAND = (2.0, 50.0)
CELL = 512.0


def endless(sample: int = 0, **options) -> Irregularity:
    options = {"wavelengths": BAND, "tail": 3, "seed": 4, "period": math.inf, **options}
    return Irregularity.spectrum("china-trunk-line", sample=sample, **options)


def correlation(distance: float) -> float:
    """Of the density itself at a distance [m²]: the integral of S cos 2πfd over the band, by the midpoint rule."""
    edges = np.linspace(1.0 / BAND[1], 1.0 / BAND[0], 20_001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    density = Density("china-trunk-line", 3.0)(middle)
    return float(np.sum(density * np.cos(2.0 * np.pi * middle * distance)) * (edges[1] - edges[0]))


def test_the_grid_gives_the_sum_that_each_place_has():
    (waves,) = endless().terms
    assert waves.cell == CELL
    # Within a cell, across one joint, across two, before the beginning.
    for low, width, count in ((3.0, 0.1, 900), (CELL - 20.0, 0.1, 500), (CELL - 1.0, 0.5, 1100), (-30.0, 0.1, 400)):
        x = low + width * np.arange(count + 1)
        assert np.abs(waves.on_grid(low, width, count) - waves(x)).max() < 1e-14


@pytest.mark.parametrize("amplitudes", ["fixed", "rayleigh"])
def test_variance_and_correlation_are_the_densitys_beside_the_joints_and_across_them(amplitudes):
    # Pairs of places in the middle of a blend, at a joint and astride one.
    pairs = [(200.0, 200.0), (256.0, 262.0), (CELL, CELL), (CELL - 3.0, CELL + 3.0), (CELL - 12.0, CELL + 13.0)]
    x = np.array([*zip(*pairs, strict=True)])
    samples = 1600
    products = np.array([np.prod(endless(sample, amplitudes=amplitudes)(x), axis=0) for sample in range(samples)])
    for (a, b), product in zip(pairs, products.T, strict=True):
        # Four standard errors of a mean of 1600, about 15 % of the variance.
        error = 4.0 * float(np.std(product)) / math.sqrt(samples)
        assert abs(float(np.mean(product)) - correlation(b - a)) < error
        assert error < 0.16 * correlation(0.0)


def test_a_long_line_has_the_density_it_was_drawn_from():
    length, width, segments = 512.0, 0.5, 120
    (waves,) = endless().terms
    window = np.hanning(1024)
    power = np.zeros(513)
    for segment in range(segments):
        # Segments lie anywhere in the cells.
        line = waves.on_grid(segment * 600.0 + 37.0, width, 1023)
        power += np.abs(np.fft.rfft(window * line)) ** 2
    estimate = 2.0 * power * width / (1024 * np.mean(window**2)) / segments
    f = np.arange(estimate.size) / length
    for low, high in ((0.024, 0.06), (0.06, 0.12), (0.12, 0.25), (0.25, 0.48)):
        inside = (f >= low) & (f < high)
        expected = Irregularity.density("china-trunk-line", f[inside], tail=3)
        # At least 18 periodogram values of 120 segments: a standard error of 1/√(18 x 120) with Hann's overlap, 3 %.
        assert np.mean(estimate[inside] / expected) == pytest.approx(1.0, abs=0.12)


def test_the_blur_of_the_density_is_as_small_as_stated():
    # The mean over a cell of w(x)·w(x + d), summed over both weights, against 1 - 1.5 (d/L)², from the weights alone.
    s = np.linspace(0.0, 2.0, 20_001)[:-1]

    def weights(s):
        angle = 0.5 * np.pi * (lambda t: t * t * (3.0 - 2.0 * t))(s % 1.0)
        even = np.floor(s) % 2 == 0
        return np.where(even, np.cos(angle), np.sin(angle)), np.where(even, np.sin(angle), np.cos(angle))

    for shift in (0.02, 0.05):
        # Of the pair, each weight belongs to one realisation for two cells; across a joint one of them is another.
        inside = s + shift < np.floor(s) + 1.0
        products = [a * b for a, b in zip(weights(s), weights(s + shift), strict=True)]
        outside = np.where(np.floor(s) % 2 == 0, products[1], products[0])
        mean = float(np.mean(np.where(inside, products[0] + products[1], outside)))
        assert mean == pytest.approx(1.0 - 0.5 * (0.5 * np.pi) ** 2 * 1.2 * shift**2, abs=0.2 * shift**2)


def test_pieces_have_the_same_bits_in_whatever_order_they_are_asked_for():
    surface = endless().taper(0.0, 5.0)
    places = np.linspace(5.0, 2000.0, 401)
    straight = LongProfile(surface, 0.0, 2100.0)
    one_by_one = np.array([straight(x) for x in places])
    other = LongProfile(surface, 0.0, 2100.0)
    order = np.random.default_rng(2).permutation(places.size)
    shuffled = np.empty_like(places)
    shuffled[order] = [other(x) for x in places[order]]
    assert np.array_equal(one_by_one, shuffled)
    # Between knots the spline of a spectrum errs by 1e-8 m.
    assert np.abs(one_by_one - surface(places)).max() < 1e-8


def test_a_place_does_not_depend_on_the_length_of_the_line():
    surface = endless()
    short, long = (LongProfile(surface, 0.0, length) for length in (1000.0, 20_000.0))
    # The last piece ends with the line.
    x = np.linspace(0.0, 3.0 * PIECE - 1e-3, 2001)
    assert np.array_equal(short(x), long(x))


def test_cells_and_samples_are_drawn_apart():
    x = np.linspace(0.0, 200.0, 2001)
    # Waves up to 10 m, so that 200 m hold enough of them: correlations have a standard deviation below 0.15.
    lines = [endless(sample, wavelengths=(2.0, 10.0)) for sample in range(2)]
    stretches = [lines[0](x), lines[1](x), lines[0](x + 4.0 * CELL), endless(0, seed=5, wavelengths=(2.0, 10.0))(x)]
    matrix = np.corrcoef(stretches) - np.eye(4)
    assert np.abs(matrix).max() < 0.5
    assert np.array_equal(lines[0](x), endless(0, wavelengths=(2.0, 10.0))(x))
