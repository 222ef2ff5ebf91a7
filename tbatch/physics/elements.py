"""The Euler-Bernoulli beam element: two nodes, cubic Hermite shape, dofs (w1, theta1, w2, theta2), theta = dw/dx."""

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.quantities import FloatArray


def beam_stiffness(length: float, EI: float) -> FloatArray:
    """Return the bending stiffness [N/m, N, N m] of a beam element, shape (4, 4)."""
    a = length
    return (EI / a**3) * np.array(
        [
            [12.0, 6.0 * a, -12.0, 6.0 * a],
            [6.0 * a, 4.0 * a * a, -6.0 * a, 2.0 * a * a],
            [-12.0, -6.0 * a, 12.0, -6.0 * a],
            [6.0 * a, 2.0 * a * a, -6.0 * a, 4.0 * a * a],
        ]
    )


def consistent_bed(length: float, per_metre: float) -> FloatArray:
    """Return the integral of `per_metre` N^T N over an element, shape (4, 4).

    With a mass per metre it is the consistent mass matrix, with a bed's stiffness or damping per metre that of the bed.
    """
    a = length
    return (per_metre * a / 420.0) * np.array(
        [
            [156.0, 22.0 * a, 54.0, -13.0 * a],
            [22.0 * a, 4.0 * a * a, 13.0 * a, -3.0 * a * a],
            [54.0, 13.0 * a, 156.0, -22.0 * a],
            [-13.0 * a, -3.0 * a * a, -22.0 * a, 4.0 * a * a],
        ]
    )


def hermite(t: ArrayLike, length: float) -> FloatArray:
    """Return the shape values N of (w1, theta1, w2, theta2) at t = x / length in [0, 1], shape (..., 4)."""
    s = np.asarray(t, dtype=np.float64)
    return np.stack(
        [
            1.0 - 3.0 * s**2 + 2.0 * s**3,
            length * (s - 2.0 * s**2 + s**3),
            3.0 * s**2 - 2.0 * s**3,
            length * (s**3 - s**2),
        ],
        axis=-1,
    )


def fixed_fixed_compliance(x: ArrayLike, at: ArrayLike, length: float | FloatArray, EI: float) -> FloatArray:
    """Return the deflection at `x` of an element clamped at both ends under a unit force at `at` [m/N].

    This is what a cubic element lacks: added to the deflection N u of the element, it gives the exact static deflection
    under forces within it. At the force itself it is a³b³/(3 EI ℓ³). It is symmetric in `x` and `at`.
    """
    near = np.minimum(x, at)
    a = np.maximum(x, at)
    b = length - a
    return b**2 * near**2 * (3.0 * a * length - near * (3.0 * a + b)) / (6.0 * EI * length**3)
