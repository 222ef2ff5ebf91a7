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
