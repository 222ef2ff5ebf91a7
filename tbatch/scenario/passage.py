"""The [speed], [run] and [integration] tables: where a run begins and ends, how fast it goes and in which steps."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from tbatch.scenario.distribution import PlainTable, median, read_distribution
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Quantity, Word, refuse
from tbatch.scenario.section import Section

END_MARGIN = 15.0
"""track left in front of wheel 1 at the end of a run whose distance is "auto" [m]"""
REAR_MARGIN = 10.0
"""track behind the last wheel at the start below which a warning is given [m]"""

_MOST_STEPS = 100_000_000
_POSITION = Quantity("m", 0.0, 20e3)
_SPEED = Quantity("m/s", 0.1, 200.0, hint='a bare number is in m/s; write "300 km/h" for km/h')


def _no_speed_twice(speeds: tuple[float, ...]) -> tuple[float, ...]:
    for index, speed in enumerate(speeds):
        if speed in speeds[:index]:
            refuse(f"holds {speed:.6g} m/s ({3.6 * speed:.6g} km/h) twice", "each speed once")
    return speeds


class DistributionTable(PlainTable):
    """A distribution, read once the whole table is."""

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return an example."""
        return '{ kind = "normal", mean = "300 km/h", std = "10 km/h" }'


class Speed(Section):
    """The speeds: each is a case of the campaign; or one case whose samples have speeds of a distribution."""

    values: Annotated[
        tuple[Annotated[float, _SPEED], ...], Field(min_length=1, max_length=1000), AfterValidator(_no_speed_twice)
    ] = ()
    """Speeds [m/s], each once; of a distribution its median, filled in."""
    distribution: Annotated[dict[str, Any] | None, DistributionTable()] = None
    """Distribution of the speed, instead of values."""

    @property
    def range(self) -> tuple[float, float]:
        """Slowest and fastest speed that a run may have [m/s]."""
        if self.distribution is not None:
            return float(self.distribution["low"]), float(self.distribution["high"])
        return min(self.values), max(self.values)


def complete_speed(section: Speed, findings: Findings) -> Speed:
    """Return the table with its distribution in SI, and its median as the one speed.

    Args:
        section: The table as read.
        findings: Takes what is missing or contradicts itself.
    """
    if section.distribution is None:
        if not section.values:
            findings.refuse(("speed", "values"), "is missing", accepted='such as ["200 km/h"], or a distribution')
        return section
    numbers = read_distribution(section.distribution, _SPEED, ("speed", "distribution"), findings)
    if numbers is None:
        return section
    middle = (median(numbers),)
    if section.values not in ((), middle):
        accepted = "either values or a distribution"
        findings.refuse(("speed", "values"), "stands beside a distribution", value=section.values, accepted=accepted)
    return section.model_copy(update={"distribution": numbers, "values": middle})


class RunSection(Section):
    """Where a run begins and ends."""

    start: Annotated[float, _POSITION] = 30.0
    """x of wheel 1 at t = 0 [m]."""
    distance: Annotated[Any, Quantity("m", 0.01, 20e3, words=("auto",))] = "auto"
    """Distance run [m]; "auto" runs until wheel 1 is 15 m before the end of the track. Given on an endless one."""
    taper: Annotated[float, Quantity("m", 0.0, 1000.0)] = 5.0
    """The irregularity fades in over this length from ``start`` [m]; 0 takes it as it is, everywhere."""
    evaluate_from: Annotated[float, _POSITION] = 10.0
    """Statistics of a wheel count once it is this far beyond ``start`` [m]."""


class Integration(Section):
    """The time stepping."""

    scheme: Annotated[str, Word(("two-step",))] = "two-step"
    """Trapezoidal rule, then three-point backward difference."""
    step: Annotated[float, Quantity("s", 1e-7, 1e-2)] = 1e-4
    """Time step [s]."""
    splitting: Annotated[float, Quantity("", 0.05, 0.95)] = 2.0 - 2.0**0.5
    """Where the first of the two parts of a step ends, as a share of the step."""


@dataclass(frozen=True)
class Passage:
    """The way of a vehicle along the track, the same in all runs of a scenario but for the speed."""

    start: float
    """x of wheel 1 at t = 0 [m]"""
    distance: float
    """distance run [m]"""
    taper: float
    """length over which the irregularity fades in from `start`, 0 for none [m]"""
    evaluate_from: float
    """distance beyond `start` from which on a wheel counts [m]"""
    offsets: tuple[float, ...]
    """distance of each wheel behind wheel 1 [m]"""
    fastest_step: float
    """distance run in a step at the highest speed [m]"""

    @property
    def low(self) -> float:
        """Smallest x that a wheel visits [m]."""
        return self.start - max(self.offsets)

    @property
    def high(self) -> float:
        """Largest x that a wheel visits [m]; the last step of a run is a whole one."""
        return self.start + self.distance + self.fastest_step

    def evaluated_length(self, wheel: int = 1) -> float:
        """Return the length over which a wheel counts [m], wheels counted from 1 at the front."""
        return max(0.0, self.distance - self.offsets[wheel - 1] - self.evaluate_from)


def complete_run(
    run: RunSection,
    *,
    offsets: tuple[float, ...],
    track_kind: str,
    reach: tuple[float, float],
    speeds: tuple[float, ...],
    step: float,
    findings: Findings,
) -> tuple[RunSection, Passage | None]:
    """Return the table with the distance as a number, and the passage, None if there is no way to run.

    Args:
        run: The table as read.
        offsets: Distance of each wheel behind wheel 1 [m].
        track_kind: Kind of the track.
        reach: Where it begins and ends [m]; it ends at inf if it is endless.
        speeds: Speeds [m/s].
        step: Time step [s].
        findings: Takes what does not fit on the track.
    """
    begin, end = reach
    rear = run.start - max(offsets)
    before = len(findings.problems)
    fastest_step = max(speeds) * step
    auto = run.distance == "auto"
    endless = math.isinf(end)
    if endless and auto:
        findings.refuse(("run", "distance"), "has no end to run to on an endless track", accepted="0.01 to 20000 m")
        return run, None
    last = end - (END_MARGIN if auto else fastest_step)
    if not endless and (rear < begin or run.start >= last):
        what = f"puts wheel {len(offsets)} at x = {rear:g} m" if rear < begin else "leaves no way to run"
        low = begin + max(offsets)
        enough = f"{'a track' if track_kind == 'matrices' else 'track.length'} above {low - begin + end - last:g} m"
        findings.refuse(
            ("run", "start"),
            f"{what}, on a track from {begin:g} to {end:g} m" + (" and a run that ends 15 m before it" if auto else ""),
            value=run.start,
            accepted=f"{low:g} to below {last:g} m" if low < last else f"nothing on this track; {enough}",
        )
        return run, None
    distance = last - run.start if auto else run.distance
    if run.start + distance > last:
        findings.refuse(
            ("run", "distance"),
            f"runs wheel 1 beyond the end of the track at {end:g} m",
            value=distance,
            accepted=f'"auto", or 0.01 to {math.floor((last - run.start) * 1e4) / 1e4:g} m',
        )
    if run.evaluate_from >= distance:
        message = "lies beyond the end of the run"
        accepted = f"0 to below run.distance = {distance:g} m"
        findings.refuse(("run", "evaluate_from"), message, value=run.evaluate_from, accepted=accepted)
    steps = distance / (min(speeds) * step)
    if steps > _MOST_STEPS:
        accepted = f"at least {distance / (min(speeds) * _MOST_STEPS):.3g} s for {distance:g} m"
        findings.refuse(("integration", "step"), f"makes a run of {steps:.3g} steps", value=step, accepted=accepted)
    passage = Passage(run.start, distance, run.taper, run.evaluate_from, offsets, fastest_step)
    if len(findings.problems) > before:
        return run, None
    _warn(passage, track_kind, end, findings)
    return run.model_copy(update={"distance": distance}), passage


def _warn(passage: Passage, track_kind: str, end: float, findings: Findings) -> None:
    """Note margins that are short and wheels that do not count."""
    if track_kind in ("slab", "winkler") and not math.isinf(end):
        margins = (
            ("run.start", "behind the last wheel at the start", passage.low, REAR_MARGIN),
            (
                "run.distance",
                "in front of wheel 1 at the end",
                end - passage.start - passage.distance,
                END_MARGIN,
            ),
        )
        for key, where, margin, wanted in margins:
            if margin < wanted - 1e-9:
                findings.warn(
                    f"{key}: only {margin:.3g} m of track {where}; below {wanted:g} m the pinned end echoes"
                    " by more than some per cent of a pulse"
                )
    idle = [wheel for wheel in range(1, len(passage.offsets) + 1) if passage.evaluated_length(wheel) <= 0.0]
    if idle:
        wheels = ", ".join(str(wheel) for wheel in idle)
        findings.warn(f"run.distance: too short for wheel {wheels} to count: statistics of it stay empty")
