"""How estimates settle as runs are added: the same estimate from the first n runs, for growing n."""

from collections.abc import Sequence

import numpy as np

from tbatch.campaign.estimates.estimate import Estimate
from tbatch.campaign.estimates.intervals import quantile, runs_needed
from tbatch.campaign.estimates.loads import ORDER
from tbatch.campaign.estimates.separation import probability_of, rate_of
from tbatch.campaign.estimates.units import Units

FOLLOWED = ("separation.probability", "separation.per_km", "load_ratio.max.p95")
_FIRST = 8
_POINTS_PER_DOUBLING = 2


def sizes(runs: int) -> list[int]:
    """Numbers of runs at which estimates are followed: rising by the square root of two, all of them last."""
    counts = []
    step = 2.0 ** (1.0 / _POINTS_PER_DOUBLING)
    size = float(_FIRST)
    while round(size) < runs:
        counts.append(round(size))
        size *= step
    return [*counts, runs] if runs else []


def convergence(units: Units, followed: Sequence[str] = FOLLOWED) -> dict[str, list[Estimate]]:
    """Each followed estimate from the first n runs, for growing n."""
    found: dict[str, list[Estimate]] = {name: [] for name in followed}
    for count in sizes(len(units)):
        for name, points in found.items():
            points.append(_estimate(name, units, count))
    return found


def _estimate(name: str, units: Units, count: int) -> Estimate:
    separations = np.nan_to_num(units["separations"][:count])
    if name == "separation.probability":
        return probability_of(name, separations > 0)
    if name == "separation.per_km":
        return rate_of(name, separations, units["evaluated_distance"][:count])
    if name == "load_ratio.max.p95":
        value, low, high = quantile(units["ratio_max"][:count], 0.95)
        return Estimate(name, "", value, low, high, ORDER, count, runs_needed=runs_needed(0.95))
    raise ValueError(f"estimate is {name!r}: followed can be {', '.join(FOLLOWED)}")
