"""The [vary] table: numbers of the vehicle, the contact and the irregularity that differ from sample to sample."""

import re
from collections.abc import Mapping
from typing import Annotated, Any

from tbatch.scenario.distribution import PlainTable, read_distribution
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Quantity
from tbatch.scenario.section import Section

TABLES = ("vehicle", "contact", "irregularity")

_FIXED = {
    "vehicle.bogie_half_distance": "all runs have their wheels at the same places",
    "vehicle.axle_half_distance": "all runs have their wheels at the same places",
    "vehicle.wheel_radius": "vary contact.wheel_radius, where it acts",
    "irregularity.tail_from": "the spectrum's band is checked once",
}
_STEP = re.compile(r"([A-Za-z_]+)((?:\[\d{1,6}\])*)", re.ASCII)
_WAVES = re.compile(r"irregularity\.(wavelengths.*|cosines\[\d+\]\.(wavenumber|wavelength))")


class VaryTable(PlainTable):
    """A table of distributions by the dotted key of the number; read once all other tables are complete."""

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return an example."""
        return '"vehicle.primary.stiffness" = { kind = "uniform", low = "1 MN/m", high = "2 MN/m" }'


Vary = Annotated[dict[str, Any] | None, VaryTable()]


def complete_vary(table: Mapping[str, Any], sections: Mapping[str, Any], findings: Findings) -> dict[str, Any]:
    """Return the table with each distribution in SI, by the whole key, sorted.

    Args:
        table: As written, keys quoted or dotted.
        sections: The completed tables that numbers are varied in.
        findings: Takes what cannot be varied and what is no distribution.
    """
    complete = {}
    for key, given in sorted(_gathered(table, "").items()):
        path = ("vary", key)
        if key.partition(".")[0] == "track":
            told = "cannot vary: the track is factorised once for all runs"
            findings.refuse(path, told, accepted="numbers of vehicle, contact or irregularity")
            continue
        if key in _FIXED or _WAVES.fullmatch(key):
            findings.refuse(path, "cannot vary", accepted=_FIXED.get(key, "irregularity.scale, or an amplitude"))
            continue
        if any(name not in sections for name in TABLES):
            continue  # they have problems of their own
        quantity = _quantity(key, sections)
        if quantity is None:
            accepted = "a number that this scenario uses, such as vehicle.primary.stiffness or irregularity.scale"
            findings.refuse(path, "is no number of this scenario that can vary", accepted=accepted)
            continue
        if (numbers := read_distribution(given, quantity, path, findings)) is not None:
            complete[key] = numbers
    return complete


def _gathered(table: Mapping[str, Any], path: str) -> dict[str, Any]:
    """Distributions by their whole keys: a table with a kind is one, any other leads further."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{path}.{key}" if path else str(key)
        if (
            isinstance(value, dict)
            and "kind" not in value
            and value
            and all(isinstance(v, dict) for v in value.values())
        ):
            found |= _gathered(value, name)
        else:
            found[name] = value
    return found


def _steps(key: str) -> list[str | int] | None:
    """The way to a number: names and indices; None for what is no dotted key."""
    steps: list[str | int] = []
    for part in key.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            return None
        steps += [match[1], *(int(index) for index in re.findall(r"\d+", match[2]))]
    return steps


def _quantity(key: str, sections: Mapping[str, Any]) -> Quantity | None:
    """What kind of number stands at a key; None where none does."""
    steps = _steps(key)
    if steps is None or steps[0] not in TABLES or len(steps) < 2:
        return None
    at, found = sections[str(steps[0])], None
    for step in steps[1:]:
        found = None
        if isinstance(step, int):
            if not isinstance(at, tuple) or step >= len(at):
                return None
            at = at[step]
        elif isinstance(at, Section) and step in type(at).model_fields:
            kinds = type(at).model_fields[step].metadata
            found = next((kind for kind in kinds if isinstance(kind, Quantity)), None)
            at = getattr(at, step)
        else:
            return None
    return found if isinstance(at, float) else None


def with_numbers(section: Any, steps: tuple[str | int, ...], number: float) -> Any:
    """Return a completed table with another number at a place.

    Args:
        section: The table, or a tuple of tables.
        steps: Names and indices that lead to the number.
        number: The number, in SI.
    """
    step, rest = steps[0], steps[1:]
    if isinstance(step, int):
        inner = with_numbers(section[step], rest, number)
        return (*section[:step], inner, *section[step + 1 :])
    return section.model_copy(update={step: with_numbers(getattr(section, step), rest, number) if rest else number})


def varied_section(name: str, section: Any, numbers: Mapping[str, float]) -> Any:
    """Return a completed table with a sample's numbers in it.

    Args:
        name: Of the table.
        section: The table.
        numbers: By dotted key; those of other tables do not matter.
    """
    for key, number in numbers.items():
        if key.startswith(name + "."):
            section = with_numbers(section, tuple(_steps(key) or ())[1:], number)
    return section
