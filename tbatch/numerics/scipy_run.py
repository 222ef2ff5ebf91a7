"""One run by SciPy's banded solver: the way one would write it without batches.

Same scheme, same exact contact, other algebra: SciPy's banded Cholesky for K̂, sparse products, whole columns of
K̂⁻¹, and the contact forces' share added after the solve. It is the speed baseline of `tbatch bench`, and it checks
the block factorisation and the gathered contact of the batch kernels to round-off.
"""

import numpy as np

from tbatch.numerics.contact_solve import solve_contact
from tbatch.numerics.initial import InitialState, StaticTrack
from tbatch.numerics.rows import shape_at
from tbatch.numerics.run_inputs import RunInputs
from tbatch.numerics.scipy_track import ScipyTrack


class ScipyRun:
    """One run stepped with SciPy.

    Args:
        track: The factorised track.
        ground: For the local rail compliance.
        inputs: The run.
        initial: Its initial state.
    """

    def __init__(self, track: ScipyTrack, ground: StaticTrack, inputs: RunInputs, initial: InitialState) -> None:
        self.track, self.ground, self.inputs = track, ground, inputs
        self.wheel_dofs = list(inputs.vehicle.wheel_dofs)
        self.q, self.q_velocity = initial.displacement.copy(), initial.velocity.copy()
        self.u, self.u_velocity = initial.track.ravel().copy(), initial.track_velocity.ravel().copy()
        self.force = initial.force.copy()
        self._place(0.0)

    def advance(self, n: int) -> np.ndarray:
        """One step from t_n; returns the contact forces at its end [N], shape (wheel,)."""
        scheme, tables, track = self.track.scheme, self.inputs.tables, self.track
        step, last = scheme.step, len(scheme.rates) - 1
        c1, c2, c3, two_h = scheme.c1, scheme.c2, scheme.c3, 2.0 / scheme.first
        load = 2.0 * two_h * (track.mass @ self.u_velocity) - 2.0 * (track.stiffness @ self.u)
        np.add.at(load, self.rows, self.shape * self.force[:, None])
        q_load = tables.stiffness @ self.q + 2.0 * two_h * (tables.mass @ self.q_velocity)
        q_load[self.wheel_dofs] += 2.0 * self.inputs.rest.load - self.force
        u1, q1 = self._substep(0, (n + scheme.splitting) * step, load, q_load, self.u, self.q)
        v1 = two_h * (u1 - self.u) - self.u_velocity
        w = c1 * self.u + c2 * u1
        load = -(track.damping @ w) - track.mass @ (c1 * self.u_velocity + c2 * v1 + c3 * w)
        qw = c1 * self.q + c2 * q1
        qp = c1 * self.q_velocity + c2 * (two_h * (q1 - self.q) - self.q_velocity) + c3 * qw
        q_load = tables.damping @ qw - tables.mass @ qp
        q_load[self.wheel_dofs] += self.inputs.rest.load
        self.u, self.q = self._substep(last, (n + 1.0) * step, load, q_load, np.zeros_like(w), np.zeros_like(qw))
        self.u_velocity, self.q_velocity = w + c3 * self.u, qw + c3 * self.q
        return self.force

    def _place(self, time: float) -> None:
        """Rail dofs and Hermite values under the wheels, shape (wheel, 4) each."""
        ground = self.track.track
        self.positions = self.inputs.local_positions(time, self.inputs.passed)
        self.element, _, self.shape = shape_at(ground, self.positions)
        self.rail_dofs = 2 * self.element[:, None] + np.arange(4)
        self.rows = ground.layer_rows(self.element)

    def _substep(
        self, rate: int, time: float, load: np.ndarray, q_load: np.ndarray, u0: np.ndarray, q0: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacements of track and vehicle at the substep's end, contact forces found on the way."""
        inverse = self.inputs.tables.inverse[rate]
        self._place(time)
        u = u0 + self.track.solve(rate, load)
        q = q0 + inverse @ q_load
        influence = self.track.columns[rate][self.rail_dofs.ravel()]
        wheels = len(self.force)
        near = influence[:, self.rows.ravel()].reshape(wheels, 4, wheels, 4)
        flexibility = np.einsum("ia,iajb,jb->ij", self.shape, near, self.shape)
        flexibility += inverse[np.ix_(self.wheel_dofs, self.wheel_dofs)] + self.ground.compliance(self.positions)
        rest = self.inputs.rest
        rail = (self.shape * u[self.rows]).sum(axis=1)
        free = rest.constants.approach + q[self.wheel_dofs] - rail - self.inputs.levels(time)
        self.force, _, solved = solve_contact(free, flexibility, rest.constants, self.force)
        if not solved:
            raise FloatingPointError(f"the contact forces at t = {time:g} s were not found")
        u += (self.shape * self.force[:, None]).ravel() @ influence
        q -= inverse[:, self.wheel_dofs] @ self.force
        return u, q
