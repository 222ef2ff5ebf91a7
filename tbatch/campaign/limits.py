"""Whether a campaign keeps within its limits: a verdict for each limit, speed and wheelset."""

import copy
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import ANY_WHEELSET, Estimate
from tbatch.campaign.estimates.estimate import shown as number
from tbatch.campaign.summary import KMH
from tbatch.scenario.errors import Findings, Problem, ScenarioError, did_you_mean, dotted, shown
from tbatch.scenario.fields import kind_of
from tbatch.scenario.limits import (
    LIMITABLE,
    Allowed,
    DivergedLimit,
    Limit,
    LimitsSection,
    check_limits,
    gather_limits,
    limits_of,
)
from tbatch.scenario.source import parse_override, set_value

_ACCEPTED = "the names that tbatch stats --all lists"


@dataclass(frozen=True)
class Verdict:
    """Whether one limit is kept."""

    limit: str
    """Name of the estimate, ``diverged`` or ``complete``."""
    place: str
    """Speed and wheelset in words, or ``campaign``."""
    passed: bool
    message: str
    """What was judged, against what, in words."""
    source: str = ""
    """Where the limit is from."""


def stored_limits(campaign: Campaign, overrides: Iterable[str] = ()) -> DivergedLimit:
    """The limits that a campaign was run with, some of them changed.

    Args:
        campaign: The campaign.
        overrides: Changes such as ``'limits."separation.probability".max=0.1'``; other keys are refused.
    """
    tables: dict[str, Any] = {"limits": copy.deepcopy(campaign.store.resolved.get("limits", {}))}
    problems: list[Problem] = []
    for text in overrides:
        path, value = parse_override(text)
        if path[0] != "limits" or len(path) < 2:
            problems.append(Problem(path, "is no limit: only limits can be changed afterwards", accepted="limits...."))
            continue
        if (blocked := set_value(tables, path, value)) is not None:
            problems.append(Problem(path, f"cannot be set: {dotted(blocked)} is not a table with such an entry"))
    try:
        section = LimitsSection.model_validate(gather_limits(tables["limits"]))
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            path, said = ("limits", *detail["loc"]), detail.get("ctx", {})
            if detail["type"] == "extra_forbidden" and len(detail["loc"]) == 1:
                name = str(detail["loc"][0])
                problems.append(Problem(path, f"is no estimate{did_you_mean(name, LIMITABLE)}", accepted=_ACCEPTED))
            else:
                told, accepted = said.get("message"), said.get("accepted")
                if told is None:  # pydantic's own: a key that is not known, or a value where a table belongs
                    table = Allowed if path[1] == "diverged" else Limit
                    unknown = detail["type"] == "extra_forbidden"
                    told = "is not a known key" if unknown else f"is {kind_of(detail['input'])}, not a table"
                    accepted = ", ".join(table.model_fields)
                problems.append(Problem(path, told, shown(detail["input"]), accepted))
        raise ScenarioError(problems) from error
    findings = Findings()
    check_limits(section, findings)
    if problems + findings.problems:
        raise ScenarioError([*problems, *findings.problems])
    return section


def judge(campaign: Campaign, limits: DivergedLimit) -> list[Verdict]:
    """A verdict for each limit, at each speed for each wheelset or any of them, and for the campaign as a whole."""
    return [*_of_campaign(campaign, limits), *_of_estimates(campaign, limits_of(limits))]


def _of_campaign(campaign: Campaign, limits: DivergedLimit) -> Iterator[Verdict]:
    missing = sum(len(shard) for shard in campaign.missing())
    told = f"{campaign.runs_stored} runs stored, {missing} missing"
    yield Verdict("complete", "campaign", missing == 0, told)
    allowed = limits.diverged.max
    told = f"{campaign.diverged} runs diverged, {allowed} allowed"
    yield Verdict("diverged", "campaign", campaign.diverged <= allowed, told)


def _of_estimates(campaign: Campaign, limits: dict[str, Limit]) -> Iterator[Verdict]:
    if not limits:
        return
    for case, speed in enumerate(campaign.speeds):
        for wheel in (*campaign.records.wheels, ANY_WHEELSET):
            wanted = "any" if wheel == ANY_WHEELSET else "each"
            chosen = {name: limit for name, limit in limits.items() if limit.wheelset == wanted}
            if not chosen:
                continue
            found = {estimate.name: estimate for estimate in campaign.estimates(case, wheel)}
            place = f"{speed * KMH:.4g} km/h, " + ("any wheelset" if wheel == ANY_WHEELSET else f"wheelset {wheel}")
            for name, limit in chosen.items():
                yield verdict(found.get(name), name, limit, place)


def verdict(estimate: Estimate | None, name: str, limit: Limit, place: str) -> Verdict:
    """Whether an estimate keeps a limit.

    What these runs do not bound fails a limit on that bound; an event that never happened has no size to limit.

    Args:
        estimate: The estimate; None where the store does not hold what it needs.
        name: Its name.
        limit: The limit.
        place: Speed and wheelset in words.
    """
    if estimate is None or estimate.runs == 0:
        return Verdict(name, place, False, "nothing was evaluated", limit.source)
    if math.isnan(estimate.value):
        nothing = estimate.count == 0
        return Verdict(name, place, nothing, "no event" if nothing else "nothing was evaluated", limit.source)
    judged = {"estimate": estimate.value, "upper": estimate.high, "lower": estimate.low}[limit.bound]
    ends = [(side, value) for side, value in (("max", limit.max), ("min", limit.min)) if value is not None]
    passed = all(judged <= value if side == "max" else judged >= value for side, value in ends)
    end = "" if limit.bound == "estimate" else f"{limit.bound} end "
    seen = number(judged, estimate.unit)
    if not math.isfinite(judged):
        seen += f" ({estimate.flag or 'not bounded by these runs'})"
    allowed = " and ".join(f"{side} {number(value, estimate.unit)}" for side, value in ends)
    told = (
        f"{end}{seen}, limit {allowed}; estimate {number(estimate.value, estimate.unit)}, 95 % interval"
        f" {number(estimate.low, estimate.unit)} to {number(estimate.high, estimate.unit)}, {estimate.runs} runs"
    )
    return Verdict(name, place, passed, told, limit.source)
