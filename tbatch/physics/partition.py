"""Partition: a stretch of line cut into pieces on which an irregularity is smooth, each with the spacing it needs."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEAST_INTERVALS = 6
"""a spline piece takes its end slopes from seven points"""

_SAME_PLACE = 1e-9  # m: two breaks closer than this are one


class Piece(NamedTuple):
    """A stretch on which a function is smooth."""

    low: float
    """where it starts [m]"""
    high: float
    """where it ends [m]"""
    spacing: float
    """the largest distance between knots that resolves the function [m]; inf where it is zero"""

    @property
    def intervals(self) -> int:
        """Number of spline intervals."""
        # The margin keeps round-off from adding an interval to a length that is a whole multiple of the spacing.
        return max(LEAST_INTERVALS, math.ceil((self.high - self.low) / self.spacing * (1.0 - 1e-12)))

    @property
    def width(self) -> float:
        """Width of one interval [m]."""
        return (self.high - self.low) / self.intervals


def points(low: float, width: float, count: int) -> FloatArray:
    """The ends of `count` intervals of a width, from `low` on [m], shape (count + 1,)."""
    return np.asarray(low + width * np.arange(count + 1), dtype=np.float64)


def overlay(partitions: Iterable[Sequence[Piece]], low: float, high: float) -> list[Piece]:
    """The common partition of several functions: all their breaks, everywhere the smallest spacing."""
    partitions = [p for p in partitions if p]
    edges = [low]
    for edge in sorted(piece.low for p in partitions for piece in p):
        if edges[-1] + _SAME_PLACE < edge < high - _SAME_PLACE:
            edges.append(edge)
    edges.append(high)
    spacing = np.full(len(edges) - 1, np.inf)
    middle = 0.5 * (np.array(edges[:-1]) + np.array(edges[1:]))
    for p in partitions:
        own = np.searchsorted([piece.low for piece in p], middle, side="right") - 1
        spacing = np.minimum(spacing, np.array([piece.spacing for piece in p])[np.maximum(own, 0)])
    return [Piece(a, b, float(h)) for (a, b), h in zip(pairwise(edges), spacing, strict=True)]


def extend(pieces: Sequence[Piece]) -> list[Piece]:
    """Move the outer ends outwards so that the outer pieces hold whole steps of their own spacing.

    The steps count from the first and last break, or from x = 0 where there is none: functions that exist beyond the
    ends then have the same knots whatever the range asked for.
    """
    pieces = list(pieces)
    whole = 1.0 + 1e-9  # keeps round-off from adding an interval
    if len(pieces) == 1:
        low, high, h = pieces[0]
        if math.isfinite(h):
            from_step = math.floor(low / h)
            to_step = max(math.ceil(high / h), from_step + LEAST_INTERVALS)
            pieces[0] = Piece(h * from_step, h * to_step, h * whole)
        return pieces
    first, last = pieces[0], pieces[-1]
    if math.isfinite(first.spacing):
        pieces[0] = Piece(first.high - first.spacing * first.intervals, first.high, first.spacing * whole)
    if math.isfinite(last.spacing):
        pieces[-1] = Piece(last.low, last.low + last.spacing * last.intervals, last.spacing * whole)
    return pieces
