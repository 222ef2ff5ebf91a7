"""Model: a vehicle type, a track, a contact and a step, factorised once and shared by all runs."""

from dataclasses import dataclass, field, replace

import numpy as np

from tbatch.numerics.factorization import FactorisedTrack, factorise
from tbatch.numerics.initial import StaticTrack
from tbatch.numerics.one_thread import one_blas_thread
from tbatch.numerics.run_inputs import VehicleTables
from tbatch.numerics.sparse_factorization import FactorisedSparse
from tbatch.numerics.two_step import EQUAL_SPLITTING, TwoStep
from tbatch.numerics.window import Window, make_window
from tbatch.physics.contact import Contact
from tbatch.physics.line import Line
from tbatch.physics.rails import common_rails
from tbatch.physics.static import RigidRest, rest_on_rigid_rail
from tbatch.physics.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class Model:
    """What does not change from run to run. Made by `Model.build`."""

    vehicle: Vehicle
    track: Line
    """The line that is stepped: the given one, or the window of an endless one."""
    window: Window
    """How the line follows the vehicle."""
    contact: Contact
    scheme: TwoStep
    rails: int
    """1 for a half model, 2 for a whole one."""
    rest: RigidRest
    """The vehicle at rest on a rigid rail."""
    factor: FactorisedTrack | FactorisedSparse = field(repr=False)
    tables: VehicleTables = field(repr=False)
    ground: StaticTrack = field(repr=False)

    @classmethod
    @one_blas_thread
    def build(
        cls,
        vehicle: Vehicle,
        track: Line,
        contact: Contact,
        *,
        step: float,
        splitting: float = EQUAL_SPLITTING,
        local_compliance: bool = True,
        window_tolerance: float = 0.003,
    ) -> "Model":
        """Check that the parts belong together, and factorise.

        Args:
            vehicle: The vehicle; runs may vary its numbers, not its dofs.
            track: The track.
            contact: The contact law; runs may vary it.
            step: Δt [s].
            splitting: γ [-] of the two-step scheme; 2 - √2 shares one factorisation between the substeps.
            local_compliance: Put the deflection that one cubic element lacks, a³b³/(3EIℓ³), in series with the contact.
                Without a known rail EI it is left out.
            window_tolerance: For an endless track: largest echo of a pulse from the ends of the stepped window,
                relative to the pulse; the window is made as long as that takes.

        Raises:
            ValueError: If half and whole models are mixed, or a value is out of range.
        """
        scheme = TwoStep(float(step), float(splitting))
        rails = common_rails(vehicle, track)
        window = Window.fixed()
        if track.window is not None:
            track, window = make_window(track, float(vehicle.wheel_offsets.max()), window_tolerance)
        rail_EI = track.rail_EI if local_compliance and track.node_dofs else None
        return cls(
            vehicle=vehicle,
            track=track,
            window=window,
            contact=contact,
            scheme=scheme,
            rails=rails,
            rest=rest_on_rigid_rail(vehicle, contact, rails),
            factor=factorise(track, scheme),
            tables=VehicleTables.of(vehicle, scheme),
            ground=StaticTrack(track, rail_EI),
        )

    @property
    def step(self) -> float:
        """Δt [s]."""
        return self.scheme.step

    @property
    def splitting(self) -> float:
        """γ [-]."""
        return self.scheme.splitting

    @property
    def static_vehicle(self) -> np.ndarray:
        """Static equilibrium on a rigid rail with r = 0, from the unloaded position [m, rad], shape (dof,)."""
        return self.rest.displacement

    @property
    def static_load(self) -> np.ndarray:
        """P₀ of each wheel [N], shape (wheel,)."""
        return self.rest.load

    @property
    def compliance(self) -> float:
        """1/(6EIℓ³) of the local rail compliance [1/(N m⁵)], without the ℓ³ for an imported track; 0 if left out."""
        EI = self.ground.rail_EI
        if EI is None:
            return 0.0
        return 1.0 / (6.0 * EI * (1.0 if self.track.imported is not None else self.track.element_length**3))

    @one_blas_thread
    def with_step(self, step: float) -> "Model":
        """The same model with another step."""
        scheme = replace(self.scheme, step=step)
        return replace(
            self, scheme=scheme, factor=factorise(self.track, scheme), tables=VehicleTables.of(self.vehicle, scheme)
        )

    @one_blas_thread
    def with_vehicle(self, vehicle: Vehicle, contact: Contact) -> "Model":
        """The same model with another vehicle and contact, such as a run's own.

        Raises:
            ValueError: If the vehicle cannot rest on a rigid rail.
        """
        rest = rest_on_rigid_rail(vehicle, contact, self.rails)
        return replace(self, vehicle=vehicle, contact=contact, rest=rest, tables=VehicleTables.of(vehicle, self.scheme))

    def describe(self) -> str:
        """Half or whole, dofs, masses, frequencies, static loads, contact and step, a line each."""
        rows = [("model", "half (one rail)" if self.rails == 1 else "whole (two rails)")]
        rows += self.vehicle.describe_rows()
        rows += [("static load", ", ".join(f"{load / 1e3:.3f}" for load in self.static_load) + " kN")]
        rows += self.track.describe_rows()
        rows += self.contact.describe_rows(self.rest.constants, self.rails, self.vehicle.wheel_radius)
        if self.track.window is not None:
            margin = f"{self.window.margin:g} m beyond the outer wheels, echo {self.window.echo:.2g} of a pulse"
            rows += [("window", f"moves by {self.window.period:g} m; {margin}")]
        local = "in series with the contact" if self.compliance else "off"
        rows += [
            ("local rail compliance", local),
            ("step", f"{self.step * 1e3:g} ms, split at {self.splitting:.6g}"),
            ("effective matrices", "one for both substeps" if self.scheme.shared else "two"),
        ]
        width = max(len(label) for label, _ in rows)
        return "\n".join(f"{label:<{width}}  {text}" for label, text in rows)
