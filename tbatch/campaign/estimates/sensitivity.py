"""Which varied numbers decide over separation: rank correlations and first-order shares of the variance.

Both are estimated from the runs as they are. Designs made for Sobol's indices (A, B and A with a column of B) use each
number in several runs, which are then no longer independent, and all other intervals here rest on that they are.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.estimates.intervals import percentile_interval
from tbatch.campaign.estimates.units import Units
from tbatch.physics.streams import stream

OUTCOMES = ("separated", "separations", "longest", "ratio_max", "ratio_min")
"""A run's: whether it separates, how often, the longest [s], largest and smallest Q/Q0."""
_RESAMPLES = 500
LEAST_RUNS = 10
_MOST_DEGREE = 6
_RUNS_A_DEGREE = 20


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
    share: float
    """First-order Sobol index: share of the outcome's variance that a smooth function of the number alone explains."""
    share_low: float
    """Lower end of its 95 % interval, by the noncentral F distribution."""
    share_high: float
    runs: int

    def row(self) -> dict[str, Any]:
        """As plain data, with None where there is no number."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


def sensitivities(units: Units) -> list[Sensitivity]:
    """Of each outcome to each number that varies between the runs."""
    columns = {name: units[name] for name in OUTCOMES if name in units.columns}
    columns = {"separated": (np.nan_to_num(units["separations"]) > 0).astype(float), **columns}
    varied = {name: values for name, values in units.inputs.items() if len(values) and np.ptp(values) > 0.0}
    return [
        _of(name, values, outcome, column)
        for name, values in varied.items()
        for outcome, column in columns.items()
        if not np.isnan(column).all()
    ]


def _of(name: str, values: NDArray[np.float64], outcome: str, column: NDArray[np.float64]) -> Sensitivity:
    known = ~np.isnan(column)
    x, y = _ranks(values[known]), column[known]
    runs = len(x)
    if runs < LEAST_RUNS or np.ptp(y) <= 0.0:
        return Sensitivity(name, outcome, math.nan, -1.0, 1.0, math.nan, 0.0, 1.0, runs)
    drawn = stream(0, 0, "statistics/sensitivity").integers(0, runs, (_RESAMPLES, runs))
    rank = _ranks(y)
    with np.errstate(invalid="ignore", divide="ignore"):
        low, high = percentile_interval(_pearson(x[drawn], rank[drawn]))
    correlation = float(_pearson(x[None], rank[None])[0])
    return Sensitivity(name, outcome, correlation, max(low, -1.0), min(high, 1.0), *first_order(x, y), runs)


def first_order(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float, float]:
    """Share of the variance of y that a function of x alone explains, and its 95 % interval.

    A regression on Legendre polynomials of the rank of x (RS-HDMR), of a degree that rises with the runs up to 6: what
    jumps is underestimated. The share is corrected for the polynomials that fit by chance, the interval that of a
    regression with normal errors.

    Args:
        x: Any order of the number's values, all different, shape (run,).
        y: The outcome, shape (run,).
    """
    runs = len(x)
    degree = min(_MOST_DEGREE, max(2, runs // _RUNS_A_DEGREE))
    place = (2.0 * _ranks(x) - 1.0) / runs - 1.0
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(place, degree))
    deviation = y - y.mean()
    total = float(deviation @ deviation)
    explained = min(float(np.sum((basis.T @ deviation)[1:] ** 2)), total)
    free = runs - degree - 1
    residual = (total - explained) / free
    share = max(0.0, 1.0 - (runs - 1) * residual / total)
    if residual <= 1e-12 * total:
        return share, share, 1.0
    ratio = explained / degree / residual
    ends = [_noncentrality(ratio, degree, free, probability) for probability in (0.975, 0.025)]
    low, high = (end / (end + runs) for end in ends)
    return share, min(low, share), max(high, share)


def _noncentrality(ratio: float, degree: int, free: int, probability: float) -> float:
    """Noncentrality of the F distribution below whose given ratio that probability lies; 0 where none is so small."""
    from scipy.optimize import brentq
    from scipy.special import ncfdtr

    def excess(noncentrality: float) -> float:
        return float(ncfdtr(degree, free, noncentrality, ratio)) - probability

    if excess(0.0) <= 0.0:
        return 0.0
    high = 1.0
    while excess(high) > 0.0:
        high *= 2.0
    return float(brentq(excess, 0.0, high))


def _ranks(values: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.stats import rankdata

    return np.asarray(rankdata(values), float)


def _pearson(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlation along the last axis."""
    dx, dy = x - x.mean(axis=-1, keepdims=True), y - y.mean(axis=-1, keepdims=True)
    return (dx * dy).sum(axis=-1) / np.sqrt((dx**2).sum(axis=-1) * (dy**2).sum(axis=-1))
