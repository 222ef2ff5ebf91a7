"""Vehicles: lumped masses, springs and dampers that move vertically and pitch."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.catalogue.entry import complete
from tbatch.physics.catalogue.vehicles import COACHES, COLUMNS
from tbatch.physics.coach import CoachParameters
from tbatch.physics.column import ColumnParameters
from tbatch.physics.lumped import GRAVITY, Body
from tbatch.physics.on_wheels import OnWheels
from tbatch.physics.quantities import FloatArray, mass_matrix, positive, rail_count, read_only, symmetric_matrix, vector


@dataclass(frozen=True, eq=False, init=False)
class Vehicle(OnWheels):
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


def _check_wheels(wheel_dofs: Sequence[int], dof_count: int) -> tuple[int, ...]:
    given = np.asarray(wheel_dofs)
    if given.ndim != 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise ValueError(f"vehicle.wheel_dofs = {wheel_dofs!r}: must be a list of at least one whole number")
    wheels = tuple(int(dof) for dof in given)
    if min(wheels) < 0 or max(wheels) >= dof_count or len(set(wheels)) != len(wheels):
        raise ValueError(f"vehicle.wheel_dofs = {list(wheels)}: must be different dofs from 0 to {dof_count - 1}")
    return wheels
