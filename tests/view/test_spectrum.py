import numpy as np
import pytest

from tbatch.view.spectrum import in_bands, power_density, spectrum
from tbatch.view.timeline.canvas import Axis, Canvas


def test_the_density_of_noise_holds_its_variance():
    """Parseval: the integral over all lines is the variance. Three segments of 10000 samples each: within 2 %."""
    values = np.random.default_rng(1).normal(0.0, 3.0, (20_000, 2))
    frequency, density = power_density(values, 1e-4)
    np.testing.assert_allclose(density.sum(axis=0) * frequency[0], values.var(axis=0), rtol=0.02)


def test_a_wave_stands_at_its_frequency_with_half_its_square():
    """A whole number of periods in each segment: Hann spreads them over three lines and loses nothing."""
    time = np.arange(20_000) * 1e-4
    frequency, density = power_density(5.0 * np.sin(2 * np.pi * 37.0 * time)[:, None], 1e-4)
    assert frequency[np.argmax(density)] == pytest.approx(37.0)
    assert density.sum() * frequency[0] == pytest.approx(12.5, rel=1e-6)


def test_bands_are_means_of_their_lines():
    frequency = np.arange(1.0, 1001.0)
    middle, mean = in_bands(frequency, np.column_stack((frequency, np.ones(1000))), top=500.0)
    np.testing.assert_allclose(mean[:, 0], middle)  # the mean of a straight line is its value at the mean
    np.testing.assert_allclose(mean[:, 1], 1.0)
    assert np.all(np.diff(np.log2(middle)) > 0.09)  # sixths of an octave; the lowest lines stay
    assert middle[-1] <= 500.0


def test_short_and_quiet_runs_have_a_spectrum_too():
    frequency, density = spectrum(np.zeros((20, 1)), 1e-3)
    assert len(frequency) == len(density) > 1
    assert not density.any()


def test_a_chart_s_axes_are_true():
    logarithmic = Axis(1.0, 1000.0, 300.0, "Hz", log=True)
    np.testing.assert_allclose(logarithmic.place(np.array([1.0, 10.0, 1e3, 1e6])), [0.0, 100.0, 300.0, 300.0])
    assert logarithmic.ticks() == [1.0, 10.0, 100.0, 1000.0]
    assert [logarithmic.written(value) for value in (10.0, 1000.0)] == ["10", "1000 Hz"]
    down, up = (Axis(-1.0, 3.0, 100.0, downward=downward) for downward in (True, False))
    assert down.ticks() == pytest.approx([-1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
    low = Axis(-0.4, 1.6, 100.0)
    assert [low.written(value) for value in low.ticks()] == ["0", "0.5", "1", "1.5"]
    points = [Canvas("chart", logarithmic, axis).points(np.array([10.0]), np.array([2.0])) for axis in (down, up)]
    np.testing.assert_allclose(points, [[[100.0, 75.0]], [[100.0, 25.0]]])
