"""One run in NumPy: the two-step scheme with contact, readable against the equations.

This is the oracle of the batch kernels: same tables, same operations in the same order, hence the same bits. It keeps
every step. For the algebra of the substeps see `tbatch.numerics.two_step`, for the contact `contact_solve`.
"""

from dataclasses import dataclass

import numpy as np

from tbatch.numerics.contact_solve import solve_contact
from tbatch.numerics.factorization import FactorisedTrack
from tbatch.numerics.initial import InitialState
from tbatch.numerics.rows import first_load, products, row_product, shape_at
from tbatch.numerics.run_inputs import RunInputs
from tbatch.numerics.sparse_factorization import FactorisedSparse
from tbatch.numerics.sparse_rows import sparse_sweep
from tbatch.numerics.two_step import TwoStep
from tbatch.physics.line import Line


@dataclass(eq=False)
class ReferenceHistory:
    """What a reference run did, at t_0, t_1, ..., t_n."""

    time: np.ndarray
    """[s], shape (n + 1,)."""
    force: np.ndarray
    """Contact force [N], shape (n + 1, wheel)."""
    overlap: np.ndarray
    """δ [m], shape (n + 1, wheel)."""
    displacement: np.ndarray
    """Vehicle q [m, rad], shape (n + 1, dof)."""
    acceleration: np.ndarray
    """Vehicle q̈ [m/s², rad/s²], shape (n + 1, dof); NaN at t_0."""
    diverged: bool
    """True if a step could not be solved; the history then ends before it."""


class ReferenceRun:
    """One run, stepped in NumPy.

    Args:
        track: The factorised track.
        scheme: The two-step scheme.
        inputs: The run.
        initial: Its initial state.
        line: The track, for the place of its rail.
        compliance: 1/(6EIℓ³) of the local rail compliance [1/(N m⁵)], 0 to leave it out; without the ℓ³, which varies,
            for an imported track.
    """

    def __init__(
        self,
        track: FactorisedTrack | FactorisedSparse,
        scheme: TwoStep,
        inputs: RunInputs,
        initial: InitialState,
        *,
        line: Line,
        compliance: float,
    ) -> None:
        self.track, self.scheme, self.inputs = track, scheme, inputs
        self.line, self.compliance = line, compliance
        self.wheel_dofs = list(inputs.vehicle.wheel_dofs)
        self.q, self.q_velocity = initial.displacement.copy(), initial.velocity.copy()
        self.u, self.u_velocity = initial.track.copy(), initial.track_velocity.copy()
        self.force, self.overlap = initial.force.copy(), initial.overlap.copy()
        self.q_acceleration = np.full_like(self.q, np.nan)
        self.passed = float(inputs.passed)
        self.two_h, self.four_h = 2.0 / scheme.first, 4.0 / scheme.first
        self.load = first_load(track, scheme, self.u, self.u_velocity)
        self.element: np.ndarray = np.zeros(len(self.force), int)
        self._place_wheels(0.0)

    def run(self) -> ReferenceHistory:
        """Step the run to its end."""
        kept = [self._snapshot()]
        good = True
        for n in range(self.inputs.steps):
            good = self.advance(n)
            if not good:
                break
            kept.append(self._snapshot())
        force, overlap, q, acceleration = (np.array(part) for part in zip(*kept, strict=True))
        time = np.arange(len(kept)) * self.scheme.step
        return ReferenceHistory(time, force, overlap, q, acceleration, not good)

    def advance(self, n: int) -> bool:
        """One step from t_n to t_n+1; False if a contact solve failed."""
        scheme, tables, rest = self.scheme, self.inputs.tables, self.inputs.rest
        step, last = scheme.step, len(tables.inverse) - 1
        c1, c2, c3 = scheme.c1, scheme.c2, scheme.c3

        self._follow_vehicle(n * step)

        # Substep 1, to t_n + γΔt: K̂₁ (u₁ + u₀) = f₀ + f₁ + (4/h) [M ((2/h) u₀ + v₀) + C u₀], and for the vehicle
        # K̂₁ (q₁ - q₀) = f₀ + f₁ - 2 K q₀ + (4/h) M v₀.
        q_load = _dense(tables.stiffness, self.q) + _dense(tables.mass, self.four_h * self.q_velocity)
        q_load[self.wheel_dofs] += 2.0 * rest.load - self.force
        self._push_rail()
        self._place_wheels((n + scheme.splitting) * step)
        wheels = self.q[self.wheel_dofs] + _dense(tables.inverse[0], q_load)[self.wheel_dofs]
        rail = [self._gather(0, j) - self._rail_value(self.u, j) for j in range(len(self.force))]
        good = self._solve_contact(0, wheels, rail)
        q_load[self.wheel_dofs] -= self.force
        self._push_rail()
        u1 = self._sweep(0) - self.u
        v1 = self.two_h * (u1 - self.u) - self.u_velocity
        w = c1 * self.u + c2 * u1
        p = 0.0 - ((c1 * self.u_velocity + c2 * v1) + c3 * w)
        self.load = products(self.track, 0, p, w)
        qd = _dense(tables.inverse[0], q_load)
        qw = c1 * self.q + c2 * (self.q + qd)
        qp = 0.0 - ((c1 * self.q_velocity + c2 * (self.two_h * qd - self.q_velocity)) + c3 * qw)

        # Substep 2, to t_n+1: K̂₂ u₂ = f₂ - C w - M (c₁v₀ + c₂v₁ + c₃w) with w = c₁u₀ + c₂u₁.
        q_load = _dense(tables.mass, qp) + _dense(tables.damping, qw)
        q_load[self.wheel_dofs] += rest.load
        self._place_wheels((n + 1.0) * step)
        wheels = _dense(tables.inverse[last], q_load)[self.wheel_dofs]
        rail = [self._gather(last, j) for j in range(len(self.force))]
        good = self._solve_contact(last, wheels, rail) and good
        q_load[self.wheel_dofs] -= self.force
        self._push_rail()
        self.u = self._sweep(last)
        self.u_velocity = w + c3 * self.u
        self.load = first_load(self.track, scheme, self.u, self.u_velocity)
        self.q = _dense(tables.inverse[last], q_load)
        self.q_velocity = qw + c3 * self.q
        self.q_acceleration = (c3 * c3) * self.q - qp
        return good

    def _follow_vehicle(self, time: float) -> None:
        """On an endless track, move the line on by whole periods: zeros enter at its front, its end comes to rest."""
        window = self.inputs.window
        front = self.inputs.start + self.inputs.speed * time
        while window.period_elements and front - self.passed * window.period >= window.home:
            by = window.period_elements
            for vector in (self.u, self.u_velocity):
                vector[:-by], vector[-by:] = vector[by:].copy(), 0.0
                vector[0] = 0.0
            self.passed += 1.0
            self.element -= by
            self.rows -= by * self.track.node_dofs
            # What the ends' old neighbours put into the load would be a blow there.
            self.load = first_load(self.track, self.scheme, self.u, self.u_velocity)

    def _snapshot(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        return self.force.copy(), self.overlap.copy(), self.q.copy(), self.q_acceleration.copy()

    def _place_wheels(self, time: float) -> None:
        """Element, local coordinate, Hermite values and level of every wheel."""
        x = self.inputs.local_positions(time, self.passed)
        self.element, self.local, self.shape = shape_at(self.line, x)
        self.rows = self.line.layer_rows(self.element) if self.track.node_dofs else np.zeros((len(x), 4), int)
        self.level = self.inputs.levels(time)

    def _rail_value(self, vector: np.ndarray, j: int) -> float:
        """N times the rail dofs under wheel j."""
        if not self.track.node_dofs:
            return 0.0
        n, u = self.shape[j], vector.ravel()[self.rows[j]]
        return (n[0] * u[0] + n[1] * u[1]) + (n[2] * u[2] + n[3] * u[3])

    def _push_rail(self) -> None:
        """Add Nᵀ F to the track's load."""
        if not self.track.node_dofs:
            return
        flat = self.load.reshape(-1)
        for j, force in enumerate(self.force):
            flat[self.rows[j]] += self.shape[j] * force

    def _gather(self, rate: int, j: int) -> float:
        """N K̂⁻¹ load under wheel j: where the rail would be without the new contact forces."""
        track = self.track
        if not track.node_dofs:
            return 0.0
        columns, rows, chains = self._near_rail(rate, j)
        parts = columns * self.load.ravel()[rows, None]
        chained = np.add.accumulate(parts.reshape(-1, chains, 4), axis=0)[-1]
        y = chained[0]
        for chain in range(1, chains):
            y = y + chained[chain]
        n = self.shape[j]
        return (n[0] * y[0] + n[1] * y[1]) + (n[2] * y[2] + n[3] * y[3])

    def _flexibility(self, rate: int, i: int, j: int) -> float:
        """N_i K̂⁻¹ N_jᵀ and the local rail compliance, for j <= i."""
        track, dofs = self.track, self.track.node_dofs
        total = 0.0
        if self.element[i] == self.element[j]:
            length, compliance = self._element(self.element[i])
            x = length * min(self.local[i], self.local[j])
            a = length * max(self.local[i], self.local[j])
            c = length - a
            total = compliance * (c * c * x * x * (3.0 * a * length - x * (3.0 * a + c)))
        if not dofs:
            return total
        near = 0.0
        if isinstance(track, FactorisedSparse):
            # Of the places near an element, the rail's come first, two a node.
            dofs, places = 2, track.near.rail_places
            other = 2 * (self.element[j] - track.near.first[self.element[i]])
        else:
            other, places = self.element[j] * dofs - track.window_start[self.element[i]], track.window_rows
        if other >= 0 and other + dofs + 1 < places:
            columns, _, _ = self._near_rail(rate, i)
            n = self.shape[i]
            for part in range(4):
                g = columns[other + (part // 2) * dofs + part % 2]
                near = near + self.shape[j, part] * ((n[0] * g[0] + n[1] * g[1]) + (n[2] * g[2] + n[3] * g[3]))
        return total + near

    def _near_rail(self, rate: int, j: int) -> tuple[np.ndarray, np.ndarray, int]:
        """K̂⁻¹ columns near the element under wheel j, their rows, and the number of interleaved sums over them."""
        track, element = self.track, self.element[j]
        if isinstance(track, FactorisedSparse):
            return track.near.columns[rate, element], track.near.rows[element], 2
        first = track.window_start[element]
        rows = np.arange(first, first + track.window_rows)
        return track.columns[rate, track.element_class[element]], rows, track.node_dofs // 2

    def _element(self, element: int) -> tuple[float, float]:
        """Length of an element [m] and its 1/(6EIℓ³)."""
        if self.line.imported is None:
            return self.line.element_length, self.compliance
        x = self.line.imported.rail.x
        length = float(x[element + 1] - x[element])
        return length, self.compliance / (length * length * length)

    def _solve_contact(self, rate: int, wheels: np.ndarray, rail: list[float]) -> bool:
        """Contact forces at the end of a substep from where wheels and rail would be without them."""
        count = len(self.force)
        flexibility = np.empty((count, count))
        inverse = self.inputs.tables.inverse[rate]
        for i in range(count):
            for j in range(i + 1):
                pair = self._flexibility(rate, i, j) + inverse[self.wheel_dofs[i], self.wheel_dofs[j]]
                flexibility[i, j] = flexibility[j, i] = pair
        constants = self.inputs.rest.constants
        free = ((constants.approach + wheels) - np.array(rail)) - self.level
        self.force, self.overlap, solved = solve_contact(free, flexibility, constants, self.force)
        return solved

    def _sweep(self, rate: int) -> np.ndarray:
        """K̂⁻¹ load, by the forward and backward sweep."""
        track = self.track
        if isinstance(track, FactorisedSparse):
            return sparse_sweep(track, rate, self.load)
        if not track.node_dofs:
            return self.load
        solution = np.empty_like(self.load)
        pattern, t = track.pattern, [0.0] * track.node_dofs
        table = track.rows[rate].tolist()
        for node, kind in enumerate(track.node_class):
            values = table[kind]
            carried = [
                value + row_product(values, row, t)
                for value, row in zip(self.load[node].tolist(), pattern.lower, strict=True)
            ]
            t = [row_product(values, row, carried) for row in pattern.pivot]
            solution[node] = t
        x = [0.0] * pattern.dofs
        for node in reversed(range(len(solution))):
            values = table[track.node_class[node]]
            x = [
                value + row_product(values, row, x)
                for value, row in zip(solution[node].tolist(), pattern.back, strict=True)
            ]
            solution[node] = x
        return solution


def _dense(matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Matrix times vector, summed from the first column to the last."""
    total = x[0] * 0.0 * matrix[:, 0]
    for column in range(len(x)):
        total = total + matrix[:, column] * x[column]
    return total
