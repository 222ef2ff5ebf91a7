"""What the campaign's process tells the one that draws: plain data, in the order in which it happened."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Began:
    """The campaign begins."""

    name: str
    folder: str
    speeds: tuple[float, ...]  # of the cases [m/s]
    followed: tuple[int, ...]  # cases of which one run at a time is followed


@dataclass(frozen=True)
class Batch:
    """Runs begin to be stepped."""

    elapsed: float  # since the live view began [s]
    runs: dict[int, str]  # names of the followed ones by case


@dataclass(frozen=True, eq=False)
class Piece:
    """What a chunk of steps added to the followed runs."""

    began: float  # when the chunk began, since the live view began [s]
    ended: float  # and when it was done [s]
    first: int  # number of its first sample
    every: float  # simulated time between samples [s]
    ratio: dict[int, NDArray[np.float32]]  # Q/Q0 by case, shape (sample, wheel); NaN after a run's end


@dataclass(frozen=True)
class State:
    """How far the campaign is."""

    elapsed: float  # since the live view began [s]
    phase: str
    runs_done: int
    runs_total: int
    run_steps_done: int
    run_steps_total: int
    separations: int


@dataclass(frozen=True)
class StoredShard:
    """Where a stored shard is."""

    case: int
    start: int  # its first sample
    runs: tuple[str, str]  # file and SHA-256 of its runs
    wheels: tuple[str, str]  # and of its wheels


@dataclass(frozen=True)
class Stored:
    """Shards that count from now on."""

    elapsed: float  # since the live view began [s]
    shards: tuple[StoredShard, ...]


News = Began | Batch | Piece | State | Stored
