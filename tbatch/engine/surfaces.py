"""Surfaces: the irregularities and wheel profiles of a batch, in the arrays that the kernels read."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tbatch.numerics.run_inputs import RunInputs
from tbatch.physics.long_profile import LongProfile, kept_segments
from tbatch.physics.profile import Profile

AHEAD = 64.0
"""Irregularity of long runs that is made ahead of the fastest one [m]."""


@dataclass(eq=False)
class _Long:
    """A run of an endless track: the pieces it holds, their coefficients being views of the arrays of all."""

    number: int
    run: int
    inputs: RunInputs
    profile: LongProfile
    pieces: dict[int, Profile]


class Surfaces:
    """B-splines of all runs of a batch, one after the other.

    Profiles that serve a whole run are written once, however many runs share them. Behind them every run of an endless
    track has a stretch of its own, where pieces come and go as its wheels advance; nothing else is kept of its surface.

    Attributes:
        segment_real: Start [m] and inverse spacing [1/m] of all segments, shape (segment, 2).
        segment_whole: First coefficient and number of intervals, int32, shape (segment, 2).
        coefficients: B-spline coefficients [m], shape (coefficient,).
        rail: First segment of each run's irregularity and the number of its segments, int32, shape (run, 2).
    """

    def __init__(self, inputs: Sequence[RunInputs], step: float, chunk: int) -> None:
        self._step, self._fastest = step, max(one.speed for one in inputs)
        self._long: list[_Long] = []
        for run, one in enumerate(inputs):
            if isinstance(one.profile, LongProfile):
                self._long.append(_Long(len(self._long), run, one, one.profile, {}))
        profiles = [profile for one in inputs for profile in (*one.wheel_profiles, one.profile)]
        distinct = {id(profile): profile for profile in profiles if isinstance(profile, Profile)}
        fixed = list(distinct.values())
        counts = np.array([profile.segment_count for profile in fixed], np.int64)
        sizes = np.array([len(profile.coefficient) for profile in fixed], np.int64)
        self._fixed_segments, self._fixed = int(counts.sum()), int(sizes.sum())
        self._room, self._segment_room = self._rooms()
        self._allocate()
        begins, firsts = np.cumsum(sizes) - sizes, np.cumsum(counts) - counts
        for profile, begin, first in zip(fixed, begins, firsts, strict=True):
            self._write(profile, int(begin), int(first), np.inf)
        self._places = dict(zip(distinct, zip(firsts.tolist(), counts.tolist(), strict=True), strict=True))
        self.rail = np.zeros((len(inputs), 2), np.int32)
        for run, one in enumerate(inputs):
            self.rail[run] = self._places.get(id(one.profile), (0, 0))
        self._begun = {long.run: long for long in self._long}
        self._loaded = self._reach(0, chunk)

    def own(self, profile: Profile) -> tuple[int, int]:
        """First segment of a wheel's own profile and the number of its segments."""
        return self._places[id(profile)]

    def begin(self, run: int) -> None:
        """Hold what a long run meets first; to be called for each run, as soon as its initial state is known."""
        if run in self._begun:
            self._hold(self._begun.pop(run), 0)

    def need(self, first: int, count: int) -> bool:
        """Hold what the wheels of long runs meet in `count` steps from step `first`; whether any place has changed."""
        if not self._long or first + count <= self._loaded:
            return False
        self._loaded = self._reach(first, count)
        for long in self._long:
            self._hold(long, first)
        return True

    def _reach(self, first: int, count: int) -> int:
        """Step up to which surfaces are made when `count` steps from step `first` need them."""
        return first + max(count, int(AHEAD / max(self._fastest * self._step, 1e-12)))

    def _hold(self, long: _Long, first: int) -> None:
        """Bring the pieces that a run needs from step `first` on into its stretch of the arrays."""
        held = long.pieces
        places = long.profile.places(*long.inputs.visited(first, self._loaded, self._step))
        long.pieces = {place: held[place] if place in held else long.profile.take(place) for place in places}
        size = sum(len(piece.coefficient) for piece in long.pieces.values())
        segments = sum(piece.segment_count for piece in long.pieces.values())
        if size > self._room or segments > self._segment_room:
            self._grow(size, segments)
        self._place(long)

    def _rooms(self) -> tuple[int, int]:
        """Coefficients and segments that a long run's stretch has room for, unless more turn out to be needed."""
        size = max((long.profile.nbytes // 8 for long in self._long), default=0)
        return size + 64, 16

    def _allocate(self) -> None:
        """Arrays for what is held; a page of them takes memory once it is written."""
        segments = self._fixed_segments + len(self._long) * self._segment_room
        self.segment_real = np.zeros((max(segments, 1), 2))
        self.segment_whole = np.zeros((max(segments, 1), 2), np.int32)
        self.coefficients = np.zeros(max(self._fixed + len(self._long) * self._room, 1))

    def _grow(self, size: int, segments: int) -> None:
        """Give every long run a larger stretch."""
        self._room, self._segment_room = max(size, self._room), max(2 * segments, self._segment_room)
        real, whole, coefficients = self.segment_real, self.segment_whole, self.coefficients
        self._allocate()
        self.segment_real[: self._fixed_segments] = real[: self._fixed_segments]
        self.segment_whole[: self._fixed_segments] = whole[: self._fixed_segments]
        self.coefficients[: self._fixed] = coefficients[: self._fixed]
        for long in self._long:
            self._place(long)

    def _place(self, long: _Long) -> None:
        """Write the pieces of one run into its stretch, in their order."""
        begin = self._fixed + long.number * self._room
        first = self._fixed_segments + long.number * self._segment_room
        row, pieces = first, list(long.pieces.items())
        for following, (place, piece) in enumerate(pieces, 1):
            limit = float(pieces[following][1].start[0]) if following < len(pieces) else np.inf
            # Pieces that stay move towards the beginning, so none is written over before it has moved.
            row += self._write(piece, begin, row, limit)
            end = begin + len(piece.coefficient)
            long.pieces[place] = replace(piece, coefficient=self.coefficients[begin:end])
            begin = end
        self.rail[long.run] = first, row - first

    def _write(self, profile: Profile, begin: int, first: int, limit: float) -> int:
        """Write a profile, its segments up to `limit` [m]; gives their number."""
        self.coefficients[begin : begin + len(profile.coefficient)] = profile.coefficient
        count = kept_segments(profile, limit)
        rows = slice(first, first + count)
        self.segment_real[rows, 0], self.segment_real[rows, 1] = profile.start[:count], profile.inverse_spacing[:count]
        self.segment_whole[rows, 0] = profile.first[:count] + begin
        self.segment_whole[rows, 1] = profile.intervals[:count]
        return count
