"""Units a user may write, turned into SI numbers by pint.

pint is loaded on the first string with a unit: a scenario in plain SI numbers never pays for it.
"""

import re
from fractions import Fraction
from functools import lru_cache
from typing import Any

from tbatch.cache import cache_folder

# SI unit -> (what it measures, an example of a string a user may write)
DIMENSIONS: dict[str, tuple[str, str]] = {
    "m": ("length", "100 m"),
    "m/s": ("speed", "300 km/h"),
    "s": ("time", "0.1 ms"),
    "kg": ("mass", "40 t"),
    "kg*m^2": ("moment of inertia", "1500 t*m^2"),
    "N": ("force", "250 kN"),
    "N/m": ("stiffness", "60 MN/m"),
    "N/m^2": ("stiffness per metre of track", "60 MN/m^2"),
    "N*s/m": ("damping", "47.7 kN*s/m"),
    "N*s/m^2": ("damping per metre of track", "4.9 kN*s/m^2"),
    "N*m^2": ("bending stiffness", "6.6 MN*m^2"),
    "kg/m": ("mass per metre", "60 kg/m"),
    "N/m^1.5": ("Hertz constant", "1.15e11 N/m^1.5"),
    "1/m": ("wavenumber", "0.5 cycle/m"),
    "1/s": ("mass-proportional Rayleigh coefficient", "0.1 1/s"),
    "rad": ("angle", "90 deg"),
}

_DIGITS = r"[+-]?(?:\d{1,30}(?:\.\d{0,30})?|\.\d{1,30})(?:[eE][+-]?\d{1,3})?"
_NUMBER = re.compile(rf"\s*({_DIGITS})(?![\d.])\s*(.*)", re.DOTALL | re.ASCII)
# Unit text is checked before pint sees it: pint evaluates arithmetic, and "9**9**9 m" would never return.
# One small exponent, directly after a name: towers of powers would not return either.
_UNIT = re.compile(r"[A-Za-zµμΩ%°]+(?:(?:\^|\*\*)-?\d(?:\.\d)?|[²³])?(?![\^²³]|\*\*)|1(?![\d.^]|\*\*)|[*·⋅/()]|\s+")
_NAME = re.compile(r"[A-Za-zµμΩ%°]+")
_PLAIN = {"cycle": "1", "cycles": "1", "·": "*", "⋅": "*"}
_ANGLES = {"rad", "radian", "radians", "deg", "degree", "degrees", "turn", "turns", "rev", "revolution", "rpm"}
_LONGEST_UNIT = 40


class UnitError(ValueError):
    """A string that is no number with a fitting unit; the message says what is wrong with it."""


def to_si(text: str, unit: str) -> float:
    """Turn a string such as ``"300 km/h"`` into a number in an SI unit.

    The conversion is exact before the last rounding, so ``"0.1 ms"`` is the same number as ``1e-4``.

    Args:
        text: A number and a unit.
        unit: The SI unit to return, a key of ``DIMENSIONS``.

    Raises:
        UnitError: No number, no unit, an unknown unit, or a unit of another dimension.
    """
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise UnitError("is not a number with a unit")
    number, written = match[1], match[2].strip()
    if not written:
        raise UnitError("has no unit; leave out the quotes for a number in SI")
    try:
        return float(Fraction(number) * _factor(written, unit))
    except OverflowError:
        raise UnitError("is too large a number") from None


@lru_cache(maxsize=256)
def _factor(written: str, unit: str) -> Fraction:
    """Return how many SI units one written unit is."""
    registry = _registry()
    known = _parse(written)
    target = registry.Unit(unit)
    if known.dimensionality != target.dimensionality or (unit != "rad" and _ANGLES & set(_NAME.findall(written))):
        noun = DIMENSIONS[unit][0]
        measured = [
            other
            for si, (other, _) in DIMENSIONS.items()
            if unit not in ("1/m", "rad") and si != "rad" and registry.Unit(si).dimensionality == known.dimensionality
        ]
        raise UnitError(
            f"measures {measured[0]}, not {noun}"
            if measured and measured[0] != noun
            else f"has the unit {written!r}, which does not measure {noun}"
        )
    return Fraction(registry.convert(Fraction(1), known, target))


def _parse(written: str) -> Any:
    """Return pint's unit for a checked text."""
    tokens: list[str] = _UNIT.findall(written) if len(written) <= _LONGEST_UNIT else []
    if "".join(tokens) != written:
        raise UnitError(f"has a unit that cannot be read: {written[:_LONGEST_UNIT]!r}")
    # In "cycle/m" a cycle is a count; pint would make it 2 pi radians.
    plain = "1" * written.startswith("/") + "".join(_PLAIN.get(token, token) for token in tokens)
    try:
        return _registry().Unit(plain)
    except Exception:  # pint 0.25 lets errors of half a dozen unrelated types through
        raise UnitError(f"has an unknown unit: {written!r}") from None


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    # Fractions make every conversion exact. (Printing a unit of such a registry fails in pint 0.25: we never do.)
    exact: Any = Fraction
    folder = cache_folder(f"pint-{pint.__version__}")
    try:
        return pint.UnitRegistry(non_int_type=exact, cache_folder=folder)
    except Exception:  # a damaged cache: whatever unpickling it may raise
        return pint.UnitRegistry(non_int_type=exact)
