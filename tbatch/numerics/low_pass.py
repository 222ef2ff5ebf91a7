"""The low-pass that the contact force is judged behind: Butterworth, fourth order, as two sections.

In closed form: SciPy's design, which a test holds it against, takes half a second to import, and every start needs it.
"""

import math

import numpy as np

ORDER = 4


def sections(cutoff: float, step: float) -> np.ndarray:
    """Coefficients b0, b1, b2, a1, a2 of each section, shape (section, 5); each has unit gain at rest.

    Bilinear transform with the cutoff in its place: K = tan(π f Δt); the poles are those of s² + 2 cos(θ) s + 1 with
    θ = (2k + 1) π / 8, the broader section first (Oppenheim and Schafer, Discrete-Time Signal Processing, 7.1).

    Args:
        cutoff: Frequency f at which half the power passes [Hz], below 1/(2Δt).
        step: Δt [s].
    """
    K = math.tan(math.pi * cutoff * step)
    rows = []
    for k in range(ORDER // 2):
        damping = 2.0 * math.cos((2 * k + 1) * math.pi / (2 * ORDER)) * K
        scale = 1.0 / (1.0 + damping + K * K)
        b = K * K * scale
        rows.append((b, 2.0 * b, b, 2.0 * (K * K - 1.0) * scale, (1.0 - damping + K * K) * scale))
    return np.array(rows)


def rest_delays(section: np.ndarray) -> np.ndarray:
    """The two delays of a section (transposed direct form II) in which a steady input of 1 has left it, shape (2,)."""
    b0, _, b2, _, a2 = section
    return np.array([1.0 - b0, b2 - a2])
