"""Which varied numbers decide over separation: rank correlations over the runs, with intervals."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.estimates.intervals import percentile_interval
from tbatch.campaign.estimates.units import Units
from tbatch.physics.streams import stream

OUTCOMES = ("separated", "separations", "longest", "ratio_max", "ratio_min")
"""A run's: whether it separates, how often, the longest [s], largest and smallest Q/Q0."""
_RESAMPLES = 500
LEAST_RUNS = 10


@dataclass(frozen=True)
class Sensitivity:
    """How an outcome of a run goes with a varied number."""

    varied: str
    outcome: str
    correlation: float
    """Spearman's rank correlation, -1 to 1; NaN where one of them does not vary."""
    low: float
    """Lower end of the 95 % interval, by the bootstrap over runs."""
    high: float
    runs: int


def sensitivities(units: Units) -> list[Sensitivity]:
    """Of each outcome to each number that varies between the runs."""
    columns = {name: units[name] for name in OUTCOMES if name in units.columns}
    columns = {"separated": (np.nan_to_num(units["separations"]) > 0).astype(float), **columns}
    varied = {name: values for name, values in units.inputs.items() if len(values) and np.ptp(values) > 0.0}
    return [
        _correlation(name, values, outcome, column)
        for name, values in varied.items()
        for outcome, column in columns.items()
        if not np.isnan(column).all()
    ]


def _correlation(name: str, values: NDArray[np.float64], outcome: str, column: NDArray[np.float64]) -> Sensitivity:
    known = ~np.isnan(column)
    x, y = _ranks(values[known]), _ranks(column[known])
    runs = len(x)
    if runs < LEAST_RUNS or np.ptp(y) <= 0.0:
        return Sensitivity(name, outcome, math.nan, -1.0, 1.0, runs)
    drawn = stream(0, 0, "statistics/sensitivity").integers(0, runs, (_RESAMPLES, runs))
    with np.errstate(invalid="ignore", divide="ignore"):
        low, high = percentile_interval(_pearson(x[drawn], y[drawn]))
    return Sensitivity(name, outcome, float(_pearson(x[None], y[None])[0]), max(low, -1.0), min(high, 1.0), runs)


def _ranks(values: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.stats import rankdata

    return np.asarray(rankdata(values), float)


def _pearson(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlation along the last axis."""
    dx, dy = x - x.mean(axis=-1, keepdims=True), y - y.mean(axis=-1, keepdims=True)
    return (dx * dy).sum(axis=-1) / np.sqrt((dx**2).sum(axis=-1) * (dy**2).sum(axis=-1))
