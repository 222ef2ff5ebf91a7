"""How estimates settle as runs are added: every estimate from the first n runs, for growing n."""

from tbatch.campaign.estimates import estimates
from tbatch.campaign.estimates.estimate import Estimate
from tbatch.campaign.estimates.units import Units

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


def convergence(units: Units) -> dict[int, dict[str, Estimate]]:
    """Every estimate by name from the first n runs, for growing n; some need more runs than others to exist."""
    return {count: {one.name: one for one in estimates(units.first(count))} for count in sizes(len(units))}
