"""Estimates about separations: how likely, how often, how long, how wide, how hard the landing."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.estimates.estimate import RAW, Estimate
from tbatch.campaign.estimates.intervals import (
    exact_interval,
    percentile_interval,
    rate_interval,
    resampled_quantiles,
)
from tbatch.campaign.estimates.units import Units

LEAST_DURATIONS = (0.5e-3, 1e-3, 5e-3, 15e-3)
"""Durations from which on separations are counted apart [s]."""
LEAST_LENGTHS = (0.1, 1.5)
"""Lengths from which on they are counted apart [m]; 1.5 m is about the five feet of American track rules."""
EVENT_QUANTILES = (0.5, 0.95)

EXACT = "exact (Clopper-Pearson)"
BOOTSTRAP = "bootstrap over runs"
ONE_A_RUN = "exact, one event a run assumed"
LARGEST_SEEN = "largest seen"


def separation_estimates(units: Units) -> Iterator[Estimate]:
    """All of them for the runs of a speed and wheelset."""
    count = len(units)
    separations = np.nan_to_num(units["separations"])
    distance = units["evaluated_distance"]
    yield probability_of("separation.probability", separations > 0)
    yield rate_of("separation.per_km", separations, distance)
    for name, least, size in _least(units):
        chosen = size >= least * (1.0 - 1e-9)
        each = np.bincount(units.event_unit[chosen], minlength=count).astype(float)
        yield probability_of(f"separation.probability_{name}", each > 0)
        yield rate_of(f"separation.per_km_{name}", each, distance)
    time = units["evaluated_time"]
    yield share("separation.share", units["separated_time"], time)
    whole = units.events.get("censored", np.zeros(len(units.event_unit))) < 0.5
    every = np.full(len(whole), True)
    for name, unit, chosen in (
        ("duration", "s", whole),
        ("length", "m", whole),
        ("gap", "m", every),
        ("landing_force", "N", every),
    ):
        if name in units.events:
            run = units.event_unit[chosen]
            yield from _events(f"separation.{name}", unit, units.events[name][chosen], run, count)
    for name, largest_of_run, unit in (
        ("duration", "longest", "s"),
        ("gap", "largest_gap", "m"),
        ("landing_force", "largest_landing_force", "N"),
    ):
        largest = float(np.max(units[largest_of_run], initial=0.0)) if count else math.nan
        yield Estimate(f"separation.{name}.max", unit, largest, largest, math.inf, LARGEST_SEEN, count)
    lengths = units.events["length"][whole] if "length" in units.events else np.zeros(0)
    longest = float(np.max(lengths, initial=0.0)) if count else math.nan
    yield Estimate("separation.length.max", "m", longest, longest, math.inf, LARGEST_SEEN, count)


def _least(units: Units) -> Iterator[tuple[str, float, NDArray[np.float64]]]:
    """Name, least value and the column it is asked of; a censored separation counts with what was seen of it."""
    for least in LEAST_DURATIONS:
        yield f"{1e3 * least:g}ms", least, units.events.get("duration", np.zeros(0))
    for least in LEAST_LENGTHS:
        yield f"{1e3 * least:g}mm", least, units.events.get("length", np.zeros(0))


def probability_of(name: str, happened: NDArray[np.bool_], family: str = RAW) -> Estimate:
    """The probability that something happens in a run, with its exact interval."""
    runs, times = len(happened), int(np.count_nonzero(happened))
    value = times / runs if runs else math.nan
    return Estimate(name, "", value, *exact_interval(times, runs), EXACT, runs, times, family=family)


def rate_of(name: str, counts: NDArray[np.float64], distance: NDArray[np.float64]) -> Estimate:
    """Events per wheelset-kilometre, from the events and the evaluated distance [m] of each run."""
    total = math.fsum(distance) / 1e3
    value = math.fsum(counts) / total if total > 0.0 else math.nan
    low, high = rate_interval(counts, distance / 1e3, 1.0)
    method = BOOTSTRAP if counts.any() else ONE_A_RUN
    return Estimate(name, "1/km", value, low, high, method, len(counts), int(counts.sum()))


def share(name: str, part: NDArray[np.float64], whole: NDArray[np.float64], family: str = RAW) -> Estimate:
    """A share of the evaluated time, at most one; where no run has any, a run may have the whole of its time."""
    runs, total = len(part), math.fsum(whole)
    value = math.fsum(part) / total if total > 0.0 else math.nan
    low, high = rate_interval(part, whole, total / max(runs, 1))
    busy = int(np.count_nonzero(part))
    return Estimate(name, "", value, low, min(high, 1.0), BOOTSTRAP, runs, busy, family=family)


def _events(name: str, unit: str, values: NDArray[np.float64], run: NDArray[np.int64], runs: int) -> Iterator[Estimate]:
    """Quantiles over the events, which come in clusters, a run each."""
    for probability in EVENT_QUANTILES:
        value = math.nan
        low, high = -math.inf, math.inf
        if len(values):
            ordered = np.sort(values)
            value = float(ordered[max(math.ceil(probability * len(values) - 1e-9) - 1, 0)])
            low, high = percentile_interval(resampled_quantiles(values, run, runs, probability))
        place = f"{name}.p{100 * probability:g}"
        yield Estimate(place, unit, value, low, high, BOOTSTRAP, runs, len(values))
