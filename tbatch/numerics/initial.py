"""States to start from: static equilibrium of vehicle, track and contact; rest on an undeformed track; or given."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tbatch.numerics.contact_solve import law, solve_contact
from tbatch.numerics.factorization import BlockFactor, factor_of
from tbatch.numerics.run_inputs import RunInputs
from tbatch.numerics.sparse_factor import SparseFactor
from tbatch.physics.elements import fixed_fixed_compliance
from tbatch.physics.line import Line


@dataclass(frozen=True, eq=False)
class InitialState:
    """Where one run starts; vehicle displacements are from rest on a rigid rail."""

    displacement: np.ndarray
    """Vehicle q [m, rad], shape (dof,)."""
    velocity: np.ndarray
    """Vehicle q̇ [m/s, rad/s], shape (dof,)."""
    track: np.ndarray
    """Track u [m, -], shape (node, dof)."""
    track_velocity: np.ndarray
    """Track u̇ [m/s, 1/s], shape (node, dof)."""
    force: np.ndarray
    """Contact forces [N], shape (wheel,)."""
    overlap: np.ndarray
    """δ [m], shape (wheel,)."""


@dataclass(eq=False)
class StaticTrack:
    """Static deflections of a track under unit forces; the columns of each set of positions are solved once."""

    track: Line
    rail_EI: float | None
    """Bending stiffness for the local rail compliance [N m²]; None to leave it out."""

    def __post_init__(self) -> None:
        self._factor: BlockFactor | SparseFactor | None = None
        self._columns: dict[tuple[float, ...], np.ndarray] = {}

    def columns(self, positions: np.ndarray) -> np.ndarray:
        """Deflections u under a unit force at each position [m/N], shape (node, dof, wheel).

        Raises:
            ValueError: If the track's stiffness matrix is not positive definite.
        """
        key = tuple(positions.tolist())
        if key not in self._columns:
            if self._factor is None:
                self._factor = factor_of(self.track.stiffness, self.track.pinned)
            self._columns[key] = self._factor.solve(self.loads(positions))
        return self._columns[key]

    def loads(self, positions: np.ndarray) -> np.ndarray:
        """Nᵀ of a unit force at each position, shape (node, dof, wheel)."""
        element, shape = self.track.locate(positions)
        load = np.zeros((self.track.node_count, self.track.node_dofs, len(positions)))
        if self.track.node_dofs:
            flat = load.reshape(-1, len(positions))
            for wheel, rows in enumerate(self.track.layer_rows(element)):
                flat[rows, wheel] += shape[wheel]
        return load

    def under_wheels(self, positions: np.ndarray, track: np.ndarray, layer: str = "rail") -> np.ndarray:
        """Deflection of a layer at each position [m], zero on a rigid track, shape (wheel,).

        Args:
            positions: Of the wheels [m], shape (wheel,).
            track: State of the track [m, rad], shape (node, dof).
            layer: "rail", "slab" or "base".
        """
        if not self.track.node_dofs:
            return np.zeros(len(positions))
        element, shape = self.track.locate(positions)
        return np.asarray((shape * track.ravel()[self.track.layer_rows(element, layer)]).sum(axis=1))

    def flexibility(self, positions: np.ndarray) -> np.ndarray:
        """Deflection at each position under a unit force at each other, with local compliance [m/N], (wheel, wheel)."""
        total = self.compliance(positions)
        if self.track.node_dofs:
            total = total + np.einsum("ndi,ndj->ij", self.loads(positions), self.columns(positions))
        return total

    def compliance(self, positions: np.ndarray) -> np.ndarray:
        """Local rail compliance between the wheels that share an element [m/N], shape (wheel, wheel)."""
        if self.rail_EI is None:
            return np.zeros((len(positions), len(positions)))
        element, _ = self.track.locate(positions)
        first, length = self.track.spans(element)
        local = positions - first
        pairs = fixed_fixed_compliance(local[:, None], local[None, :], length, self.rail_EI)
        return np.where(element[:, None] == element[None, :], pairs, 0.0)


def static_state(inputs: RunInputs, ground: StaticTrack) -> InitialState:
    """Static equilibrium with the wheels at their starting positions, r included, all velocities zero.

    The other dofs of the vehicle are eliminated: S q_w = P₀ - F with the wheel dofs q_w = δ - δ₀ + A F + r, A being the
    static flexibility under the wheels and F = F(δ). Newton steps on δ, damped on the residual.

    Raises:
        ValueError: If no equilibrium is found.
    """
    vehicle, rest = inputs.vehicle, inputs.rest
    positions, levels = inputs.local_positions(0.0, inputs.passed), inputs.levels(0.0)
    wheels = np.array(vehicle.wheel_dofs)
    others = np.setdiff1d(np.arange(vehicle.dof_count), wheels)
    held = vehicle.held_flexibility()
    coupling = vehicle.stiffness[np.ix_(wheels, others)]
    stiffness = vehicle.stiffness[np.ix_(wheels, wheels)] - coupling @ held @ coupling.T
    A = ground.flexibility(positions)
    constants = rest.constants
    scale = max(np.abs(rest.load).max(), np.abs(stiffness @ levels).max(), 1e-300)

    def residual(delta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        force, slope, _ = law(constants, delta.tolist())
        lift = delta - constants.approach + A @ force + levels
        return stiffness @ lift + np.array(force) - rest.load, np.array(force), np.array(slope)

    delta = constants.approach.copy()
    error, force, slope = residual(delta)
    for _ in range(100):
        if np.abs(error).max() <= 1e-14 * scale:
            break
        jacobian = stiffness + (np.eye(len(wheels)) + stiffness @ A) * slope
        step = -np.linalg.lstsq(jacobian, error, rcond=None)[0]
        length = 1.0
        for _ in range(40):
            trial = residual(delta + length * step)
            if np.linalg.norm(trial[0]) < np.linalg.norm(error):
                break
            length *= 0.5
        else:
            break
        delta = delta + length * step
        error, force, slope = trial
    if not np.abs(error).max() <= 1e-9 * scale:
        raise ValueError(
            f"no static equilibrium at start = {inputs.start:g} m: {np.abs(error).max():.3g} N are left unbalanced; "
            "begin on a smooth rail (taper) or with initial = 'rest'"
        )
    q = np.zeros(vehicle.dof_count)
    q[wheels] = delta - constants.approach + A @ force + levels
    q[others] = -held @ (coupling.T @ q[wheels])
    track = _deflection(ground, positions, force)
    return InitialState(q, np.zeros_like(q), track, np.zeros_like(track), force, delta)


def rest_state(inputs: RunInputs, ground: StaticTrack) -> InitialState:
    """Undeformed track, wheels at r + δ₀, so that F is the static load; local compliance included."""
    q = np.zeros(inputs.vehicle.dof_count)
    load = inputs.rest.load
    give = ground.compliance(inputs.local_positions(0.0, inputs.passed)) @ load
    q[list(inputs.vehicle.wheel_dofs)] = inputs.levels(0.0) + give
    track = np.zeros((ground.track.node_count, ground.track.node_dofs))
    approach = inputs.rest.constants.approach
    return InitialState(q, np.zeros_like(q), track, track.copy(), load.copy(), approach.copy())


def given_state(
    inputs: RunInputs,
    ground: StaticTrack,
    displacement: np.ndarray,
    velocity: np.ndarray,
    track: np.ndarray,
    track_velocity: np.ndarray,
) -> InitialState:
    """A given state; the contact forces follow from it.

    Args:
        inputs: The run.
        ground: The track.
        displacement: q [m, rad], shape (dof,).
        velocity: q̇ [m/s, rad/s], shape (dof,).
        track: u [m, -], shape (node, dof).
        track_velocity: u̇ [m/s, 1/s], shape (node, dof).

    Raises:
        ValueError: If the contact forces cannot be found, as for values that are not finite.
    """
    positions = inputs.local_positions(0.0, inputs.passed)
    rail = np.einsum("ndw,nd->w", ground.loads(positions), track)
    constants = inputs.rest.constants
    free = constants.approach + displacement[list(inputs.vehicle.wheel_dofs)] - rail - inputs.levels(0.0)
    force, overlap, solved = solve_contact(free, ground.compliance(positions), constants, inputs.rest.load)
    if not solved:
        raise ValueError("initial state: no contact forces follow from it; finite displacements in m are required")
    return InitialState(displacement, velocity, track, track_velocity, force, overlap)


def _deflection(ground: StaticTrack, positions: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Static deflection of the track, summed wheel by wheel so that the bits do not depend on anything else."""
    track = np.zeros((ground.track.node_count, ground.track.node_dofs))
    if ground.track.node_dofs:
        columns = ground.columns(positions)
        for wheel, value in enumerate(force):
            track = track + value * columns[:, :, wheel]
    return track


Starter = Callable[[RunInputs, StaticTrack], InitialState]
"""Makes the initial state of a run."""
