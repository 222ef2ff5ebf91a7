"""How strongly passengers are shaken: the acceleration behind a band-pass, and behind the weighting of ISO 2631-1."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

BAND = (0.4, 10.0)
"""Limits of the band in which EN 14363 judges vertical accelerations of a carbody [Hz]."""
LEAST_DURATION = 5.0
"""Shortest part that a ride value may rest on [s]: the window of EN 12299."""

# Wk of ISO 2631-1:1997, table A.1: corner frequencies [Hz] and quality factors.
_BAND_LIMITS = (0.4, 100.0)
_TRANSITION = (12.5, 12.5, 0.63)
_STEP = (2.37, 0.91, 3.35, 0.91)


def weighting_response(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Wk(f) of ISO 2631-1, annex A, for vertical vibration of the seated and the standing.

    Args:
        frequency: [Hz], shape (n,).
    """
    zeros, poles, gain = _weighting()
    s = 2j * math.pi * np.asarray(frequency, float)
    above = np.prod([s - zero for zero in zeros], axis=0)
    return np.asarray(gain * above / np.prod([s - pole for pole in poles], axis=0))


def weighted(acceleration: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """The acceleration behind Wk, from rest.

    Args:
        acceleration: [m/s²], shape (..., n).
        step: Between samples [s]; at 0.5 ms the weighting is kept to 1 % at 80 Hz and to 3e-5 at 10 Hz.
    """
    from scipy.signal import bilinear_zpk, sosfilt, zpk2sos

    discrete: Any = bilinear_zpk(*_weighting(), 1.0 / step)  # the stubs of zpk2sos know no complex poles
    return np.asarray(sosfilt(zpk2sos(*discrete), acceleration))


def band_passed(acceleration: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """The acceleration from 0.4 to 10 Hz, from rest: Butterworth, fourth order at either end, 24 dB an octave.

    Args:
        acceleration: [m/s²], shape (..., n).
        step: Between samples [s].
    """
    from scipy.signal import butter, sosfilt

    return np.asarray(sosfilt(butter(4, BAND, "bandpass", fs=1.0 / step, output="sos"), acceleration))


def _weighting() -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """Zeros, poles [rad/s] and gain of Wk in s.

    The band limits are Butterworth's of second order; the transition goes from acceleration to velocity; the step
    rises by the square of its frequencies' ratio.
    """
    low, high = (2.0 * math.pi * f for f in _BAND_LIMITS)
    w3, w4 = (2.0 * math.pi * f for f in _TRANSITION[:2])
    w5, w6 = (2.0 * math.pi * _STEP[place] for place in (0, 2))
    quadratics = ((low, math.sqrt(0.5)), (high, math.sqrt(0.5)), (w4, _TRANSITION[2]), (w6, _STEP[3]))
    poles = np.concatenate([np.roots([1.0, w / q, w * w]) for w, q in quadratics])
    zeros = np.concatenate([np.zeros(2), [-w3], np.roots([1.0, w5 / _STEP[1], w5 * w5])])
    gain = high**2 * w4**2 / w3
    return zeros.astype(complex), poles, gain
