"""A Fortran format of equal fields, such as ``(1P,3E25.16)``: what stands where in a line of numbers."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

_FORMAT = re.compile(
    r"\((?P<outer>\d*)\(?(?:(?P<scale>[+-]?\d+)P,?)?\(?(?P<count>\d*)\(?"
    r"(?P<kind>[IDFG]|E[SN]?)(?P<width>\d+)(?:\.(?P<digits>\d+))?(?:[ED]\d+)?\)*\)"
)
_REAL = re.compile(r"(?P<digits>[+-]?(?:\d+\.\d*|\.\d+))(?:[EDQ]?(?P<exponent>[+-]\d+)|[EDQ](?P<plain>\d+))?")
_LONGEST = 10_000


@dataclass(frozen=True)
class FortranFormat:
    """Fields of one kind and width, side by side."""

    text: str
    """The format as written."""
    count: int
    """Fields in a line."""
    kind: str
    """I for whole numbers, E, D, F, G for real ones."""
    width: int
    """Characters of a field."""
    scale: int = 0
    """k of kP: a number without an exponent is read as its 10**k-th part."""

    @classmethod
    def parse(cls, text: str) -> "FortranFormat":
        """Return the format that a text describes, with or without repeat counts, kP and exponent widths."""
        found = _FORMAT.fullmatch(text.replace(" ", "").upper())
        if found is not None:
            count = int(found["outer"] or 1) * int(found["count"] or 1)
            width = int(found["width"])
            if 0 < count <= _LONGEST and 0 < width <= _LONGEST:
                return cls(text, count, found["kind"][0], width, int(found["scale"] or 0))
        raise ValueError(f"{text[:40]!r} is no number format; accepted: such as (10I8), (3E25.16), (1P,3D25.16)")

    def lines(self, numbers: int) -> int:
        """Return how many lines some numbers take."""
        return -(-numbers // self.count)

    def fields(self, lines: Sequence[str], numbers: int) -> list[str]:
        """Return the fields of some numbers, in order; those that are missing are empty.

        Numbers that fill their fields stand without blanks between them. Where there are blanks they decide: SciPy
        1.17 writes Harwell-Boeing files whose numbers do not keep to the widths of their format.
        """
        starts = range(0, self.count * self.width, self.width)
        found: list[str] = []
        for line in lines:
            expected = min(self.count, numbers - len(found))
            words = line.split()
            at_widths = (line[start : start + self.width].strip() for start in starts[:expected])
            found += words if len(words) == expected else at_widths
        return found + [""] * (numbers - len(found))

    def whole(self, field: str) -> int:
        """Return the whole number in a field."""
        if re.fullmatch(r"[+-]?\d{1,18}", field, re.ASCII) is None:
            raise ValueError(f"{field[:40]!r} is not a whole number")
        return int(field)

    def real(self, field: str) -> float:
        """Return the number in a field: ``1.5E+03``, ``1.5D+03``, ``1.5+103`` or ``1.5``.

        A number without a decimal point is refused: Fortran would put one in, by the format's digits.
        """
        found = _REAL.fullmatch(field.upper())
        if found is None or not field.isascii():
            raise ValueError(f"{field[:40]!r} is not a number with a decimal point")
        exponent = found["exponent"] or found["plain"]
        if exponent is None:
            return float(found["digits"]) / 10.0**self.scale
        return float(f"{found['digits']}E{exponent}")
