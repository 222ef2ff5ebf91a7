"""The kinds of value a scenario holds: quantities, whole numbers, words, lists and texts.

Each is an annotation for a pydantic field: it checks one value, says what it accepts, and describes itself in the JSON
schema. pydantic's own checks of these would say less, so they are not used for single values.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from tbatch.scenario.errors import did_you_mean
from tbatch.scenario.units import DIMENSIONS, UnitError, to_si


def refuse(message: str, accepted: str) -> NoReturn:
    """Refuse a value.

    Args:
        message: What is wrong, in words that follow the value.
        accepted: What is accepted instead.
    """
    # The texts go in as context: as a message template, a brace in a user's text would be an error of its own.
    raise PydanticCustomError("tbatch", "{message}", {"message": message, "accepted": accepted})


class Field:
    """What the kinds of value have in common; ``check`` and ``json_schema`` differ."""

    def check(self, value: Any, info: ValidationInfo) -> Any:
        """Return the value as the scenario keeps it, or refuse it."""
        raise TypeError(f"{type(self).__name__} has no check")

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return what is accepted, in words; ``context`` is the loader's."""
        return ""

    def json_schema(self) -> dict[str, Any]:
        """Return the JSON schema of what a user may write."""
        return {}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Let pydantic call ``check`` instead of a check of its own."""
        return core_schema.with_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Let pydantic describe the field by ``json_schema``."""
        return self.json_schema()


@dataclass(frozen=True)
class Quantity(Field):
    """A number in SI, or a string with a unit; kept as a float in SI."""

    unit: str
    """SI unit, a key of ``units.DIMENSIONS``; empty for a plain number."""
    least: float
    """Smallest value accepted."""
    most: float
    """Largest value accepted."""
    above: bool = False
    """Whether ``least`` itself is refused."""
    below: bool = False
    """Whether ``most`` itself is refused."""
    words: tuple[str, ...] = ()
    """Words accepted instead of a number."""
    hint: str = ""
    """Said in addition when a bare number is out of range."""

    def check(self, value: Any, info: ValidationInfo) -> float | str:
        """Return the number in SI, or one of the words."""
        unit = self.unit_in(info.context)
        accepted = self.accepts(info.context)
        if isinstance(value, str):
            if value in self.words:
                return value
            if not unit:
                refuse("is a string", accepted)
            try:
                number = to_si(value, unit)
            except UnitError as error:
                refuse(str(error) + did_you_mean(value, self.words), accepted)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                refuse("is too large a number", accepted)
        else:
            refuse(f"is {kind_of(value)}, not a number", accepted)
        low = number <= self.least if self.above else number < self.least
        high = number >= self.most if self.below else number > self.most
        if low or high or math.isnan(number):
            aside = f" ({self.hint})" if self.hint and not isinstance(value, str) else ""
            refuse(f"is out of range{aside}", accepted)
        return number + 0.0  # no -0.0

    def unit_in(self, context: Mapping[str, Any] | None) -> str:
        """Return the unit expected where this field stands."""
        return self.unit

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return the range and the ways to write it."""
        unit = self.unit_in(context)
        low = f"above {self.least:g}" if self.above else f"{self.least:g}"
        high = f"below {self.most:g}" if self.below else f"{self.most:g}"
        text = f"{low} to {high}" + (f' {unit} (a number, or a string such as "{DIMENSIONS[unit][1]}")' if unit else "")
        return text + "".join(f' or "{word}"' for word in self.words)

    def json_schema(self) -> dict[str, Any]:
        """Return number-or-string with the range in SI."""
        number: dict[str, Any] = {"type": "number", "description": f"in {self.unit}" if self.unit else "a plain number"}
        number["exclusiveMinimum" if self.above else "minimum"] = self.least
        number["exclusiveMaximum" if self.below else "maximum"] = self.most
        ways: list[dict[str, Any]] = [number]
        if self.unit:
            noun, example = DIMENSIONS[self.unit]
            ways.append({"type": "string", "description": f"{noun} with a unit", "examples": [example]})
        elif self.words:
            ways.append({"enum": list(self.words)})
        return {"anyOf": ways} if len(ways) > 1 else number


@dataclass(frozen=True)
class BedQuantity(Quantity):
    """A quantity of a layer that is per fastener or, if the track says ``per = "metre"``, per metre of track."""

    def unit_in(self, context: Mapping[str, Any] | None) -> str:
        """Return the unit for the track's ``per``, which the loader passes as context."""
        per_metre = (context or {}).get("per") == "metre"
        return {"N/m": "N/m^2", "N*s/m": "N*s/m^2"}[self.unit] if per_metre else self.unit


@dataclass(frozen=True)
class Count(Field):
    """A whole number."""

    least: int
    """Smallest value accepted."""
    most: int
    """Largest value accepted."""

    def check(self, value: Any, info: ValidationInfo) -> int:
        """Return the whole number."""
        accepted = self.accepts(info.context)
        if isinstance(value, bool) or not isinstance(value, int):
            refuse(f"is {kind_of(value)}", accepted)
        if not self.least <= value <= self.most:
            refuse("is out of range", accepted)
        return value

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return the range."""
        return f"a whole number, {self.least} to {self.most}"

    def json_schema(self) -> dict[str, Any]:
        """Return the range."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


@dataclass(frozen=True)
class Word(Field):
    """One of some words, or of a catalogue's names."""

    words: Sequence[str] | Callable[[], Sequence[str]]
    """The words, or what returns them: a catalogue is read when it is asked for."""

    def check(self, value: Any, info: ValidationInfo) -> str:
        """Return the word."""
        words, accepted = self._listed(), self.accepts(info.context)
        if not isinstance(value, str):
            refuse(f"is {kind_of(value)}", accepted)
        if value not in words:
            refuse("is not known" + did_you_mean(value, words), accepted)
        return value

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return the words."""
        return ", ".join(f'"{word}"' for word in self._listed())

    def json_schema(self) -> dict[str, Any]:
        """Return the words."""
        return {"enum": list(self._listed())}

    def _listed(self) -> Sequence[str]:
        return self.words() if callable(self.words) else self.words


@dataclass(frozen=True)
class Flag(Field):
    """true or false."""

    def check(self, value: Any, info: ValidationInfo) -> bool:
        """Return the truth value."""
        if not isinstance(value, bool):
            refuse(f"is {kind_of(value)}", self.accepts(info.context))
        return value

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return the two."""
        return "true or false"

    def json_schema(self) -> dict[str, Any]:
        """Return the type."""
        return {"type": "boolean"}


@dataclass(frozen=True)
class Text(Field):
    """A text that a given rule accepts."""

    meant: str
    """What is accepted, in words."""
    fits: Callable[[str], bool]
    """The rule."""

    def check(self, value: Any, info: ValidationInfo) -> str:
        """Return the text."""
        if not isinstance(value, str):
            refuse(f"is {kind_of(value)}", self.meant)
        if not self.fits(value):
            refuse("cannot be used", self.meant)
        return value

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return the words for it."""
        return self.meant

    def json_schema(self) -> dict[str, Any]:
        """Return the type."""
        return {"type": "string", "description": self.meant}


def kind_of(value: Any) -> str:
    """Return what a TOML value is, in words."""
    kinds = {
        bool: "true or false",
        int: "a whole number",
        float: "a number",
        str: "a string",
        list: "a list",
        dict: "a table",
    }
    return kinds.get(type(value), "a date or time")
