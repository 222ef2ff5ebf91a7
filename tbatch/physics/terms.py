"""Terms: what an irregularity is a sum of."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.physics.partition import Piece, overlay, points
from tbatch.physics.refinement import refine

FloatArray = NDArray[np.float64]
Function = Callable[[FloatArray], ArrayLike]


class Term(Protocol):
    """One summand of an irregularity."""

    @property
    def period(self) -> float:
        """The longest span on which the term does not repeat itself [m]."""
        ...

    @property
    def shortest_wavelength(self) -> float:
        """The shortest wavelength of its waves [m], inf where it states none."""
        ...

    @property
    def everywhere(self) -> bool:
        """Whether it may be evaluated beyond the span asked for."""
        ...

    def __call__(self, x: FloatArray) -> FloatArray:
        """The exact value at any points [m], same shape as x."""
        ...

    def pieces(self, low: float, high: float) -> list[Piece]:
        """Where the term is smooth and the spacing of knots it needs there."""
        ...

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The exact value at ``low + width * j``, j = 0 ... count [m], a grid within one of its pieces."""
        ...


def sum_terms(terms: Sequence[Term], x: FloatArray) -> FloatArray:
    """The sum of terms at any points [m], same shape as x."""
    value = np.zeros(x.shape)
    for term in terms:
        value += term(x)
    return value


def sum_on_grid(terms: Sequence[Term], low: float, width: float, count: int) -> FloatArray:
    """The sum of terms at ``low + width * j``, j = 0 ... count [m]."""
    value = np.zeros(count + 1)
    for term in terms:
        value += term.on_grid(low, width, count)
    return value


@dataclass(frozen=True, eq=False)
class FunctionTerm:
    """A callable of unknown shape as a term."""

    function: Function
    """r(x) of an array [m]"""
    breaks: tuple[float, ...]
    """where it has kinks, rising [m]"""
    period = math.inf
    shortest_wavelength = math.inf
    everywhere = False

    def __call__(self, x: FloatArray) -> FloatArray:
        """The function's values [m], checked."""
        value = np.asarray(self.function(x), dtype=np.float64)
        try:
            value = np.broadcast_to(value, x.shape)
        except ValueError:
            raise ValueError(
                f"irregularity function gives shape {value.shape} for x of shape {x.shape}:"
                " accepted is r(x) of an array"
            ) from None
        if not np.isfinite(value).all():
            place = float(x[~np.isfinite(value)].flat[0])
            raise ValueError(f"irregularity function is not finite at x = {place:.6g} m")
        return value

    def pieces(self, low: float, high: float) -> list[Piece]:
        """Found by looking at the function."""
        return refine(self, low, high, breaks=self.breaks)

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The function at ``low + width * j``, j = 0 ... count [m]."""
        return self(points(low, width, count))


@dataclass(frozen=True, eq=False)
class TaperedTerm:
    """A surface faded in: zero up to start, 3s² - 2s³ of it over length, then all of it."""

    terms: tuple[Term, ...]
    """what is faded in"""
    start: float
    """x up to which it is zero [m]"""
    length: float
    """over which it rises [m]"""

    @property
    def period(self) -> float:
        """That of the terms [m]."""
        return min((term.period for term in self.terms), default=math.inf)

    @property
    def shortest_wavelength(self) -> float:
        """That of the terms [m]."""
        return min((term.shortest_wavelength for term in self.terms), default=math.inf)

    @property
    def everywhere(self) -> bool:
        """Whether all terms exist beyond the span asked for."""
        return all(term.everywhere for term in self.terms)

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not math.isfinite(self.start):
            raise ValueError(f"start = {self.start!r}: accepted for a taper is a finite place [m]")
        if not (math.isfinite(self.length) and self.length > 0.0):
            raise ValueError(f"length = {self.length!r}: accepted for a taper is a finite length above 0 m")

    def _rise(self, x: FloatArray) -> FloatArray:
        s = np.clip((x - self.start) / self.length, 0.0, 1.0)
        return s * s * (3.0 - 2.0 * s)

    def __call__(self, x: FloatArray) -> FloatArray:
        """The faded sum at any points [m]."""
        # The surface need not exist where it is faded out.
        value = np.zeros(x.shape)
        inside = x > self.start
        near = x[inside]
        value[inside] = sum_terms(self.terms, near) * self._rise(near)
        return value

    def pieces(self, low: float, high: float) -> list[Piece]:
        """Nothing, then the pieces of the terms, with breaks where the rise begins and ends."""
        end = self.start + self.length
        if high <= self.start:
            return [Piece(low, high, math.inf)]
        begin = max(low, self.start)
        own = [Piece(begin, min(end, high), self.length / 32.0)] if begin < end else []
        if end < high:
            own.append(Piece(max(end, begin), high, math.inf))
        pieces = overlay([own, *(term.pieces(begin, high) for term in self.terms)], begin, high)
        return [Piece(low, begin, math.inf), *pieces] if low < begin else pieces

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The faded sum at ``low + width * j``, j = 0 ... count [m], a grid within one of its pieces."""
        # The ends may miss a break by round-off; the middle tells which piece it is.
        middle = low + 0.5 * width * count
        if middle <= self.start:
            return np.zeros(count + 1)
        value = sum_on_grid(self.terms, low, width, count)
        return value if middle >= self.start + self.length else value * self._rise(points(low, width, count))
