"""LongProfile: the irregularity of a long run, splined piece by piece as the wheels come to it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.physics.irregularity import Irregularity
from tbatch.physics.profile import Profile

FloatArray = NDArray[np.float64]

PIECE = 128.0
"""Length of a piece [m]; pieces begin at its multiples, so that they do not depend on when they are asked for."""
OVERLAP = 2.0
"""Neighbouring pieces are held together while a wheel is this close to their border [m]."""


@dataclass(eq=False)
class LongProfile:
    """r(x) over a long span in bounded memory: the same numbers whatever part of it is held at a time."""

    irregularity: Irregularity
    low: float
    """Where the span begins [m]."""
    high: float
    """Where it ends [m]."""
    _pieces: dict[int, Profile] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.high - self.low > self.irregularity.period:
            raise ValueError(
                f"a span of {self.high - self.low:g} m repeats an irregularity of period = "
                f"{self.irregularity.period:g} m; give Irregularity.spectrum a longer period, or inf on an endless line"
            )

    @property
    def nbytes(self) -> int:
        """Memory of the coefficients held at a time [bytes]: those of two pieces, or of all where that is less."""
        return 8 * self.irregularity.coefficient_count(self.low, min(self.low + 2.0 * PIECE, self.high))

    def places(self, low: float, high: float) -> range:
        """Numbers of the pieces that evaluations from `low` to `high` [m] need."""
        first, last = (int(np.floor(end / PIECE)) for end in (self.low, self.high))
        begin = min(max(int(np.floor((low - OVERLAP) / PIECE)), first), last)
        return range(begin, max(min(int(np.floor((high + OVERLAP) / PIECE)), last), first) + 1)

    def take(self, place: int) -> Profile:
        """A piece by its number, given away if it is held here."""
        return self._pieces.pop(place) if place in self._pieces else self._made(place)

    def covering(self, low: float, high: float) -> Profile:
        """The pieces that evaluations from `low` to `high` [m] need, as one profile; earlier ones are dropped."""
        places = self.places(low, high)
        self._pieces = {place: profile for place, profile in self._pieces.items() if place >= places.start}
        for place in places:
            if place not in self._pieces:
                self._pieces[place] = self._made(place)
        return _joined([self._pieces[place] for place in places])

    def _made(self, place: int) -> Profile:
        low, high = max(place * PIECE, self.low), min((place + 1) * PIECE, self.high)
        # A piece that only touches the span's end still needs a length.
        return self.irregularity.spline(min(low, high - 1e-3), high)

    def __call__(self, x: ArrayLike) -> FloatArray:
        """The value r(x) [m], same shape as x."""
        points = np.asarray(x, dtype=np.float64)
        return self.covering(float(points.min()), float(points.max()))(points)


def kept_segments(piece: Profile, limit: float) -> int:
    """Segments of a piece that stay where the next piece holds from `limit` [m] on: those that begin before."""
    return int(np.searchsorted(piece.start, limit, side="left"))


def _joined(pieces: list[Profile]) -> Profile:
    """Adjacent profiles as one; a segment that begins where the next piece already holds gives way to it."""
    starts, inverses, intervals, firsts, coefficients = [], [], [], [], []
    used = 0
    for number, piece in enumerate(pieces):
        kept = slice(kept_segments(piece, pieces[number + 1].start[0] if number + 1 < len(pieces) else np.inf))
        starts.append(piece.start[kept])
        inverses.append(piece.inverse_spacing[kept])
        intervals.append(piece.intervals[kept])
        firsts.append(piece.first[kept] + used)
        coefficients.append(piece.coefficient)
        used += len(piece.coefficient)
    return Profile(
        np.concatenate(starts),
        np.concatenate(inverses),
        np.concatenate(intervals),
        np.concatenate(firsts).astype(np.int32),
        np.concatenate(coefficients),
    )
