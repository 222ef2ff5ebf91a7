"""Vehicle and track as one system y = (q, u), and its effective matrices, for one run at a time.

    M ÿ + C ẏ + K y = ΓᵀP₀ - Lᵀ F,        δ = δ₀ + L y - r - A F

q is measured from rest on a rigid rail, where the contact forces are P₀. A row of L holds one at the wheel's dof and
-N(x) at the four rail dofs under it; A is the local rail compliance. The matrices are constant and block diagonal: what
couples the two systems is L alone, which moves with the wheels.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import inv
from scipy.sparse import block_diag, csc_array, diags_array

from tbatch.numerics.initial import InitialState, StaticTrack
from tbatch.numerics.rows import shape_at
from tbatch.numerics.run_inputs import RunInputs
from tbatch.numerics.scipy_track import ScipyFactor


@dataclass(frozen=True)
class Wheels:
    """Where the wheels are at one time."""

    rows: np.ndarray
    """Dofs of y in each row of L, the wheel's own first, shape (wheel, 5); (wheel, 1) on a rigid track."""
    values: np.ndarray
    """Entries of L there, shape (wheel, 5) or (wheel, 1)."""
    element: np.ndarray
    """Rail element under each wheel, shape (wheel,)."""
    level: np.ndarray
    """r [m], shape (wheel,)."""
    compliance: np.ndarray
    """A, local rail compliance [m/N], shape (wheel, wheel)."""

    def of(self, y: np.ndarray) -> np.ndarray:
        """L y [m], shape (wheel,)."""
        return (self.values * y[self.rows]).sum(axis=1)

    def push(self, load: np.ndarray, force: np.ndarray) -> None:
        """Add -Lᵀ F to a load [N], shape (dof,), in place."""
        np.add.at(load, self.rows, -self.values * force[:, None])


class CoupledSystem:
    """The constant matrices of one run and the place of its wheels.

    Args:
        inputs: The run.
        ground: Its track, for the local rail compliance.
    """

    def __init__(self, inputs: RunInputs, ground: StaticTrack) -> None:
        self.inputs, self.ground, self.track = inputs, ground, ground.track
        vehicle, track = inputs.vehicle, ground.track
        self.vehicle_dofs = vehicle.dof_count
        self.dofs = self.vehicle_dofs + track.node_count * track.node_dofs
        self.K: Any
        self.C: Any
        self.M: Any
        parts = ((vehicle.stiffness, track.stiffness), (vehicle.damping, track.damping), (vehicle.mass, track.mass))
        if track.node_dofs:
            self.K, self.C, self.M = (block_diag([own, line.to_csc()], format="csr") for own, line in parts)
        else:
            self.K, self.C, self.M = (block_diag([own], format="csr") for own, _ in parts)
        self.moves = np.concatenate([np.ones(self.vehicle_dofs, bool), ~track.pinned.ravel()])
        self.load = np.zeros(self.dofs)
        self.load[list(vehicle.wheel_dofs)] = inputs.rest.load
        self._wheel_dofs = np.array(vehicle.wheel_dofs)[:, None]

    def place(self, time: float) -> Wheels:
        """The wheels at a time [s]."""
        track, x, level = self.track, self.inputs.positions(time), self.inputs.levels(time)
        none = np.zeros((len(x), len(x)))
        if not track.node_dofs:
            return Wheels(self._wheel_dofs, np.ones((len(x), 1)), np.zeros(len(x), int), level, none)
        element, _, shape = shape_at(track, x)
        rows = np.hstack([self._wheel_dofs, self.vehicle_dofs + track.layer_rows(element)])
        values = np.hstack([np.ones((len(x), 1)), -shape])
        # A rounded last position may stand a bit beyond the last node.
        compliance = none if self.ground.rail_EI is None else self.ground.compliance(np.minimum(x, track.end))
        return Wheels(rows, values, element, level, compliance)

    def start(self, initial: InitialState) -> tuple[np.ndarray, np.ndarray]:
        """Displacements y [m, rad] and ẏ of an initial state, shape (dof,) each."""
        y = np.concatenate([initial.displacement, initial.track.ravel()])
        return y, np.concatenate([initial.velocity, initial.track_velocity.ravel()])


class EffectiveMatrix:
    """K̂ = k K + c C + m M factorised once: a dense inverse of the vehicle's block, a banded Cholesky of the track's.

    Args:
        system: The system.
        stiffness: k [-].
        damping: c [1/s].
        mass: m [1/s²].
    """

    def __init__(self, system: CoupledSystem, stiffness: float, damping: float, mass: float) -> None:
        vehicle, track = system.inputs.vehicle, system.track
        self.system, self.split = system, system.vehicle_dofs
        self._weights = stiffness, damping, mass
        inverse = inv(stiffness * vehicle.stiffness + damping * vehicle.damping + mass * vehicle.mass)
        self.inverse = 0.5 * (inverse + inverse.T)
        self.factor: ScipyFactor | None = None
        self._columns: dict[int, np.ndarray] = {}
        if track.node_dofs:
            parts: tuple[Any, ...] = (track.stiffness, track.damping, track.mass)
            K, C, M = parts
            line = K * stiffness + C * damping + M * mass
            self.factor = ScipyFactor(line, track.pinned)

    def solve(self, load: np.ndarray) -> np.ndarray:
        """K̂⁻¹ load, zero at pinned dofs; shape (dof,)."""
        y = np.empty_like(load)
        y[: self.split] = self.inverse @ load[: self.split]
        if self.factor is not None:
            y[self.split :] = self.factor.solve(load[self.split :])
        return y

    @cached_property
    def assembled(self) -> csc_array:
        """K̂ of the whole system, sparse, with ones at pinned dofs."""
        system, (k, c, m) = self.system, self._weights
        held = diags_array((~system.moves).astype(float))
        return csc_array(system.K * k + system.C * c + system.M * m + held)

    def columns(self, wheels: Wheels) -> np.ndarray:
        """K̂⁻¹ Lᵀ [m/N], a row a wheel, shape (wheel, dof)."""
        result = np.zeros((len(wheels.rows), self.system.dofs))
        result[:, : self.split] = self.inverse[wheels.rows[:, 0]]
        if self.factor is not None:
            for j, element in enumerate(wheels.element.tolist()):
                result[j, self.split :] = wheels.values[j, 1:] @ self._element(element)
        return result

    def _element(self, element: int) -> np.ndarray:
        """K̂⁻¹ columns of an element's four rail dofs, solved when a wheel first comes there; shape (4, track dof)."""
        if element not in self._columns:
            assert self.factor is not None
            units = np.zeros((self.system.dofs - self.split, 4))
            units[self.system.track.layer_rows(np.array([element]))[0], np.arange(4)] = 1.0
            self._columns[element] = np.ascontiguousarray(self.factor.solve(units).T)
        return self._columns[element]
