"""A distribution of one number, as a scenario writes it: its own few names, or any continuous one of scipy.stats.

Every distribution has two ends, so that all numbers that can come are checked before the campaign starts: ``low`` and
``high`` where they are given, else where one in a million lies beyond. Between them the shape is kept, scaled to one.
"""

from collections.abc import Mapping
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError

from tbatch.scenario.errors import Findings, Path, did_you_mean
from tbatch.scenario.fields import Field, Quantity, kind_of, refuse

TAIL = 1e-6
"""share of the numbers beyond an end that is not given"""

_OWN = {
    "uniform": ("low", "high"),
    "normal": ("mean", "std"),
    "lognormal": ("median", "sigma"),
    "triangular": ("low", "mode", "high"),
    "loguniform": ("low", "high"),
}
_PLAIN = {"sigma"}  # shape parameters, and these, have no unit
Numbers = Mapping[str, Any]


class PlainTable(Field):
    """A table that is taken as it is and read later, when what it names is known."""

    def check(self, value: Any, info: ValidationInfo) -> dict[str, Any]:
        """Return the table."""
        if not isinstance(value, dict):
            refuse(f"is {kind_of(value)}, not a table", self.accepts(None))
        return value

    def json_schema(self) -> dict[str, Any]:
        """Return a table."""
        return {"type": "object", "description": self.accepts(None)}


def read_distribution(table: Any, quantity: Quantity, path: Path, findings: Findings) -> dict[str, Any] | None:
    """Read a distribution: every parameter as a number in SI, both ends filled in.

    Args:
        table: As written, such as ``{kind = "normal", mean = "60 MN/m", std = "6 MN/m"}``.
        quantity: The number that is distributed: its unit and the range that both ends must keep.
        path: Where it stands.
        findings: Takes what is wrong.

    Returns:
        The distribution, or None if there are problems.
    """
    known = ", ".join(_OWN) + ", or a continuous distribution of scipy.stats"
    if not isinstance(table, dict):
        findings.refuse(path, f"is {kind_of(table)}, not a table", accepted='such as { kind = "normal", mean, std }')
        return None
    kind = table.get("kind")
    names = _parameters(kind) if isinstance(kind, str) else None
    if names is None:
        told = "is missing" if kind is None else f"is not known{did_you_mean(str(kind), _OWN)}"
        findings.refuse((*path, "kind"), told, value=kind, accepted=known)
        return None
    before = len(findings.problems)
    required = [name for name in names if name not in ("loc", "scale")]
    allowed = [*names, *(name for name in ("low", "high") if name not in names)]
    for name in table.keys() - {"kind", *allowed}:
        findings.refuse((*path, name), f"is not a parameter of {kind!r}", accepted=", ".join(allowed))
    numbers: dict[str, Any] = {"kind": kind}
    for name in allowed:
        if name not in table:
            if name in required:
                findings.refuse((*path, name), "is missing", accepted=f"a number, a parameter of {kind!r}")
            continue
        plain = name in _PLAIN or (kind not in _OWN and name in required)
        number = _number(table[name], Quantity("" if plain else quantity.unit, -1e300, 1e300), (*path, name), findings)
        if number is not None:
            numbers[name] = number
    return _with_ends(numbers, quantity, path, findings) if len(findings.problems) == before else None


def _with_ends(numbers: dict[str, Any], quantity: Quantity, path: Path, findings: Findings) -> dict[str, Any] | None:
    """The distribution with both ends, each within the quantity's range."""
    before = len(findings.problems)
    kind = numbers["kind"]
    try:
        whole = _frozen(numbers)
        ends = {"low": float(whole.ppf(TAIL)), "high": float(whole.ppf(1.0 - TAIL))}
    except (ValueError, TypeError, ZeroDivisionError, FloatingPointError):
        ends = {"low": float("nan"), "high": float("nan")}
    filled = {**ends, **numbers}
    if not filled["low"] < filled["high"]:  # NaN too: parameters that make no distribution
        findings.refuse(path, f"is no {kind!r} distribution with these numbers", accepted="positive widths, low < high")
        return None
    if not whole.cdf(filled["high"]) - whole.cdf(filled["low"]) > 1e-9:
        findings.refuse(path, "has next to nothing between low and high", accepted="ends around where the numbers lie")
    for end in ("low", "high"):
        given = _number(filled[end], quantity, (*path, end), findings)
        if given is not None:
            filled[end] = given
    order = {name: filled[name] for name in sorted(filled)}
    return order if len(findings.problems) == before else None


def value_at(numbers: Numbers, share: float) -> float:
    """The number that a share of the distribution lies below, between its ends.

    Args:
        numbers: A distribution as ``read_distribution`` gave it.
        share: 0 to 1.
    """
    frozen, low, high, below, above = _prepared(tuple(sorted(numbers.items())))
    return min(max(float(frozen.ppf(below + share * (above - below))), low), high)


def median(numbers: Numbers) -> float:
    """The number in the middle."""
    return value_at(numbers, 0.5)


@lru_cache(maxsize=256)
def _prepared(items: tuple[tuple[str, Any], ...]) -> tuple[Any, float, float, float, float]:
    numbers = dict(items)
    frozen = _frozen(numbers)
    low, high = float(numbers["low"]), float(numbers["high"])
    return frozen, low, high, float(frozen.cdf(low)), float(frozen.cdf(high))


def _parameters(kind: str) -> tuple[str, ...] | None:
    """Names of a distribution's parameters; None if there is none of that name."""
    if kind in _OWN:
        return _OWN[kind]
    from scipy import stats

    found = getattr(stats, kind, None)
    if not isinstance(found, stats.rv_continuous):
        return None
    shapes = [name.strip() for name in found.shapes.split(",")] if found.shapes else []
    return (*shapes, "loc", "scale")


def _frozen(numbers: Numbers) -> Any:
    """The distribution without its ends, as scipy.stats has it."""
    from scipy import stats

    kind = numbers["kind"]
    if kind == "uniform":
        return stats.uniform(numbers["low"], numbers["high"] - numbers["low"])
    if kind == "normal":
        return stats.norm(numbers["mean"], numbers["std"])
    if kind == "lognormal":
        return stats.lognorm(numbers["sigma"], scale=numbers["median"])
    if kind == "triangular":
        width = numbers["high"] - numbers["low"]
        return stats.triang((numbers["mode"] - numbers["low"]) / width, numbers["low"], width)
    if kind == "loguniform":
        return stats.loguniform(numbers["low"], numbers["high"])
    own = {name: numbers[name] for name in _parameters(kind) or () if name in numbers}
    return getattr(stats, kind)(**own)


def _number(value: Any, quantity: Quantity, path: Path, findings: Findings) -> float | None:
    try:
        return float(quantity.check(value, SimpleNamespace(context=None)))
    except PydanticCustomError as error:
        said = error.context or {}
        findings.refuse(path, str(said.get("message")), value=value, accepted=str(said.get("accepted")))
        return None
