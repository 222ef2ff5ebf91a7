"""The two timelines of a recording: time since the start, and chainage of wheel 1."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from tbatch.view.record import Array

TIME = "sim_time"  # since the start of the run, a duration
CHAINAGE = "chainage_mm"  # x of wheel 1 in whole millimetres: rerun's timelines are integers or times


class Timed(Protocol):
    """What times and places are taken from: a record, a response."""

    @property
    def time(self) -> Array:
        """Time since the start [s], shape (n,)."""
        ...

    @property
    def position(self) -> Array:
        """Place of wheel 1 [m], shape (n,)."""
        ...

    @property
    def samples(self) -> int:
        """Number of samples up to the run's end."""
        ...


class Clock:
    """Stamps samples and instants of one run on both timelines."""

    def __init__(self, run: Timed) -> None:
        """Take the run's times and places."""
        n = run.samples
        self._time = np.asarray(run.time[:n], float)
        self._position = np.asarray(run.position[:n], float)

    def at(self, samples: NDArray[np.intp]) -> list[rr.TimeColumn]:
        """Stamp samples by their index."""
        return columns(self._time[samples], self._position[samples])

    def when(self, times: Sequence[float]) -> list[rr.TimeColumn]:
        """Stamp instants [s], wherever they lie between samples."""
        instants = np.asarray(times, float)
        return columns(instants, np.interp(instants, self._time, self._position))


def columns(time: Array, position: Array) -> list[rr.TimeColumn]:
    """Stamp given times [s] and places [m]."""
    # Whole nanoseconds: float seconds would be rounded by the SDK in its own way.
    nanoseconds = np.round(time * 1e9).astype("timedelta64[ns]")
    millimetres = np.round(position * 1e3).astype(np.int64)
    return [rr.TimeColumn(TIME, duration=nanoseconds), rr.TimeColumn(CHAINAGE, sequence=millimetres)]
