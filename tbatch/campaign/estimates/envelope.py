"""What most runs keep within, place by place along the line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.estimates.curves import Curve
from tbatch.campaign.estimates.intervals import quantile

SHARES = (0.05, 0.5, 0.95)


@dataclass(frozen=True, eq=False)
class Envelope:
    """Quantiles over runs along the line."""

    x: NDArray[np.float64]
    """place [m], shape (place,)"""
    least: NDArray[np.float64]
    """smallest of all runs, shape (place,)"""
    most: NDArray[np.float64]
    """largest of all runs, shape (place,)"""
    curves: dict[float, Curve]
    """a quantile by its share of the runs, with its distribution-free band, pointwise 95 %"""


def envelope(x: NDArray[np.float64], values: NDArray[np.float64], shares: Sequence[float] = SHARES) -> Envelope:
    """Quantiles over runs at each place.

    Args:
        x: Places [m], shape (place,).
        values: Of each run at each place, shape (run, place); NaN where it has none.
        shares: Which quantiles.
    """
    seen = ~np.isnan(values).all(axis=0)
    x, values = x[seen], values[:, seen]
    curves = {}
    for share in shares:
        rows = np.array([quantile(column, share) for column in values.T]).reshape(-1, 3)
        curves[share] = Curve(x, rows[:, 0], rows[:, 1], rows[:, 2], len(values))
    if not len(values):
        return Envelope(x, x, x, curves)
    return Envelope(x, np.nanmin(values, axis=0), np.nanmax(values, axis=0), curves)
