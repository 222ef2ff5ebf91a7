"""Intervals that hold for runs as the unit: exact ones for probabilities, order statistics, the bootstrap over runs."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.numerics.one_thread import one_blas_thread
from tbatch.physics.streams import stream

CONFIDENCE = 0.95
RESAMPLES = 1000
FEW_RUNS = 60
"""With fewer runs that have any event, a rate's interval also heeds the exact one of their probability."""
MOST_GROUPS = 2000
"""Beyond as many runs, neighbouring ones are resampled together: the same spread, at a bounded price."""
_MOST_CELLS = 2e7  # of a matrix of resamples by events

Interval = tuple[float, float]


def exact_interval(successes: int, trials: int, confidence: float = CONFIDENCE) -> Interval:
    """The two-sided Clopper-Pearson interval of a probability; (0, 1) when there were no trials."""
    from scipy.special import betaincinv

    if trials == 0:
        return 0.0, 1.0
    tail, failures = (1.0 - confidence) / 2.0, trials - successes
    low = betaincinv(successes, failures + 1, tail) if successes else 0.0
    high = betaincinv(successes + 1, failures, 1.0 - tail) if failures else 1.0
    return float(low), float(high)


def runs_needed(probability: float, confidence: float = CONFIDENCE) -> int:
    """Runs from which on the largest bounds a quantile from above with this confidence (Wilks): 1,996 for 99.85 %."""
    rare = max(probability, 1.0 - probability)
    return math.ceil(math.log(1.0 - confidence) / math.log(rare))


@lru_cache(maxsize=1024)
def order_statistics(count: int, probability: float, confidence: float = CONFIDENCE) -> tuple[int | None, int | None]:
    """Which of ``count`` sorted values bound a quantile, counted from 0; None for an end that no value bounds.

    With X of the values at or below the quantile, X is binomial; the tails are equal where both ends exist. Where the
    last value bounds it at the full error only (1,996 to 2,457 runs for 99.85 %), the whole error goes to that side.
    """
    from scipy.stats import binom

    error = 1.0 - confidence
    last = probability**count
    tails = (error / 2.0, error / 2.0)
    if error / 2.0 < last <= error:
        tails = (error - last, last)
    elif error / 2.0 < (1.0 - probability) ** count <= error:
        tails = ((1.0 - probability) ** count, error - (1.0 - probability) ** count)
    # value[k] <= quantile holds unless X <= k: P(X <= low) within the tail, and P(X >= high + 1) = P(X > high).
    low = int(binom.ppf(tails[0], count, probability))
    while low >= 0 and binom.cdf(low, count, probability) > tails[0] * (1.0 + 1e-9):
        low -= 1
    high = max(int(binom.isf(tails[1], count, probability)) - 1, 0)
    while high < count and binom.sf(high, count, probability) > tails[1] * (1.0 + 1e-9):
        high += 1
    return (low if low >= 0 else None), (high if high < count else None)


def quantile(values: ArrayLike, probability: float, confidence: float = CONFIDENCE) -> tuple[float, float, float]:
    """A quantile over runs with its distribution-free interval.

    Args:
        values: A value a run; NaN (nothing evaluated) does not count.
        probability: Which quantile.
        confidence: Of the interval.

    Returns:
        The quantile, the smallest value at or below which that share of the runs lies, and its bounds, -inf and inf
        where there are too few runs for one.
    """
    data = np.sort(finite(values))
    if not len(data):
        return math.nan, -math.inf, math.inf
    place = min(max(math.ceil(probability * len(data) - 1e-9) - 1, 0), len(data) - 1)
    low, high = order_statistics(len(data), probability, confidence)
    return (
        float(data[place]),
        -math.inf if low is None else float(data[low]),
        math.inf if high is None else float(data[high]),
    )


def finite(values: ArrayLike) -> NDArray[np.float64]:
    """The values that are numbers."""
    data = np.asarray(values, float)
    return data[~np.isnan(data)]


@lru_cache(maxsize=8)
def _weights(groups: int) -> NDArray[np.float64]:
    """How often each of the groups is drawn, shape (resample, group); the same whenever it is asked for."""
    random = stream(0, 0, f"statistics/bootstrap/{groups}")
    return random.multinomial(groups, np.full(groups, 1.0 / groups), size=RESAMPLES).astype(np.float64)


def groups_of(count: int) -> NDArray[np.int64]:
    """The group that each run is resampled with, shape (run,): its own up to ``MOST_GROUPS`` runs."""
    return np.arange(count) * min(count, MOST_GROUPS) // max(count, 1)


@one_blas_thread
def resampled_sums(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums of columns over runs drawn with replacement.

    Args:
        columns: A row a run, shape (run, column).

    Returns:
        Shape (resample, column).
    """
    group = groups_of(len(columns))
    count = int(group[-1]) + 1 if len(group) else 0
    if not count:
        return np.zeros((RESAMPLES, columns.shape[1]))
    summed = np.add.reduceat(columns, np.searchsorted(group, np.arange(count)), axis=0)
    return _weights(count) @ summed


def resampled_quantiles(
    values: NDArray[np.float64], run: NDArray[np.int64], runs: int, probability: float
) -> NDArray[np.float64]:
    """A quantile of values that come in clusters, a run each, over runs drawn with replacement.

    Args:
        values: The values, shape (event,).
        run: The run of each, shape (event,).
        runs: Number of runs, those without a value included.
        probability: Which quantile.

    Returns:
        Shape (resample,); NaN where no drawn run has a value.
    """
    if not len(values):
        return np.full(RESAMPLES, math.nan)
    order = np.argsort(values, kind="stable")
    group = groups_of(runs)
    weights = _weights(int(group[-1]) + 1)[: max(200, min(RESAMPLES, int(_MOST_CELLS / len(values))))]
    found = np.full(len(weights), math.nan)
    chunk = max(1, int(_MOST_CELLS / len(values)) // 4)
    for first in range(0, len(weights), chunk):
        below = np.cumsum(weights[first : first + chunk, group[run[order]]], axis=1)
        total = below[:, -1]
        place = np.argmax(below >= probability * total[:, None] - 1e-9, axis=1)
        found[first : first + chunk] = np.where(total > 0.0, values[order][place], math.nan)
    return found


def percentile_interval(resampled: NDArray[np.float64], confidence: float = CONFIDENCE) -> Interval:
    """The middle part of resampled estimates; (-inf, inf) where none is a number."""
    data = finite(resampled)
    if not len(data):
        return -math.inf, math.inf
    low, high = np.quantile(data, [(1.0 - confidence) / 2.0, (1.0 + confidence) / 2.0])
    return float(low), float(high)


def rate_interval(
    counts: NDArray[np.float64],
    exposure: NDArray[np.float64],
    least: float,
    confidence: float = CONFIDENCE,
) -> Interval:
    """Interval of Σ counts / Σ exposure, by the bootstrap over runs, widened where few runs have any.

    Where all the events sit in a handful of runs, or there are none, resampling cannot know what it has not met. With
    fewer than ``FEW_RUNS`` such runs, two more speak, and the widest of each end counts: the exact interval of the
    probability that a run has any, times their mean in such a run; and the normal interval of the rate's logarithm,
    which is skewed as a rate of few clusters is.

    Args:
        counts: What each run has of it, events or seconds, shape (run,).
        exposure: Length or time of each run, shape (run,).
        least: What a run has at least if it has any; taken for the mean where no run has.
        confidence: Of the interval.
    """
    total = math.fsum(exposure)
    if total <= 0.0:
        return 0.0, math.inf
    sums = resampled_sums(np.stack([counts, exposure], axis=1))
    with np.errstate(invalid="ignore", divide="ignore"):
        low, high = percentile_interval(sums[:, 0] / sums[:, 1], confidence)
    busy = int(np.count_nonzero(counts))
    if busy >= FEW_RUNS:
        return low, high
    each = math.fsum(counts) / busy if busy else least
    bounds = exact_interval(busy, len(counts), confidence)
    per_run = each * len(counts) / total
    low, high = min(low, bounds[0] * per_run), max(high, bounds[1] * per_run)
    if busy > 1:
        rate = math.fsum(counts) / total
        spread = math.sqrt(math.fsum((counts - rate * exposure) ** 2)) / math.fsum(counts)
        factor = math.exp(_normal_quantile(confidence) * spread)
        low, high = min(low, rate / factor), max(high, rate * factor)
    return low, high


def _normal_quantile(confidence: float) -> float:
    from scipy.special import ndtri

    return float(ndtri((1.0 + confidence) / 2.0))
