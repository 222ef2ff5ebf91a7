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
from scipy.sparse import block_diag, csc_matrix, csr_matrix, diags
from scipy.sparse.linalg import splu

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
    level: Callable[[np.ndarray], np.ndarray] = lambda x: np.zeros_like(x)  # noqa: E731
    rail_EI: float | None = None
    """for the local rail compliance; None leaves it out"""
    breaks: tuple[float, ...] = ()
    """positions where r(x) is not smooth"""

    def __post_init__(self) -> None:
        track, vehicle = self.track, self.vehicle
        self.nv, self.nt = vehicle.dof_count, track.node_count * track.node_dofs
        self.element = track.length / track.element_count
        held = diags(track.pinned.ravel().astype(float))
        self.moves = ~track.pinned.ravel()
        self.M, self.C, self.K = (csr_matrix(m.to_csc()) for m in (track.mass, track.damping, track.stiffness))
        self.mass_factor = splu(csc_matrix(self.M + held))
        self.K_held = self.K + held
        self.inverse_mass = np.linalg.inv(vehicle.mass)
        self.wheels = np.array(vehicle.wheel_dofs)

    # Kinematics -------------------------------------------------------------------------------------------------------

    def positions(self, t: float) -> np.ndarray:
        """x of each wheel [m]."""
        return self.start + self.speed * t - self.vehicle.wheel_offsets

    def shape(self, x: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Track dofs under a place, the cubic Hermite values there, and the local rail compliance [m/N]."""
        a = self.element
        e = min(int(x / a), self.track.element_count - 1)
        s = x / a - e
        values = np.array([1 - 3 * s**2 + 2 * s**3, a * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, a * (s**3 - s**2)])
        m = self.track.node_dofs
        dofs = np.array([e * m, e * m + 1, (e + 1) * m, (e + 1) * m + 1])
        local = 0.0 if self.rail_EI is None else (s * a * (1 - s) * a) ** 3 / (3 * self.rail_EI * a**3)
        return dofs, values * self.moves[dofs], local

    def clearance(self, t: float, y: np.ndarray) -> np.ndarray:
        """z - N u - r: the overlap without the local rail compliance [m], shape (wheel,)."""
        x = self.positions(t)
        rail = np.zeros(len(x))
        if self.nt:
            for j, place in enumerate(x):
                dofs, values, _ = self.shape(place)
                rail[j] = values @ y[self.nv + dofs]
        return y[self.wheels] - rail - self.level(x)

    def force(self, t: float, y: np.ndarray) -> np.ndarray:
        """Contact forces [N], shape (wheel,)."""
        clearance = self.clearance(t, y)
        local = np.array([self.shape(x)[2] if self.nt else 0.0 for x in self.positions(t)])
        return self.law(clearance, local)

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
            if np.abs(change).max() <= 1e-16 * max(np.abs(q).max(), 1e-300):
                break
        return K * q**3

    # Dynamics ---------------------------------------------------------------------------------------------------------

    def right_hand_side(self, t: float, y: np.ndarray) -> np.ndarray:
        """ẏ."""
        nv, nt = self.nv, self.nt
        z, u, vz, vu = y[:nv], y[nv : nv + nt], y[nv + nt : 2 * nv + nt], y[2 * nv + nt :]
        force = self.force(t, y)
        load = self.vehicle.weight - self.vehicle.damping @ vz - self.vehicle.stiffness @ z
        load[self.wheels] -= force
        if not nt:
            return np.concatenate([vz, self.inverse_mass @ load])
        ground = -(self.C @ vu) - self.K @ u
        for x, F in zip(self.positions(t), force, strict=True):
            dofs, values, _ = self.shape(x)
            ground[dofs] += values * F
        return np.concatenate([vz, vu, self.inverse_mass @ load, self.mass_factor.solve(ground)])

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        """∂ẏ/∂y, dense; for implicit integrators."""
        nv, nt = self.nv, self.nt
        n = nv + nt
        if not hasattr(self, "_fixed"):
            inverse = np.zeros((n, n))
            inverse[:nv, :nv] = self.inverse_mass
            inverse[nv:, nv:] = self.mass_factor.solve(np.eye(nt))
            self._inverse = inverse
            self._fixed = np.zeros((2 * n, 2 * n))
            self._fixed[:n, n:] = np.eye(n)
            self._fixed[n:, :n] = -inverse @ block_diag([self.vehicle.stiffness, self.K]).toarray()
            self._fixed[n:, n:] = -inverse @ block_diag([self.vehicle.damping, self.C]).toarray()
        result = self._fixed.copy()
        for j, x in enumerate(self.positions(t)):
            dofs, values, local = self.shape(x)
            F = self.force(t, y)[j]
            if F <= 0.0:
                continue
            overlap = (F / self.stiffness) ** (1.0 / self.exponent)
            own = self.stiffness * self.exponent * overlap ** (self.exponent - 1.0)
            row = np.zeros(n)
            row[self.wheels[j]], row[nv + dofs] = 1.0, -values
            result[n:, :n] -= own / (1.0 + local * own) * np.outer(self._inverse @ row, row)
        return result

    def static(self) -> np.ndarray:
        """Equilibrium at t = 0, by Newton's method on the whole system."""
        nv, nt = self.nv, self.nt
        wheels, x = self.wheels, self.positions(0.0)
        K = block_diag([self.vehicle.stiffness, self.K_held]).toarray() if nt else self.vehicle.stiffness.copy()
        weight = np.concatenate([self.vehicle.weight, np.zeros(nt)])
        rows, local = np.zeros((len(x), nv + nt)), np.zeros(len(x))
        for j, place in enumerate(x):
            rows[j, wheels[j]] = 1.0
            if nt:
                dofs, values, local[j] = self.shape(place)
                rows[j, nv + dofs] = -values
        # From linear springs of about the right stiffness, so that all wheels are in contact at the start.
        load = weight.sum() / len(x)
        secant = load / ((load / self.stiffness) ** (1.0 / self.exponent) + local * load)
        level = self.level(x)
        y = np.linalg.solve(K + rows.T @ (secant[:, None] * rows), weight + rows.T @ (secant * level))
        for _ in range(50):
            F = self.law(rows @ y - level, local)
            overlap = (F / self.stiffness) ** (1.0 / self.exponent)
            own = self.stiffness * self.exponent * overlap ** (self.exponent - 1.0)
            tangent = own / (1.0 + local * own)
            change = np.linalg.solve(K + rows.T @ (tangent[:, None] * rows), weight - K @ y - rows.T @ F)
            y = y + change
            if np.abs(change).max() < 1e-15 * np.abs(y).max():
                break
        return np.concatenate([y, np.zeros(nv + nt)])

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
        events = [self._crossing(j, sign) for j in range(len(self.wheels)) for sign in (-1, 1)]
        times, states, lost, regained = [np.zeros(1)], [y[None]], [], []
        now = 0.0
        for stop in stops:
            while now < stop:
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
                which = next(k for k, found in enumerate(result.t_events) if len(found))
                now, y = float(result.t_events[which][0]), result.y_events[which][0]
                (regained if which % 2 else lost).append((now, which // 2))
        t, states_at = np.concatenate(times), np.concatenate(states)
        assert np.array_equal(t, time)
        force = np.array([self.force(when, one) for when, one in zip(t, states_at, strict=True)])
        return History(t, force, states_at[:, : self.nv], states_at[:, self.nv : n], lost, regained)

    def rail(self, track: np.ndarray, x: float) -> np.ndarray:
        """N u at a place from the track dofs, shape (time, dof) to (time,)."""
        dofs, values, _ = self.shape(x)
        return track[:, dofs] @ values

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


