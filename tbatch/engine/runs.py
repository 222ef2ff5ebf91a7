"""What a user asks of a simulation: the table of runs, the state they start from, what to save."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.contact import Contact
from tbatch.physics.vehicle import Vehicle

CHANNELS = (
    "contact_force",
    "vehicle",
    "vehicle_acceleration",
    "irregularity",
    "rail_under_wheel",
    "slab_under_wheel",
    "base_under_wheel",
    "rail",
    "rail_acceleration",
    "slab",
    "base",
)
"""Histories that can be saved."""

Profile = Callable[[Any], Any]
"""A wheel's own profile ρ(s) [m] over the rolled distance s [m]."""


@dataclass(frozen=True, eq=False, init=False)
class Runs:
    """The table of runs, one entry a run."""

    speed: np.ndarray
    """[m/s], shape (run,)."""
    irregularity: tuple[Any, ...]
    """r(x) of each run: an `Irregularity`, a callable of an array, or None for a smooth rail."""
    start: np.ndarray
    """x of wheel 1 at t = 0 [m], shape (run,)."""
    evaluate_from: np.ndarray
    """Distance beyond `start` from which a wheel's statistics count [m], shape (run,)."""
    vehicle: tuple[Vehicle, ...] | None
    """The vehicle of each run, with the model's dofs; None for the model's own."""
    contact: tuple[Contact, ...] | None
    """The contact of each run; None for the model's own."""
    wheel_profile: tuple[Any, ...] | None
    """The wheels' own profiles of each run: None, one callable ρ(s) for all wheels, or a sequence, an entry a wheel."""

    def __init__(
        self,
        speed: ArrayLike,
        irregularity: Sequence[Any] | None = None,
        start: ArrayLike = 0.0,
        *,
        vehicle: Sequence[Vehicle] | None = None,
        contact: Sequence[Contact] | None = None,
        wheel_profile: Sequence[Any] | None = None,
        evaluate_from: ArrayLike = 0.0,
    ) -> None:
        """Make the table.

        Args:
            speed: [m/s], shape (run,); 0 or more.
            irregularity: r(x) of each run, None for smooth rails.
            start: x of wheel 1 at t = 0 [m], scalar or shape (run,).
            vehicle: A vehicle a run.
            contact: A contact a run.
            wheel_profile: Wheel profiles a run.
            evaluate_from: Distance beyond `start` from which statistics count [m], scalar or shape (run,).

        Raises:
            ValueError: If a length differs from the number of runs or a number is out of range.
        """
        speeds = np.atleast_1d(np.asarray(speed, float))
        count = len(speeds)
        if speeds.ndim != 1 or not speeds.size or not (np.isfinite(speeds) & (speeds >= 0.0)).all():
            raise ValueError("runs.speed: one finite number >= 0 m/s a run is required")
        _store(self, "speed", speeds)
        _store(self, "irregularity", _entries("irregularity", irregularity, count) or (None,) * count)
        _store(self, "start", _column("start", start, count))
        _store(self, "evaluate_from", _column("evaluate_from", evaluate_from, count))
        _store(self, "vehicle", _entries("vehicle", vehicle, count))
        _store(self, "contact", _entries("contact", contact, count))
        _store(self, "wheel_profile", _entries("wheel_profile", wheel_profile, count))

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.speed)


@dataclass(frozen=True, eq=False)
class State:
    """A state to start all runs from; vehicle displacements are from rest on a rigid rail (`Model.static_vehicle`)."""

    vehicle: np.ndarray
    """q [m, rad], shape (dof,) or (run, dof)."""
    vehicle_velocity: np.ndarray | None = None
    """q̇ [m/s, rad/s], as `vehicle`; None for zero."""
    track: np.ndarray | None = None
    """u [m, -] in the order of the nodes, shape (node, dof) or (run, node, dof); None for zero. Of an imported
    track in the order of `track.imported.given_row`, shape (row, 1)."""
    track_velocity: np.ndarray | None = None
    """u̇ [m/s, 1/s], as `track`; None for zero."""


@dataclass(frozen=True, eq=False, init=False)
class SaveAt:
    """Which histories to save, and when: at 0, every, 2 every, ... up to the duration."""

    every: float
    """Time between samples [s], a whole multiple of the step."""
    channels: tuple[str, ...]
    """Names from `CHANNELS`."""
    rail_at: np.ndarray
    """Points of the channels rail, slab and base [m], shape (point,)."""
    runs: tuple[int, ...] | None
    """The runs whose histories are saved, in the order of the histories; None for all."""

    def __init__(
        self,
        every: float,
        channels: Sequence[str] = ("contact_force",),
        rail_at: ArrayLike = (),
        *,
        runs: Sequence[int] | None = None,
    ) -> None:
        """Choose what to save.

        Args:
            every: Time between samples [s].
            channels: Names from `CHANNELS`.
            rail_at: Points [m] of rail, slab and base.
            runs: Indices of the runs whose histories are saved, None for all.

        Raises:
            ValueError: If a channel is unknown, a point is missing, a run is named twice or `every` is not positive.
        """
        unknown = [name for name in channels if name not in CHANNELS]
        if unknown:
            raise ValueError(f"save.channels: {unknown[0]!r} is unknown; known are {', '.join(CHANNELS)}")
        if not (np.isfinite(every) and every > 0.0):
            raise ValueError(f"save.every = {every!r}: a positive time in s is required")
        points = np.atleast_1d(np.asarray(rail_at, float))
        needing = [name for name in channels if name in ("rail", "rail_acceleration", "slab", "base")]
        if needing and not len(points):
            raise ValueError(f"save.rail_at: channel {needing[0]!r} needs at least one point in m")
        _store(self, "every", float(every))
        _store(self, "channels", tuple(dict.fromkeys(channels)))
        _store(self, "rail_at", points)
        if runs is not None and len(set(runs)) != len(runs):
            raise ValueError(f"save.runs = {list(runs)}: each run at most once")
        _store(self, "runs", None if runs is None else tuple(int(run) for run in runs))


def _store(target: object, name: str, value: object) -> None:
    object.__setattr__(target, name, value)


def _column(name: str, values: ArrayLike, count: int) -> np.ndarray:
    array = np.asarray(values, float)
    if array.ndim > 1 or (array.ndim == 1 and len(array) != count):
        raise ValueError(f"runs.{name}: shape {array.shape} given; a scalar or one entry for each of {count} runs [m]")
    if not np.isfinite(array).all():
        raise ValueError(f"runs.{name}: finite numbers in m are required")
    return np.broadcast_to(array, (count,)).copy()


def _entries(name: str, values: Sequence[Any] | None, count: int) -> tuple[Any, ...] | None:
    if values is None:
        return None
    if callable(values) or not hasattr(values, "__len__"):
        raise ValueError(f"runs.{name}: a sequence with one entry for each of {count} runs is required")
    if len(values) != count:
        raise ValueError(f"runs.{name}: {len(values)} entries given for {count} runs")
    return tuple(values)
