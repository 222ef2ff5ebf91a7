"""The low-pass is SciPy's Butterworth filter."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfreqz

from tbatch.numerics.low_pass import rest_delays, sections


@pytest.mark.parametrize("step", [2e-2, 1e-3, 1e-4, 1e-5])
def test_its_response_is_that_of_scipy_s_design(step):
    # Round-off grows as the poles near 1: at 10 us a coefficient's last bit moves the gain by 1e-9.
    mine = np.array([[*row[:3], 1.0, *row[3:]] for row in sections(20.0, step)])
    frequencies = np.geomspace(0.1, 0.4 / step, 50)
    _, response = sosfreqz(mine, frequencies, fs=1.0 / step)
    _, expected = sosfreqz(butter(4, 20.0, fs=1.0 / step, output="sos"), frequencies, fs=1.0 / step)
    assert np.abs(response - expected).max() < 1e-8


def test_half_the_power_passes_at_the_cutoff():
    mine = np.array([[*row[:3], 1.0, *row[3:]] for row in sections(20.0, 1e-3)])
    _, response = sosfreqz(mine, [20.0], fs=1e3)
    assert np.abs(response[0]) ** 2 == pytest.approx(0.5, rel=1e-10)


def test_a_steady_force_stays_what_it_is():
    design = sections(20.0, 1e-4)
    force = np.full(100, 7e4)
    state = np.array([rest_delays(row) for row in design]) * 7e4
    passed, _ = sosfilt(np.array([[*row[:3], 1.0, *row[3:]] for row in design]), force, zi=state)
    assert passed == pytest.approx(force, rel=1e-9)
