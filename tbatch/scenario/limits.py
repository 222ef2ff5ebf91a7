"""The [limits] table: what a campaign is judged by, each limit set on an estimate by its name."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, cast

from pydantic import create_model

from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Count, Quantity, Text, Word
from tbatch.scenario.section import Section

BOUNDS = ("estimate", "upper", "lower")
OPEN_ENDED = "largest or smallest seen"

_FORCES = ("contact_force", "force_20hz")
_RANGES = {"": (-1e3, 1e6), "s": (0.0, 1e6), "m": (0.0, 1e6), "N": (-1e9, 1e9)}


def _names() -> Iterator[tuple[str, str, bool]]:
    """Name and unit of each estimate that may have a limit, and whether it has an interval."""
    yield "separation.probability", "", True
    yield "separation.per_km", "", True
    for least in ("0.5ms", "1ms", "5ms", "15ms", "100mm", "1500mm"):
        yield f"separation.probability_{least}", "", True
        yield f"separation.per_km_{least}", "", True
    yield "separation.share", "", True
    for name, unit in (("duration", "s"), ("length", "m"), ("gap", "m"), ("landing_force", "N")):
        yield f"separation.{name}.p50", unit, True
        yield f"separation.{name}.p95", unit, True
    for name, unit in (("duration", "s"), ("gap", "m"), ("landing_force", "N"), ("length", "m")):
        yield f"separation.{name}.max", unit, False
    for force in _FORCES:
        yield f"{force}.max", "N", False
        yield f"{force}.min", "N", False
    for ratio in ("load_ratio", "load_ratio_20hz"):
        for percent in ("50", "95", "99", "99.85"):
            yield f"{ratio}.max.p{percent}", "", True
        for percent in ("50", "5", "1", "0.15"):
            yield f"{ratio}.min.p{percent}", "", True
        for percent in ("0.15", "50", "99.85"):
            yield f"{ratio}.p{percent}", "", True
        for percent in ("50", "95"):
            yield f"{ratio}.section_p99.85.p{percent}", "", True
    for below in ("0.1", "0.2", "0.4", "0.6", "0.8"):
        yield f"unloading.share_below_{below}", "", True
        yield f"unloading.probability_below_{below}", "", True


LIMITABLE: Mapping[str, tuple[str, bool]] = {name: (unit, interval) for name, unit, interval in _names()}
"""Unit of each estimate that may have a limit, and whether it has an interval."""


class Allowed(Section):
    """How many are allowed."""

    max: Annotated[int, Count(0, 10_000_000)] = 0
    """Largest number allowed."""


class Limit(Section):
    """A limit of an estimate, for each speed, and for each wheelset or any of them."""

    max: Any = None
    """Largest value allowed."""
    min: Any = None
    """Smallest value allowed."""
    bound: Annotated[str, Word(BOUNDS)] = "estimate"
    """What must keep within: the estimate, or the upper (for max) or lower (for min) end of its 95 % interval."""
    wheelset: Annotated[str, Word(("each", "any"))] = "each"
    """Whether each wheelset is judged, or any of them in a run."""
    source: Annotated[str, Text("where the limit is from, up to 200 characters", lambda text: len(text) <= 200)] = ""
    """Where the limit is from."""


def _limit_with(unit: str) -> type[Limit]:
    kind = Annotated[float | None, Quantity(unit, *_RANGES[unit])]
    fields = {"max": (kind, None), "min": (kind, None)}
    return cast(type[Limit], create_model(f"Limit{unit or 'Number'}", __base__=Limit, **cast(Any, fields)))


_LIMITS = {unit: _limit_with(unit) for unit in ("", "s", "m", "N")}


class DivergedLimit(Section):
    """The limit that always holds."""

    diverged: Allowed = Allowed()
    """Runs that diverged, in the whole campaign."""


_FIELDS: Any = {name: (_LIMITS[unit] | None, None) for name, (unit, _) in LIMITABLE.items()}
LimitsSection = create_model(
    "LimitsSection", __base__=DivergedLimit, __doc__="Limits that a campaign is judged by.", **_FIELDS
)


def limits_of(section: DivergedLimit) -> dict[str, Limit]:
    """The limits on estimates that a table sets, by the estimate's name."""
    given = {name: getattr(section, name) for name in LIMITABLE}
    return {name: limit for name, limit in given.items() if limit is not None}


def gather_limits(tables: Mapping[str, Any]) -> dict[str, Any]:
    """A [limits] table with each limit under its whole name, whether written as one quoted key or with dots.

    Args:
        tables: The table as written; ``"separation.probability" = {...}`` and ``separation.probability = {...}`` are
            the same.
    """
    found: dict[str, Any] = {}
    for name, value in _leaves(tables, ""):
        before = found.get(name)
        found[name] = {**before, **value} if isinstance(before, dict) and isinstance(value, dict) else value
    return found


def _leaves(table: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    """Whole names with what stands under them; p99 may hold a limit of its own beside that of p99.85."""
    for key, value in table.items():
        name = f"{path}.{key}" if path else str(key)
        if not isinstance(value, dict):
            yield name, value
            continue
        group = name not in LIMITABLE and _leads_to_limit(name)
        inner = {
            key: below
            for key, below in value.items()
            if _leads_to_limit(f"{name}.{key}") or (group and isinstance(below, dict))
        }
        yield from _leaves(inner, name)
        own = {key: below for key, below in value.items() if key not in inner}
        if own or not inner:
            yield name, own


def _leads_to_limit(name: str) -> bool:
    return name in LIMITABLE or any(other.startswith(name + ".") for other in LIMITABLE)


def check_limits(section: DivergedLimit, findings: Findings) -> None:
    """Refuse limits that limit nothing, and bounds that no number of runs gives.

    Args:
        section: The table as read.
        findings: Takes what does not fit.
    """
    for name, limit in limits_of(section).items():
        path = ("limits", name)
        if limit.max is None and limit.min is None:
            findings.refuse(path, "limits nothing", accepted="max, min, or both")
        elif limit.max is not None and limit.min is not None and limit.max < limit.min:
            findings.refuse((*path, "max"), "is below min", value=limit.max, accepted=f"{limit.min:g} and more")
        if limit.bound != "estimate" and not LIMITABLE[name][1]:
            message = f"has no interval to take an end of: it is the {OPEN_ENDED}"
            accepted = '"estimate"; percentiles such as "load_ratio.max.p95" have intervals'
            findings.refuse((*path, "bound"), message, value=limit.bound, accepted=accepted)
        wanted = {"upper": "max", "lower": "min"}.get(limit.bound)
        if wanted is not None and getattr(limit, wanted) is None:
            findings.refuse((*path, "bound"), f"needs {wanted}", value=limit.bound, accepted='"estimate"')
