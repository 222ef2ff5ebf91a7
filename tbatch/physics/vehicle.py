"""Vehicles: lumped masses, springs and dampers that move vertically and pitch."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from tbatch.physics.catalogue.entry import complete
from tbatch.physics.catalogue.vehicles import COACHES, COLUMNS
from tbatch.physics.coach import CoachParameters
from tbatch.physics.column import ColumnParameters
from tbatch.physics.lumped import GRAVITY, Body
from tbatch.physics.quantities import FloatArray, mass_matrix, positive, rail_count, read_only, symmetric_matrix, vector


@dataclass(frozen=True, eq=False, init=False)
class Vehicle:
    """M z̈ + C ż + K z = w - Γᵀ F: a vehicle of any matrices, with named dofs and the places of its wheels.

    `coach` and `column` build the usual ones. Displacements are positive downwards, pitches positive nose-down.
    """

    mass: FloatArray
    """M [kg, kg m2], shape (dof, dof)"""
    damping: FloatArray
    """C [N s/m, N s, N s m], shape (dof, dof)"""
    stiffness: FloatArray
    """K [N/m, N, N m], shape (dof, dof)"""
    wheel_dofs: tuple[int, ...]
    """vertical dof of each wheel, wheel 1 (the leading one) first"""
    wheel_offsets: FloatArray
    """distance of each wheel behind wheel 1 [m], shape (wheel,)"""
    weight: FloatArray
    """w [N, N m], shape (dof,)"""
    rails: int | None
    """1: half model, 2: whole model, None: either"""
    name: str
    source: str
    dof_names: tuple[str, ...]
    wheel_radius: float | None
    """wheel radius [m], where known"""
    bodies: tuple[Body, ...]
    """what a side view draws; empty where the shape is not known"""

    def __init__(
        self,
        mass: ArrayLike,
        damping: ArrayLike,
        stiffness: ArrayLike,
        wheel_dofs: Sequence[int],
        wheel_offsets: ArrayLike,
        weight: ArrayLike | None = None,
        *,
        rails: int | None = None,
        name: str = "matrices",
        source: str = "",
        dof_names: Sequence[str] | None = None,
        wheel_radius: float | None = None,
        bodies: Sequence[Body] = (),
    ) -> None:
        """Take a vehicle's matrices.

        Args:
            mass: M [kg, kg m2], shape (dof, dof), symmetric and positive definite.
            damping: C [N s/m, ...], shape (dof, dof), symmetric.
            stiffness: K [N/m, ...], shape (dof, dof), symmetric.
            wheel_dofs: vertical dof of each wheel, from 0, the leading wheel first.
            wheel_offsets: distance of each wheel behind the first [m], shape (wheel,).
            weight: w [N], shape (dof,). Default g M ι with ι the rigid lift: K ι = 0 and one at every wheel dof.
            rails: 1 if the numbers are those of one rail's side, 2 if of the whole vehicle, None for either.
            name: name in messages and tables.
            source: where the numbers come from.
            dof_names: a name for each dof.
            wheel_radius: wheel radius [m], for contact laws that need one.
            bodies: what a side view draws.
        """
        M = mass_matrix("vehicle.mass", mass)
        n = M.shape[0]
        wheels = _check_wheels(wheel_dofs, n)
        offsets = vector("vehicle.wheel_offsets", wheel_offsets, len(wheels), "wheel")
        if (offsets < 0.0).any() or offsets[0] != 0.0:
            raise ValueError(
                f"vehicle.wheel_offsets = {offsets.tolist()}: must be 0 for wheel 1 and 0 or more for the others, "
                f"backwards from wheel 1 [m]"
            )
        if dof_names is None:
            dof_names = [f"wheel {wheels.index(dof) + 1}" if dof in wheels else f"dof {dof}" for dof in range(n)]
        if len(dof_names) != n:
            raise ValueError(f"vehicle.dof_names has {len(dof_names)} names: must be {n}, one a dof")
        fields = {
            "mass": M,
            "damping": symmetric_matrix("vehicle.damping", damping, n),
            "stiffness": symmetric_matrix("vehicle.stiffness", stiffness, n),
            "wheel_dofs": wheels,
            "wheel_offsets": offsets,
            "rails": rail_count("vehicle.rails", rails),
            "name": name,
            "source": source,
            "dof_names": tuple(dof_names),
            "wheel_radius": None if wheel_radius is None else positive("vehicle.wheel_radius", wheel_radius, "m"),
            "bodies": tuple(bodies),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)
        if weight is None:
            object.__setattr__(self, "weight", read_only(GRAVITY * (M @ self.rigid_lift())))
        else:
            object.__setattr__(self, "weight", vector("vehicle.weight", weight, n, "dof"))

    @classmethod
    def coach(
        cls,
        name: str | None = None,
        *,
        carbody_mass: float | None = None,
        carbody_inertia: float | None = None,
        bogie_mass: float | None = None,
        bogie_inertia: float | None = None,
        wheelset_mass: float | None = None,
        primary: tuple[float, float] | None = None,
        secondary: tuple[float, float] | None = None,
        bogie_half_distance: float | None = None,
        axle_half_distance: float | None = None,
        wheel_radius: float | None = None,
        rails: int | None = None,
    ) -> "Vehicle":
        """Return the 10-dof coach: a catalogue set, a changed catalogue set, or all numbers given.

        Dofs: carbody z and pitch, bogie 1 z and pitch, bogie 2 z and pitch, wheelsets 1-4.

        Args:
            name: a set of the catalogue; the other arguments then replace its numbers.
            carbody_mass: carbody mass [kg].
            carbody_inertia: carbody pitch inertia [kg m2].
            bogie_mass: mass of one bogie [kg].
            bogie_inertia: pitch inertia of one bogie [kg m2].
            wheelset_mass: mass of one wheelset [kg].
            primary: (stiffness [N/m], damping [N s/m]) per axle.
            secondary: (stiffness [N/m], damping [N s/m]) per bogie.
            bogie_half_distance: half the distance of the bogie centres [m].
            axle_half_distance: half the distance of the axles of a bogie [m].
            wheel_radius: wheel radius [m].
            rails: 1 or 2; default 2. It labels the numbers and never rescales them.
        """
        given = {
            "carbody_mass": carbody_mass,
            "carbody_inertia": carbody_inertia,
            "bogie_mass": bogie_mass,
            "bogie_inertia": bogie_inertia,
            "wheelset_mass": wheelset_mass,
            "primary": primary,
            "secondary": secondary,
            "bogie_half_distance": bogie_half_distance,
            "axle_half_distance": axle_half_distance,
            "wheel_radius": wheel_radius,
            "rails": rails,
        }
        parameters = complete(CoachParameters, COACHES, "coach", name, given)
        return cls._of(parameters, name or "coach")

    @classmethod
    def column(
        cls,
        name: str | None = None,
        *,
        carbody_mass: float | None = None,
        bogie_mass: float | None = None,
        wheel_mass: float | None = None,
        secondary: tuple[float, float] | None = None,
        primary: tuple[float, float] | None = None,
        wheel_radius: float | None = None,
        rails: int | None = None,
    ) -> "Vehicle":
        """Return the 3-dof column carbody - bogie - wheel: a catalogue set, a changed one, or all numbers given.

        Args:
            name: a set of the catalogue; the other arguments then replace its numbers.
            carbody_mass: carbody mass [kg].
            bogie_mass: bogie mass [kg].
            wheel_mass: wheel mass [kg].
            secondary: (stiffness [N/m], damping [N s/m]) between carbody and bogie.
            primary: (stiffness [N/m], damping [N s/m]) between bogie and wheel.
            wheel_radius: wheel radius [m].
            rails: 1 or 2; default 1. It labels the numbers and never rescales them.
        """
        given = {
            "carbody_mass": carbody_mass,
            "bogie_mass": bogie_mass,
            "wheel_mass": wheel_mass,
            "secondary": secondary,
            "primary": primary,
            "wheel_radius": wheel_radius,
            "rails": rails,
        }
        parameters = complete(ColumnParameters, COLUMNS, "column", name, given)
        return cls._of(parameters, name or "column")

    @property
    def dof_count(self) -> int:
        """Number of dofs."""
        return self.mass.shape[0]

    @property
    def wheel_count(self) -> int:
        """Number of wheel dofs: wheelsets of a coach, the wheel of a column."""
        return len(self.wheel_dofs)

    def rigid_lift(self) -> FloatArray:
        """Return ι, shape (dof,): one at every wheel dof and K ι = 0, hence zero at the pitches.

        A plain vector of ones would load the pitches with J g.
        """
        wheels = np.array(self.wheel_dofs)
        others = np.setdiff1d(np.arange(self.dof_count), wheels)
        loose = self._loose_dofs()
        if loose:
            names = ", ".join(self.dof_names[dof] for dof in loose)
            raise ValueError(
                f"vehicle.stiffness leaves {names} free while the wheels are held, so that g M ι does not say what it "
                f"weighs: give vehicle.weight [N], shape ({self.dof_count},)"
            )
        lift = np.ones(self.dof_count)
        coupling = self.stiffness[np.ix_(others, wheels)].sum(axis=1)
        lift[others] = -self.held_flexibility() @ coupling
        # A dof that the lift does not move comes out as round-off: a pitch times its inertia would weigh something.
        lift[np.abs(lift) < 1e-12] = 0.0
        force = np.abs(self.stiffness @ lift)
        if (force > 1e-9 * np.abs(self.stiffness).sum(axis=1)).any():
            dof = int(np.argmax(force))
            raise ValueError(
                f"vehicle.stiffness holds the vehicle to something other than its wheels (dof {dof}, "
                f"{self.dof_names[dof]}): no rigid lift has K ι = 0, so give vehicle.weight [N], "
                f"shape ({self.dof_count},)"
            )
        return lift

    def held_flexibility(self) -> FloatArray:
        """Return the inverse of K of the dofs that are not wheels, the wheels being held, shape (other, other) [m/N].

        Where some of them are free it is the pseudo-inverse in mass-scaled coordinates: free motions stay zero.
        """
        scaled, scale = self._held_stiffness()
        return scale[:, None] * np.linalg.pinv(scaled, rcond=1e-12, hermitian=True) * scale

    def natural_frequencies(self) -> FloatArray:
        """Return the undamped natural frequencies on a rigid rail, wheels held, ascending [Hz]."""
        others = np.setdiff1d(np.arange(self.dof_count), self.wheel_dofs)
        if others.size == 0:
            return np.empty(0)
        held = np.ix_(others, others)
        squares = eigh(self.stiffness[held], self.mass[held], eigvals_only=True)
        return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)

    def describe_rows(self) -> list[tuple[str, str]]:
        """Return the vehicle's facts as (label, text)."""
        rails = {1: "half (one rail)", 2: "whole (two rails)", None: "half or whole"}[self.rails]
        masses = zip(self.dof_names, np.diag(self.mass), strict=True)
        return [
            ("vehicle", self.name if not self.source else f"{self.name} ({self.source})"),
            ("vehicle rails", rails),
            ("vehicle dofs", ", ".join(self.dof_names)),
            ("vehicle masses", ", ".join(f"{name} {value:g}" for name, value in masses) + " [kg, kg m2]"),
            ("wheels behind wheel 1", ", ".join(f"{offset:g}" for offset in self.wheel_offsets) + " m"),
            ("rigid-rail frequencies", ", ".join(f"{f:.4f}" for f in self.natural_frequencies()) + " Hz"),
        ]

    @classmethod
    def _of(cls, parameters: CoachParameters | ColumnParameters, name: str) -> "Vehicle":
        return cls(
            *parameters.matrices(),
            parameters.wheel_dofs,
            parameters.wheel_offsets,
            rails=parameters.rails,
            name=name,
            source=parameters.source,
            dof_names=parameters.dof_names,
            wheel_radius=parameters.wheel_radius,
            bodies=parameters.bodies(),
        )

    def _held_stiffness(self) -> tuple[FloatArray, FloatArray]:
        others = np.setdiff1d(np.arange(self.dof_count), self.wheel_dofs)
        scale = 1.0 / np.sqrt(np.diag(self.mass)[others])
        return scale[:, None] * self.stiffness[np.ix_(others, others)] * scale, scale

    def _loose_dofs(self) -> list[int]:
        """Return the dofs that can move without any spring force while the wheels are held."""
        others = np.setdiff1d(np.arange(self.dof_count), self.wheel_dofs)
        if others.size == 0:
            return []
        squares, shapes = np.linalg.eigh(self._held_stiffness()[0])
        free = shapes[:, squares <= 1e-12 * np.abs(squares).max()]
        return [int(dof) for dof in others[(np.abs(free) > 1e-6).any(axis=1)]]


def _check_wheels(wheel_dofs: Sequence[int], dof_count: int) -> tuple[int, ...]:
    given = np.asarray(wheel_dofs)
    if given.ndim != 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise ValueError(f"vehicle.wheel_dofs = {wheel_dofs!r}: must be a list of at least one whole number")
    wheels = tuple(int(dof) for dof in given)
    if min(wheels) < 0 or max(wheels) >= dof_count or len(set(wheels)) != len(wheels):
        raise ValueError(f"vehicle.wheel_dofs = {list(wheels)}: must be different dofs from 0 to {dof_count - 1}")
    return wheels
