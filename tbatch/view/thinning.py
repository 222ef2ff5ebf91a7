"""Fewer samples for pictures and overviews, without losing what an engineer looks for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tbatch.view.record import Array

Samples = NDArray[np.intp]


def spaced_samples(time: Array, position: Array, *, interval: float, travel: float) -> Samples:
    """Pick samples that lie at least `interval` [s] and `travel` [m] apart, the first and the last among them.

    Args:
        time: Time [s], shape (n,).
        position: Place along the line [m], shape (n,).
        interval: Least time between two picked samples [s].
        travel: Least way between two picked samples [m].

    Returns:
        Indices, ascending, shape (picked,).
    """
    slack = 1e-9  # a sample on the mark counts, whatever the rounding
    ticks = np.floor((time - time[0]) / interval + slack)
    ways = np.floor((position - position[0]) / travel + slack)
    marks = np.maximum.accumulate(np.minimum(ticks, ways))
    picked = np.flatnonzero(np.diff(marks, prepend=-1.0) > 0)
    return np.union1d(picked, [len(time) - 1]).astype(np.intp)


def curve_samples(time: Array, values: Array, kept: Samples, *, tolerance: float, most: int) -> tuple[Samples, float]:
    """Pick samples that draw curves as all of them would: no peak is lost, and no line is off by more than a tolerance.

    Picked are the samples asked for, the first and the last, the least and the largest value of each series, all
    turning points between which it moves by more than the tolerance, and as many more as it takes for straight lines
    between picked samples to miss no sample of any series by more than that. Where these are too many the tolerance
    is doubled, as often as needed.

    Args:
        time: Time [s], shape (n,).
        values: Curves, shape (n, series).
        kept: Samples that are picked in any case.
        tolerance: Largest distance of a line from a sample, in the unit of the values; greater than zero.
        most: Samples that may be picked beside those asked for.

    Returns:
        Indices, ascending, shape (picked,), and the tolerance that they hold.
    """
    ends = [0, len(time) - 1, *values.argmin(axis=0), *values.argmax(axis=0)]
    kept = np.union1d(kept, ends).astype(np.intp)
    span = float(np.ptp(values))
    while True:
        turns = [turning_points(series, tolerance) for series in values.T]
        picked = _followed(time, values, np.union1d(kept, np.concatenate(turns)), tolerance)
        if len(picked) <= len(kept) + most or tolerance > span:
            return picked, tolerance
        tolerance *= 2.0


def turning_points(series: Array, swing: float) -> Samples:
    """Tops and bottoms of a series between which it moves by more than `swing`, shape (turn,)."""
    steps = np.sign(np.diff(series))
    moves = np.flatnonzero(steps)
    turns = moves[1:][steps[moves[1:]] != steps[moves[:-1]]]
    found: list[int] = []
    low, high, rising, falling = 0, 0, True, True  # the way is not known until the first swing
    for k, value in zip(turns.tolist(), series[turns].tolist(), strict=True):
        low, high = (k if value < series[low] else low), (k if value > series[high] else high)
        if rising and series[high] - value > swing:
            found.append(high)
            low, high, rising, falling = k, k, False, True
        elif falling and value - series[low] > swing:
            found.append(low)
            low, high, rising, falling = k, k, True, False
    return np.array([*found, low, high], np.intp)  # the last way has not turned yet


def _followed(time: Array, values: Array, kept: Samples, tolerance: float) -> Samples:
    """Add to the kept samples, where a line is off the most, until none is by more than the tolerance."""
    while True:
        lines = (np.interp(time, time[kept], series[kept]) for series in values.T)
        off = np.max([np.abs(series - line) for series, line in zip(values.T, lines, strict=True)], axis=0)
        stretch = np.repeat(np.arange(len(kept)), np.diff(kept, append=len(time)))
        worst = np.maximum.reduceat(off, kept)[stretch]
        found = np.flatnonzero((off > tolerance) & (off == worst))
        if not len(found):
            return kept
        first = np.diff(stretch[found], prepend=-1) > 0  # one a stretch
        kept = np.union1d(kept, found[first])


def extremes(values: Array, starts: Samples) -> tuple[Samples, Array]:
    """Keep the least and the largest value of every block of samples: two rows a block, in the order they come.

    Args:
        values: Series, shape (n, series).
        starts: First sample of each block, ascending from 0, shape (block,).

    Returns:
        The samples that the rows stand at, shape (row,), and the rows, shape (row, series).
    """
    ends = np.append(starts[1:], len(values))
    halves = starts + (ends - starts + 1) // 2
    inner = halves[halves < ends]
    cuts = np.union1d(starts, inner)
    least, largest = (reduce.reduceat(values, starts, axis=0) for reduce in (np.minimum, np.maximum))
    early = np.maximum.reduceat(values, cuts, axis=0)[np.searchsorted(cuts, starts)]
    peak_first = early == largest
    rows = np.empty((2 * len(starts), values.shape[1]))
    rows[0::2] = np.where(peak_first, largest, least)
    rows[1::2] = np.where(peak_first, least, largest)
    at = np.empty(2 * len(starts), np.intp)
    at[0::2], at[1::2] = starts, np.minimum(halves, ends - 1)
    single = np.repeat(ends - starts == 1, 2)
    single[0::2] = False
    return at[~single], rows[~single]
