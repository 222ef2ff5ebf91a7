"""Profile: an irregularity as the kernels evaluate it, a piecewise-uniform cubic B-spline."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded

from tbatch.physics.partition import LEAST_INTERVALS, Piece

FloatArray = NDArray[np.float64]
Sample = Callable[[float, float, int], FloatArray]

# First derivative at the first of seven equidistant points, sixth order (times the spacing).
_END_SLOPE = np.array([-147.0, 360.0, -450.0, 400.0, -225.0, 72.0, -10.0]) / 60.0


@dataclass(frozen=True, eq=False)
class Profile:
    """A cubic B-spline on segments of uniform spacing, sorted by their starts.

    A segment with n intervals owns n + 3 coefficients. A point belongs to the last segment that starts at or before
    it; a segment may reach beyond the start of the next one. Left of the first and right of the last segment the
    end values hold.
    """

    start: FloatArray
    """where the segment starts [m], shape (segment,)"""
    inverse_spacing: FloatArray
    """one over the distance between two knots [1/m], shape (segment,)"""
    intervals: NDArray[np.int32]
    """intervals of the segment [-], shape (segment,)"""
    first: NDArray[np.int32]
    """index of the segment's first coefficient [-], shape (segment,)"""
    coefficient: FloatArray
    """B-spline coefficients of all segments [m], shape (coefficient,)"""

    def __post_init__(self) -> None:
        """Make the arrays read-only: profiles are shared."""
        for array in (self.start, self.inverse_spacing, self.intervals, self.first, self.coefficient):
            array.flags.writeable = False

    @classmethod
    def zero(cls) -> "Profile":
        """The profile of a smooth rail."""
        return cls(np.zeros(1), np.ones(1), np.ones(1, dtype=np.int32), np.zeros(1, dtype=np.int32), np.zeros(4))

    @classmethod
    def from_pieces(cls, pieces: Sequence[Piece], sample: Sample) -> "Profile":
        """Interpolate a function, one segment per piece.

        Args:
            pieces: where the function is smooth and the spacing it needs there; adjacent, in rising order.
            sample: ``sample(low, spacing, n)`` gives the values at ``low + spacing * i`` for i = 0 ... n [m].
        """
        coefficients = [spline_coefficients(sample(p.low, p.width, p.intervals)) for p in pieces]
        counts = np.array([c.size for c in coefficients])
        return cls(
            start=np.array([p.low for p in pieces]),
            inverse_spacing=np.array([p.intervals / (p.high - p.low) for p in pieces]),
            intervals=(counts - 3).astype(np.int32),
            first=(np.cumsum(counts) - counts).astype(np.int32),
            coefficient=np.concatenate(coefficients),
        )

    @property
    def nbytes(self) -> int:
        """Memory of the coefficients [bytes]."""
        return int(self.coefficient.nbytes)

    @property
    def segment_count(self) -> int:
        """Number of segments."""
        return self.start.size

    @property
    def knots(self) -> FloatArray:
        """All knots [m], those of a segment only as far as the next one, shape (knot,)."""
        ends = np.append(self.start[1:], np.inf)
        knots = []
        for start, inverse, intervals, end in zip(self.start, self.inverse_spacing, self.intervals, ends, strict=True):
            own = start + np.arange(intervals + 1) / inverse
            knots.append(own[own < end])
        return np.concatenate(knots)

    def __call__(self, x: ArrayLike) -> FloatArray:
        """The value r(x) [m], same shape as x; the kernels mirror these operations in this order."""
        x = np.asarray(x, dtype=np.float64)
        segment = np.maximum(np.searchsorted(self.start, x, side="right") - 1, 0)
        last = self.intervals[segment] - 1
        t = (x - self.start[segment]) * self.inverse_spacing[segment]
        i = np.minimum(np.maximum(np.floor(t), 0.0), last).astype(np.int64)
        w = np.minimum(np.maximum(t - i, 0.0), 1.0)
        o = 1.0 - w
        b0 = o * o * o / 6.0
        b1 = (3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0
        b2 = (3.0 * o * o * o - 6.0 * o * o + 4.0) / 6.0
        b3 = w * w * w / 6.0
        k = self.first[segment] + i
        c = self.coefficient
        return c[k] * b0 + c[k + 1] * b1 + c[k + 2] * b2 + c[k + 3] * b3


def spline_coefficients(values: FloatArray) -> FloatArray:
    """Coefficients of the cubic B-spline through equidistant values.

    The slopes at both ends come from one-sided differences of sixth order, so that a piece needs nothing from beyond
    its ends and still is as accurate there as inside.

    Args:
        values: what the spline passes through, at least seven, shape (n + 1,).

    Returns:
        The coefficients, shape (n + 3,).
    """
    size = values.size
    if size < LEAST_INTERVALS + 1:
        raise ValueError(f"values: {size} points given, a spline piece needs at least {LEAST_INTERVALS + 1}")
    low = _END_SLOPE @ values[:7]
    high = -(_END_SLOPE @ values[:-8:-1])
    # (c[i-1] + 4 c[i] + c[i+1]) / 6 = value; the outermost coefficients are eliminated by the slopes (c[1] - c[-1]) / 2
    # and the first and last row halved, which makes the matrix symmetric.
    bands = np.empty((2, size))
    bands[0] = 4.0
    bands[0, [0, -1]] = 2.0
    bands[1] = 1.0
    right = 6.0 * values
    right[0] = 3.0 * values[0] + low
    right[-1] = 3.0 * values[-1] - high
    inner = solveh_banded(bands, right, overwrite_ab=True, overwrite_b=True, lower=True, check_finite=False)
    return np.concatenate(([inner[1] - 2.0 * low], inner, [inner[-2] + 2.0 * high]))
