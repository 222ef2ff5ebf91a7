"""Extreme values: a generalised extreme value or Gumbel distribution of block maxima, and how well it fits.

A run's largest value is the maximum of a block of one run; blocks may gather several runs. The fit is by maximum
likelihood, its goodness by Kolmogorov and Smirnov's distance with the p-value of a parametric bootstrap: fitted
parameters make the tabulated p-values too large. Return values are an extrapolation and said to be one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.campaign.estimates.intervals import Interval, finite, percentile_interval
from tbatch.physics.streams import stream

LEAST_BLOCKS = 20
REPETITIONS = 99
RETURN_RUNS = (1e2, 1e3, 1e4, 1e5)


@dataclass(frozen=True)
class ExtremeFit:
    """A fitted distribution of block maxima."""

    family: str
    """``"gumbel"`` or ``"gev"``."""
    shape: float
    """ξ: positive for a heavy tail, 0 for Gumbel, negative for a tail that ends."""
    location: float
    """In the unit of the values."""
    scale: float
    """In the unit of the values."""
    runs_per_block: int
    blocks: int
    distance: float
    """Kolmogorov and Smirnov's, between the maxima and the fit."""
    p_value: float
    """How often maxima of the fit itself lie at least as far off; small for a bad fit."""
    return_values: tuple[tuple[float, float, float, float], ...]
    """Runs n, the value that one of n runs exceeds on average, and its interval by parametric bootstrap."""
    warning: str
    """What makes it doubtful; empty otherwise."""


def block_maxima(values: ArrayLike, runs_per_block: int = 1) -> NDArray[np.float64]:
    """The largest value of each whole block of consecutive runs, shape (block,)."""
    data = finite(values)
    blocks = len(data) // runs_per_block
    return data[: blocks * runs_per_block].reshape(blocks, runs_per_block).max(axis=1)


def fit_extremes(values: ArrayLike, *, family: str = "gev", runs_per_block: int = 1) -> ExtremeFit | None:
    """Fits block maxima; None with fewer than ``LEAST_BLOCKS`` blocks or maxima that are all the same.

    Args:
        values: The largest value of each run; NaN does not count.
        family: ``"gev"`` or ``"gumbel"``.
        runs_per_block: Runs gathered in a block.
    """
    if family not in ("gev", "gumbel"):
        raise ValueError(f"family is {family!r}: accepted are 'gev' and 'gumbel'")
    maxima = block_maxima(values, runs_per_block)
    if len(maxima) < LEAST_BLOCKS or np.ptp(maxima) <= 0.0:
        return None
    parameters = _fit(maxima, family)
    distance = _distance(maxima, parameters)
    random = stream(0, 0, f"statistics/extremes/{family}")
    further = 0
    levels = np.zeros((REPETITIONS, len(RETURN_RUNS)))
    for row in range(REPETITIONS):
        drawn = _quantile(random.random(len(maxima)), parameters)
        again = _fit(drawn, family)
        further += _distance(drawn, again) >= distance
        levels[row] = _return_values(again, runs_per_block)
    p_value = (1 + further) / (1 + REPETITIONS)
    best = _return_values(parameters, runs_per_block)
    bounds: list[Interval] = [percentile_interval(column) for column in levels.T]
    warnings = []
    if p_value < 0.05:
        warnings.append("does not fit (p < 0.05)")
    if parameters[0] > 0.5:
        warnings.append("tail too heavy for return values to mean much")
    return ExtremeFit(
        family,
        parameters[0],
        parameters[1],
        parameters[2],
        runs_per_block,
        len(maxima),
        distance,
        p_value,
        tuple((runs, float(value), *bound) for runs, value, bound in zip(RETURN_RUNS, best, bounds, strict=True)),
        "; ".join(warnings),
    )


def _fit(maxima: NDArray[np.float64], family: str) -> tuple[float, float, float]:
    """Shape ξ, location and scale by maximum likelihood, found in standardised values."""
    from scipy.stats import genextreme, gumbel_r

    centre, spread = float(np.mean(maxima)), float(np.std(maxima))
    standard = (maxima - centre) / spread
    location, scale = gumbel_r.fit(standard)
    if family == "gumbel":
        return 0.0, centre + spread * float(location), spread * float(scale)
    # scipy's c is -ξ.
    c, location, scale = genextreme.fit(standard, 0.05, loc=location, scale=scale)
    return -float(c), centre + spread * float(location), spread * float(scale)


def _quantile(probability: ArrayLike, parameters: tuple[float, float, float]) -> NDArray[np.float64]:
    shape, location, scale = parameters
    reduced = -np.log(-np.log(np.asarray(probability, float)))
    standard = reduced if abs(shape) < 1e-9 else np.expm1(shape * reduced) / shape
    return np.asarray(location + scale * standard, float)


def cumulative(values: ArrayLike, parameters: tuple[float, float, float]) -> NDArray[np.float64]:
    """P(maximum <= value) for shape ξ, location and scale."""
    shape, location, scale = parameters
    reduced = (np.asarray(values, float) - location) / scale
    with np.errstate(divide="ignore"):
        rare = np.exp(-reduced) if abs(shape) < 1e-9 else np.maximum(1.0 + shape * reduced, 0.0) ** (-1.0 / shape)
    return np.asarray(np.exp(-rare), float)


def _distance(maxima: NDArray[np.float64], parameters: tuple[float, float, float]) -> float:
    expected = cumulative(np.sort(maxima), parameters)
    count = len(maxima)
    above = np.max(np.arange(1, count + 1) / count - expected)
    below = np.max(expected - np.arange(count) / count)
    return float(max(above, below))


def _return_values(parameters: tuple[float, float, float], runs_per_block: int) -> NDArray[np.float64]:
    """Exceeded by one of n runs on average: of a block, with probability 1 - (1 - 1/n)^runs."""
    below = np.exp(runs_per_block * np.log1p(-1.0 / np.array(RETURN_RUNS)))
    return _quantile(below, parameters)


def plotting_positions(count: int) -> NDArray[np.float64]:
    """Gringorten's, shape (count,): where the sorted maxima stand on Gumbel paper."""
    return np.asarray((np.arange(1, count + 1) - 0.44) / (count + 0.12), float)


def reduced_variate(probability: ArrayLike) -> NDArray[np.float64]:
    """-ln(-ln p): the abscissa of Gumbel paper."""
    with np.errstate(divide="ignore"):
        return np.asarray(-np.log(-np.log(np.asarray(probability, float))), float)
