"""Curves with bands: how much exceeds a value, per run or per kilometre, and where along the line."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.campaign.estimates.intervals import (
    exact_interval,
    finite,
    percentile_interval,
    rate_interval,
    resampled_sums,
)

_MOST_POINTS = 200


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve with its pointwise 95 % band."""

    x: NDArray[np.float64]
    """where, shape (point,)"""
    value: NDArray[np.float64]
    """shape (point,)"""
    low: NDArray[np.float64]
    """shape (point,)"""
    high: NDArray[np.float64]
    """shape (point,)"""
    runs: int
    """runs that it rests on"""

    @classmethod
    def empty(cls, runs: int) -> "Curve":
        """Of runs that have nothing to show."""
        nothing = np.zeros(0)
        return cls(nothing, nothing, nothing, nothing, runs)


def exceedance(values: ArrayLike, *, below: bool = False) -> Curve:
    """The share of runs whose value exceeds x, with exact pointwise intervals; at each value seen, the rarest last.

    Args:
        values: A value a run; NaN does not count.
        below: The share of runs whose value falls below x instead.
    """
    data = np.sort(finite(values))
    data = data if not below else data[::-1]
    count = len(data)
    place = _spread(count)
    at_least = count - place  # runs with a value at least as rare as this one
    bounds = [exact_interval(int(times), count) for times in at_least]
    low, high = np.array(bounds).T if count else (np.zeros(0), np.zeros(0))
    return Curve(data[place], at_least / max(count, 1), low, high, count)


def events_exceeding(
    values: NDArray[np.float64], run: NDArray[np.int64], distance: NDArray[np.float64], *, points: int = 40
) -> Curve:
    """Events per kilometre that exceed x, by the bootstrap over runs.

    Args:
        values: Of each event, shape (event,).
        run: Its run, shape (event,).
        distance: Evaluated in each run [m], shape (run,).
        points: How many x, over the range of the values.
    """
    if not len(values) or not math.fsum(distance) > 0.0:
        return Curve.empty(len(distance))
    ordered = np.sort(values)
    x = np.unique(np.concatenate([ordered[_spread(len(ordered), points)], ordered[:1]]))
    total = math.fsum(distance) / 1e3
    rows = []
    for least in x:
        counts = np.bincount(run[values >= least], minlength=len(distance)).astype(float)
        rows.append((counts.sum() / total, *rate_interval(counts, distance / 1e3, 1.0)))
    value, low, high = np.array(rows).T
    return Curve(x, value, low, high, len(distance))


def along_line(
    position: NDArray[np.float64], run: NDArray[np.int64], runs: int, *, length: float
) -> tuple[NDArray[np.float64], Curve]:
    """Separations per run that begin in each piece of the line.

    Args:
        position: Of each separation [m], shape (event,).
        run: Its run, shape (event,).
        runs: Number of runs.
        length: Of a piece [m].

    Returns:
        The edges of the pieces [m], and the curve over their middles.
    """
    if not len(position) or not runs:
        return np.zeros(0), Curve.empty(runs)
    first, last = math.floor(position.min() / length), math.floor(position.max() / length) + 1
    edges = length * np.arange(first, last + 1)
    counts = np.zeros((runs, len(edges) - 1))
    np.add.at(counts, (run, np.minimum(np.searchsorted(edges, position, side="right") - 1, len(edges) - 2)), 1.0)
    one = np.ones(runs)
    bounds = [rate_interval(column, one, 1.0) for column in counts.T]
    low, high = np.array(bounds).T
    return edges, Curve(0.5 * (edges[1:] + edges[:-1]), np.asarray(counts.mean(axis=0), float), low, high, runs)


def time_above(histogram: NDArray[np.float64], width: float) -> Curve:
    """The share of the evaluated steps with Q/Q0 at or above each bin's lower edge, by the bootstrap over runs.

    Args:
        histogram: Steps by bin, shape (run, bin).
        width: Of a bin [-].
    """
    used = np.flatnonzero(histogram.any(axis=0))
    if not len(used):
        return Curve.empty(len(histogram))
    columns = histogram[:, : used[-1] + 1]
    resampled = np.cumsum(resampled_sums(columns)[:, ::-1], axis=1)[:, ::-1]
    total = columns.sum()
    value = np.cumsum(columns.sum(axis=0)[::-1])[::-1] / total
    shares = resampled / resampled[:, :1]
    bounds = np.array([percentile_interval(column) for column in shares.T])
    x = width * np.arange(len(value), dtype=float)
    return Curve(x, np.asarray(value, float), bounds[:, 0], bounds[:, 1], len(histogram))


def _spread(count: int, points: int = _MOST_POINTS) -> NDArray[np.int64]:
    """Indices of at most so many of the sorted values: evenly over the logarithm of their rank, the last ones all."""
    if count <= points:
        return np.arange(count)
    rank = np.unique(np.geomspace(1, count, points).round().astype(np.int64))
    return np.sort(count - rank)
