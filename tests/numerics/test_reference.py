"""The one-run reference does what the scheme says: the plain form with accelerations, dense, all unknowns at once."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import root

from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation
from tbatch.engine.runs import Runs
from tbatch.numerics.initial import InitialState
from tbatch.numerics.reference import ReferenceRun
from tbatch.numerics.run_inputs import RunInputs
from tbatch.numerics.scipy_run import ScipyRun
from tbatch.numerics.scipy_track import ScipyTrack
from tbatch.numerics.two_step import EQUAL_SPLITTING
from tbatch.physics.contact import Contact
from tbatch.physics.elements import fixed_fixed_compliance
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

STEPS = 60
LAWS = {"hertz": Contact.hertz(wheel_radius=0.4575), "affine": Contact.affine(wheel_radius=0.4575)}
TRACKS = {
    "winkler": Track.winkler("koh-winkler", length=10.0, elements=10, rails=2),
    "slab": Track.slab("seed-slab", length=10.4),
}


def bar() -> Vehicle:
    """A sprung mass on two wheels 0.3 m apart, now on one element, now on two."""
    k, c, half = 2e6, 2e4, 0.15
    links = np.array([[1.0, half, -1.0, 0.0], [1.0, -half, 0.0, -1.0]])
    pairs = links.T @ links
    masses = np.diag([9000.0, 800.0, 600.0, 700.0])
    return Vehicle(masses, c * pairs, k * pairs, [2, 3], [0.0, 2.0 * half], rails=2, wheel_radius=0.4575)


def prepared(track: str, law: str, splitting: float, step: float = 1e-4) -> tuple[Model, RunInputs, InitialState]:
    """A model, the constants of one rough run, and its start."""
    of = Model.build(bar(), TRACKS[track], LAWS[law], step=step, splitting=splitting)
    rough = Irregularity.cosines([1.0 / 0.21, 1.0 / 0.083], [0.4e-3, 0.1e-3], [0.0, 1.0])
    preparation = Preparation(of, Runs([50.0], [rough], start=4.1), np.array([STEPS]), "static")
    inputs = preparation.inputs(0)
    return of, inputs, preparation.start(0, inputs)


def stepped(of: Model, inputs: RunInputs, start: InitialState) -> list[np.ndarray]:
    """Vehicle, track and forces after each step of the reference."""
    run = ReferenceRun(
        of.factor,
        of.scheme,
        inputs,
        start,
        line=of.track,
        compliance=of.compliance,
    )
    states = []
    for n in range(STEPS):
        assert run.advance(n)
        states.append(np.concatenate([run.q, run.u.ravel(), run.force]))
    return states


class PlainScheme:
    """Trapezoidal rule and three-point backward difference of vehicle and track as one dense system.

    Displacements, velocities and accelerations as in the textbook; the contact forces of both wheels are found by
    SciPy's root for the coupled system, from δ = δ₀ + q_w - N u - r - (local compliance) F.
    """

    def __init__(self, of: Model, inputs: RunInputs, start: InitialState) -> None:
        vehicle, track = of.vehicle, of.track
        self.of, self.inputs, self.step, self.splitting = of, inputs, of.step, of.splitting
        self.M, self.C, self.K = (
            block_diag(one, two.to_csc().toarray())
            for one, two in (
                (vehicle.mass, track.mass),
                (vehicle.damping, track.damping),
                (vehicle.stiffness, track.stiffness),
            )
        )
        self.free = np.concatenate([np.ones(vehicle.dof_count, bool), track.free.ravel()])
        self.weight = np.zeros(len(self.M))
        self.weight[list(vehicle.wheel_dofs)] = inputs.rest.load
        self.x = np.concatenate([start.displacement, start.track.ravel()])
        self.v = np.zeros_like(self.x)
        self.force = start.force
        load = self.weight + self.pull(0.0).T @ self.force - self.K @ self.x
        self.a = self.solve(self.M, load)

    def solve(self, matrix: np.ndarray, load: np.ndarray) -> np.ndarray:
        """The free dofs' share of matrix⁻¹ load."""
        x = np.zeros_like(load)
        x[self.free] = np.linalg.solve(matrix[np.ix_(self.free, self.free)], load[self.free])
        return x

    def pull(self, time: float) -> np.ndarray:
        """Nᵀ on the track and -Γᵀ on the vehicle: the load of unit contact forces, shape (wheel, dof)."""
        vehicle, track = self.of.vehicle, self.of.track
        G = np.zeros((vehicle.wheel_count, len(self.M)))
        element, shape = track.locate(self.inputs.positions(time))
        for wheel, dof in enumerate(vehicle.wheel_dofs):
            G[wheel, dof] = -1.0
            first = vehicle.dof_count + element[wheel] * track.node_dofs
            G[wheel, [first, first + 1, first + track.node_dofs, first + track.node_dofs + 1]] = shape[wheel]
        return G

    def compliance(self, time: float) -> np.ndarray:
        """Local rail compliance, shape (wheel, wheel)."""
        track, x = self.of.track, self.inputs.positions(time)
        element, a = np.floor(x / track.element_length), track.element_length
        local = x - element * a
        pairs = fixed_fixed_compliance(local[:, None], local[None, :], a, track.rail_EI)
        return np.where(element[:, None] == element[None, :], pairs, 0.0)

    def equilibrium(self, time: float, matrix: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """X and F with matrix x = load + w + Gᵀ F and F the law of the overlaps that x gives."""
        G, constants = self.pull(time), self.inputs.rest.constants
        without = self.solve(matrix, load + self.weight)
        answer = np.stack([self.solve(matrix, row) for row in G])
        scale = self.inputs.rest.load[0]

        def residual(scaled: np.ndarray) -> np.ndarray:
            x = without + scale * scaled @ answer
            overlap = constants.approach - G @ x - self.inputs.levels(time) - self.compliance(time) @ (scale * scaled)
            return scaled - constants.force(overlap) / scale

        best = min(
            (root(residual, guess, tol=1e-15) for guess in (self.force / scale, np.zeros(2), np.ones(2))),
            key=lambda one: np.abs(one.fun).max(),
        )
        assert np.abs(best.fun).max() < 1e-12
        force = scale * best.x
        return without + force @ answer, force

    def advance(self, n: int) -> np.ndarray:
        """One step; vehicle, track and forces at its end."""
        M, C, K, dt, g = self.M, self.C, self.K, self.step, self.splitting
        x0, v0, a0, h = self.x, self.v, self.a, g * dt
        matrix = K + 2.0 / h * C + 4.0 / h**2 * M
        load = C @ (2.0 / h * x0 + v0) + M @ (4.0 / h**2 * x0 + 4.0 / h * v0 + a0)
        x1, self.force = self.equilibrium((n + g) * dt, matrix, load)
        v1 = 2.0 / h * (x1 - x0) - v0
        c1, c2, c3 = (1 - g) / (g * dt), -1.0 / ((1 - g) * g * dt), (2 - g) / ((1 - g) * dt)
        known_v, known_a = c1 * x0 + c2 * x1, c1 * v0 + c2 * v1
        load = -C @ known_v - M @ (known_a + c3 * known_v)
        self.x, self.force = self.equilibrium((n + 1) * dt, K + c3 * C + c3**2 * M, load)
        self.v = known_v + c3 * self.x
        self.a = known_a + c3 * self.v
        return np.concatenate([self.x, self.force])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("splitting", [EQUAL_SPLITTING, 0.5, 0.4])
def test_it_is_the_scheme_in_its_plain_form(track, law, splitting):
    of, inputs, start = prepared(track, law, splitting)
    plain, separated = PlainScheme(of, inputs, start), 0
    for n, state in enumerate(stepped(of, inputs, start)):
        expected = plain.advance(n)
        # Round-off of K̂ x, forces to 1e-12 of the load a step, both carried along for some steps.
        np.testing.assert_allclose(state[:-2], expected[:-2], rtol=0.0, atol=1e-9 * np.abs(expected[:-2]).max())
        np.testing.assert_allclose(state[-2:], expected[-2:], rtol=0.0, atol=1e-7 * inputs.rest.load.max())
        separated += (expected[-2:] == 0.0).sum()
    assert separated > 5


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize(("splitting", "step"), [(EQUAL_SPLITTING, 1e-4), (0.5, 1e-4), (EQUAL_SPLITTING, 1e-3)])
def test_scipy_s_banded_solver_gives_the_same_run(track, law, splitting, step):
    of, inputs, start = prepared(track, law, splitting, step) if step < 1e-3 else slow(track, law)
    run = ScipyRun(ScipyTrack(of.track, of.scheme), of.ground, inputs, start)
    for n, state in enumerate(stepped(of, inputs, start)):
        force = run.advance(n)
        # Columns are cut at 1e-12, round-off is carried along.
        np.testing.assert_allclose(state[-2:], force, rtol=0.0, atol=1e-8 * inputs.rest.load.max())
        both = np.concatenate([run.q, run.u])
        np.testing.assert_allclose(state[:-2], both, rtol=0.0, atol=1e-10 * np.abs(both).max())


def slow(track: str, law: str) -> tuple[Model, RunInputs, InitialState]:
    """The same at a tenth of the speed, for a step ten times as long."""
    of = Model.build(bar(), TRACKS[track], LAWS[law], step=1e-3)
    rough = Irregularity.cosines([1.0 / 0.21], [0.4e-3])
    preparation = Preparation(of, Runs([5.0], [rough], start=4.1), np.array([STEPS]), "static")
    inputs = preparation.inputs(0)
    return of, inputs, preparation.start(0, inputs)
