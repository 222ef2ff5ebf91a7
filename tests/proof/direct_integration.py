"""A vehicle on a meshed track, integrated by SciPy to tight tolerances: nothing of tbatch but its matrices.

The two systems and the contact are written as one first-order system

    y = (z, u, ż, u̇),   M_v z̈ = w - C_v ż - K_v z - Γᵀ F,   M_t ü = Nᵀ F - C_t u̇ - K_t u,
    F_j = K max(δ_j, 0)^p,   δ_j = z_j - N(x_j) u - r(x_j) - a F_j

with z from the unloaded position and the local rail compliance a(x) solved with the law, wheel by wheel. Losses and
regains of contact are found as events of the integrator, which restarts there.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import block_diag, diags

from tbatch import Track, Vehicle


@dataclass
class History:
    """What an integration did at the times asked for."""

    time: np.ndarray
    force: np.ndarray
    """[N], shape (time, wheel)"""
    vehicle: np.ndarray
    """z from the unloaded position [m, rad], shape (time, dof)"""
    track: np.ndarray
    """u, all track dofs, shape (time, dof)"""
    lost: list[tuple[float, int]] = field(default_factory=list)
    """(time, wheel) of each loss of contact"""
    regained: list[tuple[float, int]] = field(default_factory=list)


@dataclass
class DirectIntegration:
    """One vehicle, one track, one speed. Hertz: `exponent` 1.5; linear: 1."""

    vehicle: Vehicle
    track: Track
    stiffness: float
    exponent: float
    speed: float
    start: float
    level: Callable[[np.ndarray], np.ndarray] = lambda x: np.zeros_like(x)
    rail_EI: float | None = None
    """for the local rail compliance; None leaves it out"""
    breaks: tuple[float, ...] = ()
    """positions where r(x) is not smooth"""

    def __post_init__(self) -> None:
        track, vehicle = self.track, self.vehicle
        self.nv, self.nt = vehicle.dof_count, track.node_count * track.node_dofs
        self.element = track.length / track.element_count
        self.wheels = np.array(vehicle.wheel_dofs)
        self.moves = ~track.pinned.ravel()
        self.K = track.stiffness.to_csc()
        held = diags(track.pinned.ravel().astype(float))
        # Mass times acceleration is resolved once: full inverses, the systems of the proofs are small.
        self.inverse_mass = np.linalg.inv(block_diag([vehicle.mass, track.mass.to_csc() + held]).toarray())
        couplings = [block_diag(pair).toarray() for pair in zip(
            (vehicle.stiffness, vehicle.damping), (self.K, track.damping.to_csc()), strict=True)]  # fmt: skip
        self.A = -self.inverse_mass @ np.hstack(couplings)
        self.lift = self.inverse_mass[:, : self.nv] @ vehicle.weight

    # Kinematics -------------------------------------------------------------------------------------------------------

    def positions(self, t: float) -> np.ndarray:
        """X of each wheel [m]."""
        return self.start + self.speed * t - self.vehicle.wheel_offsets

    def shape(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Track dofs under each place and the cubic Hermite values there, (place, 4) each; local compliance [m/N]."""
        a, m = self.element, self.track.node_dofs
        e = np.minimum((x / a).astype(int), self.track.element_count - 1)
        s = x / a - e
        values = np.array([1 - 3 * s**2 + 2 * s**3, a * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, a * (s**3 - s**2)])
        dofs = e[:, None] * m + np.array([0, 1, m, m + 1])
        local = np.zeros(len(x)) if self.rail_EI is None else (s * (1 - s) * a) ** 3 / (3 * self.rail_EI)
        return dofs, values.T * self.moves[dofs], local

    def clearance(self, t: float, y: np.ndarray) -> np.ndarray:
        """Z - N u - r: the overlap without the local rail compliance [m], shape (wheel,)."""
        x = self.positions(t)
        dofs, values, _ = self.shape(x)
        return y[self.wheels] - (values * y[self.nv + dofs]).sum(1) - self.level(x)

    def force(self, t: float, y: np.ndarray) -> np.ndarray:
        """Contact forces [N], shape (wheel,)."""
        return self.law(self.clearance(t, y), self.shape(self.positions(t))[2])

    def law(self, clearance: np.ndarray, local: np.ndarray) -> np.ndarray:
        """F with F = K δ^p and δ + a F = clearance."""
        K = self.stiffness
        g = np.maximum(clearance, 0.0)
        if self.exponent == 1.0:
            return K * g / (1.0 + K * local)
        # With q = √δ: q² + a K q³ = g, convex in q > 0: Newton from the right converges from above.
        q = np.sqrt(g)
        for _ in range(60):
            slope = 2.0 * q + 3.0 * local * K * q**2
            change = (q**2 + local * K * q**3 - g) / np.where(slope > 0.0, slope, 1.0)
            q = q - change
            if np.abs(change).max() <= 1e-15 * np.abs(q).max():
                break
        return K * q**3

    # Dynamics ---------------------------------------------------------------------------------------------------------

    def right_hand_side(self, t: float, y: np.ndarray) -> np.ndarray:
        """ẏ."""
        n, nv = self.nv + self.nt, self.nv
        x = self.positions(t)
        dofs, values, local = self.shape(x)
        clearance = y[self.wheels] - (values * y[nv + dofs]).sum(1) - self.level(x)
        force = self.law(clearance, local)
        acceleration = self.A @ y + self.lift - self.inverse_mass[:, self.wheels] @ force
        for j, F in enumerate(force):
            acceleration += self.inverse_mass[:, nv + dofs[j]] @ (values[j] * F)
        return np.concatenate([y[n:], acceleration])

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        """∂ẏ/∂y, for implicit integrators."""
        n = self.nv + self.nt
        result = np.vstack([np.eye(n, 2 * n, n), self.A])
        rows, local = self.rows(t)
        tangent = self.tangent(self.force(t, y), local)
        result[n:, :n] -= self.inverse_mass @ rows.T @ (tangent[:, None] * rows)
        return result

    def rows(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """z_w - N u as rows over (z, u), shape (wheel, dof), and the local compliance [m/N], shape (wheel,)."""
        dofs, values, local = self.shape(self.positions(t))
        rows = np.zeros((len(self.wheels), self.nv + self.nt))
        for j, wheel in enumerate(self.wheels):
            rows[j, wheel], rows[j, self.nv + dofs[j]] = 1.0, -values[j]
        return rows, local

    def tangent(self, force: np.ndarray, local: np.ndarray) -> np.ndarray:
        """dF/d(z - N u - r) at a force, shape (wheel,)."""
        overlap = (force / self.stiffness) ** (1.0 / self.exponent)
        own = np.where(force > 0.0, self.stiffness * self.exponent * overlap ** (self.exponent - 1.0), 0.0)
        return own / (1.0 + local * own)

    def static(self) -> np.ndarray:
        """Equilibrium at t = 0, by Newton's method on the whole system."""
        n = self.nv + self.nt
        held = diags(self.track.pinned.ravel().astype(float))
        K = block_diag([self.vehicle.stiffness, self.K + held]).toarray()
        weight = np.concatenate([self.vehicle.weight, np.zeros(self.nt)])
        rows, local = self.rows(0.0)
        level = self.level(self.positions(0.0))
        # From linear springs of about the right stiffness, so that all wheels are in contact at the start.
        load = weight.sum() / len(level)
        secant = load / ((load / self.stiffness) ** (1.0 / self.exponent) + local * load)
        y = np.linalg.solve(K + rows.T @ (secant[:, None] * rows), weight + rows.T @ (secant * level))
        for _ in range(50):
            force = self.law(rows @ y - level, local)
            tangent = self.tangent(force, local)
            change = np.linalg.solve(K + rows.T @ (tangent[:, None] * rows), weight - K @ y - rows.T @ force)
            y = y + change
            if np.abs(change).max() < 1e-14 * np.abs(y).max():
                break
        return np.concatenate([y, np.zeros(n)])

    def run(
        self, time: np.ndarray, *, initial: np.ndarray | None = None, method: str = "DOP853", rtol: float = 1e-9
    ) -> History:
        """Integrate from t = 0 and report at given times.

        Args:
            time: rising times, the first one 0 [s].
            initial: y at t = 0; static equilibrium by default.
            method: of `scipy.integrate.solve_ivp`.
            rtol: relative tolerance; the absolute one is rtol times 10 µm for displacements and 10 mm/s for velocities.
        """
        y = self.static() if initial is None else initial
        n = self.nv + self.nt
        atol = rtol * np.concatenate([np.full(n, 1e-5), np.full(n, 1e-2)])
        options = {"jac": self.jacobian} if method == "Radau" else {}
        stops = sorted({self._when(x, j) for x in self.breaks for j in range(len(self.wheels))})
        stops = [t for t in stops if 0.0 < t < time[-1]] + [time[-1]]
        touching = self.clearance(0.0, y) > 0.0
        times, states, lost, regained = [np.zeros(1)], [y[None]], [], []
        now = 0.0
        for stop in stops:
            while now < stop:
                # Only the other side of the present state is looked for: a root is not found a second time.
                events = [self._crossing(j, -1 if touching[j] else 1) for j in range(len(self.wheels))]
                asked = time[(time > now) & (time <= stop)]
                result = solve_ivp(
                    self.right_hand_side, (now, stop), y, method=method, events=events, rtol=rtol, atol=atol,
                    t_eval=np.unique(np.append(asked, stop)), first_step=min(1e-7, 0.5 * (stop - now)), **options,
                )  # fmt: skip
                assert result.status >= 0, result.message
                reached = np.isin(asked, result.t).nonzero()[0]
                times.append(asked[reached])
                # An event before the first time asked for leaves empty lists.
                states.append(np.reshape(result.y, (2 * n, -1)).T[: len(reached)])
                if result.status == 0:
                    now, y = stop, result.y[:, -1]
                    continue
                wheel = next(j for j, found in enumerate(result.t_events) if len(found))
                now, y = float(result.t_events[wheel][0]), result.y_events[wheel][0]
                (lost if touching[wheel] else regained).append((now, wheel))
                touching[wheel] = not touching[wheel]
        t, states_at = np.concatenate(times), np.concatenate(states)
        assert np.array_equal(t, time)
        force = np.array([self.force(when, one) for when, one in zip(t, states_at, strict=True)])
        return History(t, force, states_at[:, : self.nv], states_at[:, self.nv : n], lost, regained)

    def rail(self, track: np.ndarray, x: float) -> np.ndarray:
        """N u at a place from the track dofs, shape (time, dof) to (time,)."""
        dofs, values, _ = self.shape(np.array([x]))
        return track[:, dofs[0]] @ values[0]

    def _when(self, x: float, wheel: int) -> float:
        return (x - self.start + self.vehicle.wheel_offsets[wheel]) / self.speed if self.speed else 0.0

    def _crossing(self, wheel: int, sign: int) -> Callable[[float, np.ndarray], float]:
        def event(t: float, y: np.ndarray) -> float:
            return float(self.clearance(t, y)[wheel])

        event.terminal, event.direction = True, float(sign)  # type: ignore[attr-defined]
        return event


def worst(a: np.ndarray, b: np.ndarray) -> float:
    """Largest absolute difference."""
    return float(np.abs(a - b).max())
