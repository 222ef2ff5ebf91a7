"""Refinement: the partition on which a spline follows a function of unknown shape."""

import warnings
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.partition import LEAST_INTERVALS, Piece, overlay, points
from tbatch.physics.profile import Profile

FloatArray = NDArray[np.float64]

_COARSEST_CELL = 0.02  # m: a cell is looked at in four places, so a feature longer than about 10 mm is not overlooked
_FINEST_CELL = 1e-4  # m
_CHEAP_INTERVALS = 64  # what one piece less may cost


def refine(
    function: Callable[[FloatArray], FloatArray],
    low: float,
    high: float,
    *,
    breaks: Sequence[float] = (),
    tolerance: float = 1e-8,
) -> list[Piece]:
    """Find the pieces and spacings with which a spline follows a function of unknown shape.

    Cells start 20 mm wide and are quartered where the spline misses the function at one of three points of a cell by
    more than the tolerance, down to 0.1 mm. What is narrower than about 10 mm may be overlooked unless a break is
    given there.

    Args:
        function: r(x) of an array [m].
        low: start of the stretch [m].
        high: end of the stretch [m].
        breaks: where the function is not smooth [m], as far as known.
        tolerance: largest accepted error of the value [m].

    Returns:
        Adjacent pieces in rising order. A warning tells where the tolerance was not reached.
    """
    edges = [p.low for p in overlay([[Piece(b, b, np.inf)] for b in breaks], low, high)] + [high]
    pieces: list[Piece] = []
    worst = (0.0, low)
    for a, b in pairwise(edges):
        found, missed = _refine(function, a, b, _COARSEST_CELL, tolerance)
        pieces += _merge(found)
        worst = max(worst, missed)
    if worst[0] > tolerance:
        warnings.warn(
            f"irregularity given as a function is not smooth near x = {worst[1]:.4f} m: with {_FINEST_CELL * 1e3:g} mm"
            f" between knots its spline is {worst[0] * 1e6:.3g} um off (wanted {tolerance * 1e6:g} um);"
            " name its kinks in Irregularity.of(function, breaks=...)",
            stacklevel=2,
        )
    return pieces


def _refine(
    function: Callable[[FloatArray], FloatArray], low: float, high: float, spacing: float, tolerance: float
) -> tuple[list[Piece], tuple[float, float]]:
    """Pieces of one smooth stretch and the worst remaining error with its place."""
    piece = Piece(low, high, spacing)
    n, width = piece.intervals, piece.width
    x = points(low, 0.25 * width, 4 * n)
    fine = function(x)
    spline = Profile.from_pieces([piece], lambda a, h, m: fine[::4])
    error = np.abs(spline(x) - fine)[:-1].reshape(n, 4).max(axis=1)
    bad = error > tolerance
    if not bad.any():
        return [piece], (0.0, low)
    if width <= _FINEST_CELL:
        cell = int(np.argmax(error))
        return [piece], (float(error[cell]), low + width * (cell + 0.5))
    # A kink spoils the spline a few cells around it, and a piece left over needs its least number of cells.
    bad = np.convolve(bad, np.ones(7), mode="same") > 0
    edges = np.flatnonzero(np.diff(bad, prepend=not bad[0], append=not bad[-1]))
    for a, b in pairwise(edges):
        if not bad[a] and b - a < LEAST_INTERVALS + 2:
            bad[a:b] = True
    edges = np.flatnonzero(np.diff(bad, prepend=not bad[0], append=not bad[-1]))
    pieces: list[Piece] = []
    worst = (0.0, low)
    for a, b in pairwise(edges):
        x_a = low + width * int(a)
        x_b = high if b == n else low + width * int(b)
        if not bad[a]:
            pieces.append(Piece(x_a, x_b, width * (1.0 + 1e-9)))
            continue
        found, missed = _refine(function, x_a, x_b, 0.25 * width, tolerance)
        pieces += found
        worst = max(worst, missed)
    return pieces, worst


def _merge(pieces: Sequence[Piece]) -> list[Piece]:
    """Join pieces to finer neighbours where that adds few intervals: fewer pieces are searched faster."""
    merged: list[Piece] = []
    for piece in pieces:
        while merged:
            joined = Piece(merged[-1].low, piece.high, min(merged[-1].spacing, piece.spacing))
            if joined.intervals > merged[-1].intervals + piece.intervals + _CHEAP_INTERVALS:
                break
            piece = joined
            merged.pop()
        merged.append(piece)
    return merged
