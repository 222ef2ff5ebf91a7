"""Everything one kept run shows: the plain data between a simulation and a recording.

Positions along the line are x [m] in the running direction, vertical quantities are positive downwards and wheels
are numbered from 1 at the front in names, from 0 in array axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KINDS = ("carbody", "bogie", "wheelset")  # of bodies in a side view


class Body(Protocol):
    """One rigid body of a vehicle as a side view needs it."""

    @property
    def kind(self) -> str:
        """Kind of body: "carbody", "bogie" or "wheelset"."""
        ...

    @property
    def vertical_dof(self) -> int:
        """Index of the body's vertical displacement among the vehicle's dofs."""
        ...

    @property
    def pitch_dof(self) -> int | None:
        """Index of the body's pitch (nose-down positive), None where it has none."""
        ...

    @property
    def offset(self) -> float:
        """Distance of the body's centre behind wheel 1 [m]."""
        ...

    @property
    def length(self) -> float:
        """Length of the body [m]."""
        ...


class SeparationTable(Protocol):
    """A table of separations, one row each (a pyarrow table serves)."""

    def to_pylist(self) -> Sequence[Mapping[str, float | bool]]:
        """Give the rows as mappings."""
        ...


@dataclass(frozen=True)
class Separation:
    """One stretch of time during which one wheel carries no force."""

    wheel: int  # axis index, 0 is the front wheel
    start: float  # first time without force [s]
    end: float  # first later time with force [s]
    position: float  # x of the wheel at the start [m]
    gap: float  # largest gap under the wheel [m], NaN where not known
    landing_force: float  # largest force just after the end [N], NaN where not known
    censored: bool  # cut off by an end of the evaluated part


@dataclass(frozen=True, eq=False, kw_only=True)
class RunRecord:
    """One run, ready to be shown. Optional parts that are None are left out of the recording."""

    name: str  # the run's printed id, "c03-s000127"
    campaign: str = ""  # name of the campaign; with `name` it identifies the recording
    title: str = ""  # one line for people

    time: Array
    # time since the start of the run [s], shape (n,)
    position: Array
    # x of wheel 1 [m], shape (n,)
    wheel_offsets: Array
    # distance of each wheel behind wheel 1 [m], shape (wheel,)
    static_load: Array
    # static contact force Q0 [N], shape (wheel,)
    contact_force: Array
    # contact force Q, exactly zero where a wheel is separated [N], shape (n, wheel)

    bodies: Sequence[Body] = ()
    # the vehicle's bodies for the side view; wheelsets in the order of the wheels
    vehicle: Array | None = None
    # displacement from static equilibrium [m or rad], shape (n, dof)
    vehicle_acceleration: Array | None = None
    # its second derivative [m/s² or rad/s²], shape (n, dof)
    wheel_radius: float = 0.46  # for drawing only [m]
    lift_off: Array | None = None
    # rise of each wheel over its static rest at which contact is lost, δ0 - δ_sep [m], shape (wheel,)

    rail_at: Array | None = None
    # fixed places along the line [m], ascending, shape (point,)
    track_time: Array | None = None
    # times of the rows of rail, slab and base [s], ascending, shape (row,); None: `time`
    rail: Array | None = None
    # rail deflection at these places [m], shape (row, point)
    slab: Array | None = None
    # slab deflection at these places [m], shape (row, point)
    base: Array | None = None
    # base plate deflection at these places [m], shape (row, point)
    rail_under_wheel: Array | None = None
    # rail deflection under each wheel [m], shape (n, wheel); None: interpolated from `rail`
    slab_under_wheel: Array | None = None
    # slab deflection under each wheel [m], shape (n, wheel); None: interpolated from `slab`
    irregularity: Array | None = None
    # irregularity that each wheel meets, its own profile included [m], shape (n, wheel)
    line: tuple[Array, Array] | None = None
    # the rail's irregularity along the line: places [m], ascending, and r [m], both shape (place,)
    bay: float | None = None  # fastener spacing, drawn as marks on the track [m]

    separations: SeparationTable | None = None
    # the run's separation events, columns as in Result.separations; None: read off `contact_force`
    properties: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    # what the viewer lists and sorts runs by (speed, seed, status, counts, ...)
    parameters: Mapping[str, str] = field(default_factory=dict)
    # what was simulated, for the run sheet: vehicle, track, contact, irregularity, step, ...
    sheet: str | None = None  # the run sheet [markdown]; None: made from the properties and the separations

    def __post_init__(self) -> None:
        """Check that the arrays fit together."""
        n, wheels = len(self.time), len(self.wheel_offsets)
        if n < 2:
            raise ValueError(f"time has {n} samples, at least 2 are needed")
        rows = n if self.track_time is None else len(self.track_time)
        points = None if self.rail_at is None else len(self.rail_at)
        expected: dict[str, tuple[int | None, ...]] = {
            "position": (n,),
            "static_load": (wheels,),
            "contact_force": (n, wheels),
            "vehicle": (n, None),
            "vehicle_acceleration": (n, None),
            "lift_off": (wheels,),
            "rail": (rows, points),
            "slab": (rows, points),
            "base": (rows, points),
            "rail_under_wheel": (n, wheels),
            "slab_under_wheel": (n, wheels),
            "irregularity": (n, wheels),
        }
        for name, shape in expected.items():
            value = getattr(self, name)
            if value is None:
                continue
            got = np.shape(value)
            if len(got) != len(shape) or any(want not in (None, have) for want, have in zip(shape, got, strict=True)):
                raise ValueError(f"{name} has shape {got}, expected {shape} (n = {n} samples, {wheels} wheels)")
        for body in self.bodies:
            if body.kind not in KINDS:
                raise ValueError(f"bodies hold a {body.kind!r}, expected one of {', '.join(KINDS)}")
        if any(getattr(self, name) is not None for name in ("rail", "slab", "base")) and self.rail_at is None:
            raise ValueError("rail_at is None but rail, slab or base is given: say where its points are, in m")

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        return len(self.wheel_offsets)

    @cached_property
    def samples(self) -> int:
        """Number of samples up to the run's end: histories are NaN after it."""
        ended = np.flatnonzero(~np.isfinite(self.contact_force).all(axis=1))
        return int(ended[0]) if len(ended) else len(self.time)

    @property
    def speed(self) -> float:
        """Mean speed of the run [m/s]."""
        last = self.samples - 1
        return float(self.position[last] - self.position[0]) / float(self.time[last] - self.time[0])

    @property
    def wheel_position(self) -> Array:
        """Place of each wheel [m], shape (n, wheel)."""
        return np.asarray(self.position)[:, None] - self.wheel_offsets

    @property
    def force_ratio(self) -> Array:
        """Contact force over the static load, Q/Q0, shape (n, wheel)."""
        return np.asarray(self.contact_force) / self.static_load

    @cached_property
    def events(self) -> tuple[Separation, ...]:
        """All separations in the order of their start, from the table or else from the histories.

        The table knows the exact step even where the histories are sampled coarsely; the histories know the part
        before statistics begin. A stretch without force that overlaps no row of the table is added to it.
        """
        found = [] if self.separations is None else [separation_of(row) for row in self.separations.to_pylist()]
        for stretch in self._stretches():
            if not any(
                e.wheel == stretch.wheel and e.start <= stretch.end and stretch.start <= e.end for e in found
            ):  # fmt: skip
                found.append(stretch)
        return tuple(sorted(found, key=lambda e: (e.start, e.wheel)))

    def _stretches(self) -> list[Separation]:
        n, found = self.samples, []
        for j in range(self.wheel_count):
            off = np.concatenate(([False], self.contact_force[:n, j] == 0.0, [False]))
            edges = np.flatnonzero(off[1:] != off[:-1])
            for a, b in zip(edges[::2], edges[1::2], strict=True):
                start, end = float(self.time[a]), float(self.time[min(b, n - 1)])
                where = float(self.wheel_position[a, j])
                found.append(Separation(j, start, end, where, float("nan"), float("nan"), bool(a == 0 or b == n)))
        return found


def separation_of(row: Mapping[str, float | bool]) -> Separation:
    """Read one row of the separation table, where wheels count from 1."""
    return Separation(
        wheel=int(row["wheel"]) - 1,
        start=float(row["start"]),
        end=float(row["end"]),
        position=float(row["position"]),
        gap=float(row["gap"]),
        landing_force=float(row["landing_force"]),
        censored=bool(row["censored"]),
    )
