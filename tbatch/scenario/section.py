"""Tables of a scenario: what they have in common, and how a catalogue completes them."""

import dataclasses
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypeVar

from annotated_types import MaxLen, MinLen
from pydantic import BaseModel, ConfigDict
from pydantic.fields import FieldInfo

from tbatch.scenario.errors import Findings, did_you_mean
from tbatch.scenario.fields import BedQuantity, Field, Quantity

BENDING_STIFFNESS = Quantity("N*m^2", 1.0, 1e12)
LINE_MASS = Quantity("kg/m", 1e-3, 1e6)

S = TypeVar("S", bound="Section")


class Section(BaseModel):
    """A table of the scenario: unknown keys are refused, and once read it does not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class Pair(Section):
    """A small table of two numbers; either may be left to the catalogue."""

    def numbers(self) -> tuple[Any, ...]:
        """Return the two numbers, None where one is not given."""
        return tuple(getattr(self, name) for name in type(self).model_fields)


class Suspension(Pair):
    """A spring and a damper beside it."""

    stiffness: Annotated[float | None, Quantity("N/m", 1.0, 1e13)] = None
    """Stiffness [N/m]."""
    damping: Annotated[float | None, Quantity("N*s/m", 0.0, 1e10)] = None
    """Damping [N s/m]."""


class Bed(Pair):
    """A continuous layer, by fastener spacing or by metre as the track's ``per`` says."""

    stiffness: Annotated[float | None, BedQuantity("N/m", 1.0, 1e13)] = None
    """Stiffness [N/m per fastener spacing, or N/m per metre]."""
    damping: Annotated[float | None, BedQuantity("N*s/m", 0.0, 1e10)] = None
    """Damping [N s/m per fastener spacing, or N s/m per metre]."""


class Beam(Pair):
    """A beam layer."""

    EI: Annotated[float | None, BENDING_STIFFNESS] = None
    """Bending stiffness [N m2]."""
    mass: Annotated[float | None, LINE_MASS] = None
    """Mass [kg/m]."""


class Rayleigh(Pair):
    """Rayleigh damping alpha M + beta K, added to the track's damping."""

    alpha: Annotated[float | None, Quantity("1/s", 0.0, 1e4)] = None
    """Factor of M [1/s]."""
    beta: Annotated[float | None, Quantity("s", 0.0, 0.1)] = None
    """Factor of K [s]."""


def complete(section: S, table: str, parameters: type, entry: Any, findings: Findings) -> S:
    """Return a section with every number of a parameter set: as given, else the catalogue's, else its default.

    Args:
        section: The vehicle's or the track's table.
        table: Its name.
        parameters: Dataclass of the parameter set; its fields are named like the section's keys.
        entry: The catalogue's set, or None if all numbers must be given.
        findings: Takes a problem for each number that is missing.
    """
    filled: dict[str, Any] = {}
    for field in dataclasses.fields(parameters):
        if field.name == "source":
            continue
        default = getattr(entry, field.name) if entry else field.default
        default = None if default is dataclasses.MISSING else default
        optional = not entry and field.default is not dataclasses.MISSING
        given = getattr(section, field.name)
        kind = _pair(type(section), field.name)
        missing: list[tuple[str, ...]]
        if kind is None:
            filled[field.name] = default if given is None else given
            missing = [] if optional or filled[field.name] is not None else [(field.name,)]
        else:
            numbers = given.numbers() if given else (None, None)
            both = {
                name: number if number is not None else usual
                for name, number, usual in zip(kind.model_fields, numbers, default or (None, None), strict=True)
            }
            filled[field.name] = kind.model_construct(**both)
            missing = [(field.name, name) for name, number in both.items() if number is None]
        for path in missing:
            findings.refuse((table, *path), "is missing", accepted=accepted_at(type(section), path))
    return section.model_copy(update=filled)


def refuse_foreign(section: Section, table: str, allowed: Iterable[str], what: str, findings: Findings) -> None:
    """Refuse the keys of a table that its kind does not have.

    Args:
        section: The table.
        table: Its name.
        allowed: The keys the kind has.
        what: The kind, in words.
        findings: Takes a problem for each key.
    """
    allowed = sorted(allowed)
    for name in sorted(section.model_fields_set - set(allowed)):
        findings.refuse(
            (table, name), f"does not belong to {what}{did_you_mean(name, allowed)}", accepted=", ".join(allowed)
        )


def changes(section: Section, entry: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return the numbers of a completed section that differ from a catalogue entry, pairs as tuples."""
    values = {name: getattr(section, name) for name in names}
    plain = {name: value.numbers() if isinstance(value, Pair) else value for name, value in values.items()}
    return {name: value for name, value in plain.items() if entry is None or value != getattr(entry, name)}


def accepted_at(
    section: type[BaseModel], path: Iterable[str | int], context: Mapping[str, Any] | None = None
) -> str | None:
    """Return what is accepted at a key below a section class, None if its fields do not say."""
    keys = [key for key in path if isinstance(key, str)]
    model: type[BaseModel] | None = section
    for count, key in enumerate(keys, start=1):
        if model is None or key not in model.model_fields:
            return None
        field = model.model_fields[key]
        if count == len(keys):
            said = next((kind.accepts(context) for kind in field.metadata if isinstance(kind, Field)), None)
            return said or _accepted_list(field, context)
        model = inner_section(field.annotation)
    return None


def _accepted_list(field: FieldInfo, context: Mapping[str, Any] | None) -> str | None:
    """Return how long a list may be and what its entries may be; None for what is no list."""
    entry = _entry_kind(field.annotation)
    most = next((limit.max_length for limit in field.metadata if isinstance(limit, MaxLen)), None)
    if most is None:
        return None
    least = next((limit.min_length for limit in field.metadata if isinstance(limit, MinLen)), 0)
    count = f"{most}" if least == most else f"{least} to {most}"
    return f"a list of {count}" + (f", each {entry.accepts(context)}" if entry else "")


def _entry_kind(annotation: Any) -> Field | None:
    """Return the kind of value within an annotation such as ``tuple[Annotated[float, Quantity(...)], ...] | None``."""
    if typing.get_origin(annotation) is Annotated:
        return next((kind for kind in annotation.__metadata__ if isinstance(kind, Field)), None)
    return next((kind for part in typing.get_args(annotation) if (kind := _entry_kind(part))), None)


def inner_section(annotation: Any) -> type[BaseModel] | None:
    """Return the section class within an annotation such as ``Bed | None`` or ``tuple[Defect, ...]``."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    return next((found for part in typing.get_args(annotation) if (found := inner_section(part))), None)


def _pair(section: type[BaseModel], name: str) -> type[Pair] | None:
    kind = inner_section(section.model_fields[name].annotation)
    return kind if kind is not None and issubclass(kind, Pair) else None
