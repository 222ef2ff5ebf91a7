"""Imported tracks against integrations that know the given matrices alone, and against each other."""

from dataclasses import replace

import numpy as np
import pytest
from finite_elements import Export, exported, reduced, sleeper_track, solid_rail
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, make_interp_spline
from scipy.sparse import csc_array

import tbatch as tb
from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation, step_counts
from tbatch.numerics.scipy_run import ScipyRun
from tbatch.numerics.scipy_track import ScipyTrack

MASS, LOAD, SPRING, SPEED, START = 600.0, 60e3, 1.2e9, 45.0, 2.0
X = np.cumsum(np.append(0.0, np.tile([0.6, 0.4, 0.65], 5)))


def wheel() -> tb.Vehicle:
    """One mass under a constant load."""
    return tb.Vehicle([[MASS]], [[0.0]], [[0.0]], [0], [0.0], [LOAD])


def dip(x: np.ndarray) -> np.ndarray:
    """A smooth dip of 2 mm, from 2.6 m on, that the wheel cannot follow."""
    s = np.clip((np.asarray(x) - 2.6) / 0.4, 0.0, 1.0)
    return 2e-3 * 0.5 * (1.0 - np.cos(2.0 * np.pi * s))


def forces(export: Export, duration: float, step: float, *, scipy: bool = False, **options) -> np.ndarray:
    """Contact force of the engine, or of the SciPy baseline, at every step [N]."""
    track, rough = export.track(**options), tb.Irregularity.of(dip)
    of = Model.build(wheel(), track, tb.Contact.linear(stiffness=SPRING), step=step)
    runs = tb.Runs([SPEED], [rough], START)
    if not scipy:
        return tb.simulate(of, runs, duration, save=tb.SaveAt(step, ("contact_force",))).contact_force[0, :, 0]
    preparation = Preparation(of, runs, step_counts(of, runs, duration), "static")
    inputs = preparation.inputs(0)
    start = preparation.start(0, inputs)
    run = ScipyRun(ScipyTrack(track, of.scheme), of.ground, inputs, start)
    return np.array([start.force[0], *(run.advance(n)[0] for n in range(inputs.steps))])


def rail_row(export: Export):
    """N(x) over the given rows: straight lines or Hermite cubics through unit values, by SciPy."""
    values, slopes = (np.zeros((len(export.x), export.mass.shape[0])) for _ in range(2))
    values[np.arange(len(export.x)), export.w] = 1.0
    if export.theta is None:
        return make_interp_spline(export.x, values, k=1)
    slopes[np.arange(len(export.x)), export.theta] = 1.0
    return CubicHermiteSpline(export.x, values, slopes)


def integrated(export: Export, time: np.ndarray) -> np.ndarray:
    """The contact force by Radau from static equilibrium [N]; steps of at most 0.1 ms meet each loss of contact."""
    M, C, K = (part.toarray() for part in export.matrices)
    n = len(M)
    inverse, N_at = np.linalg.inv(M), rail_row(export)

    def force(t: float, z: float, u: np.ndarray) -> tuple[float, np.ndarray]:
        x = START + SPEED * t
        N = N_at(x)
        return SPRING * max(z - N @ u - float(dip(np.array(x))), 0.0), N

    def motion(t: float, y: np.ndarray) -> np.ndarray:
        z, u, vz, v = y[0], y[1 : n + 1], y[n + 1], y[n + 2 :]
        F, N = force(t, z, u)
        return np.concatenate([[vz], v, [(LOAD - F) / MASS], inverse @ (N * F - C @ v - K @ u)])

    u = np.linalg.solve(K, N_at(START) * LOAD)
    z = N_at(START) @ u + LOAD / SPRING
    y = np.concatenate([[z], u, np.zeros(n + 1)])
    scale = np.concatenate([np.full(n + 1, 1e-12), np.full(n + 1, 1e-9)])
    found = solve_ivp(motion, (0.0, time[-1]), y, method="Radau", t_eval=time, rtol=1e-8, atol=scale, max_step=1e-4)
    assert found.success
    return np.array([force(t, y[0], y[1 : n + 1])[0] for t, y in zip(found.t, found.y.T, strict=True)])


CASES = {
    "straight lines, no rotations": lambda: solid_rail(0.6 * np.arange(16)),
    "cubics, uneven nodes, sleepers": lambda: sleeper_track(X, mass=200.0),
}


@pytest.mark.parametrize("case", CASES)
def test_forces_are_those_of_an_integration_of_the_given_matrices(case):
    export, step = CASES[case](), 2.5e-5
    force = forces(export.shuffled(11), 0.04, step)
    expected = integrated(export, step * np.arange(len(force)))
    assert (expected == 0.0).sum() > 20
    # The scheme's error at this step through a loss of contact and a landing; it is of second order.
    assert np.abs(force - expected).max() <= 2e-3 * expected.max()
    coarse = forces(export.shuffled(11), 0.04, 2.0 * step)
    assert np.abs(coarse - expected[::2]).max() <= 8e-3 * expected.max()


def test_static_deflection_is_that_of_the_given_matrices():
    export = sleeper_track(X)
    track = export.shuffled(4).track()
    of = Model.build(wheel(), track, tb.Contact.linear(stiffness=SPRING), step=1e-4)
    places = np.array([0.0, 2.31, 4.0])
    N = rail_row(export)(places)
    expected = N @ np.linalg.solve(export.stiffness.toarray(), N.T)
    np.testing.assert_allclose(of.ground.flexibility(places), expected, rtol=1e-10)


@pytest.mark.parametrize("case", CASES)
def test_scipy_gives_the_same_forces(case):
    export = CASES[case]().shuffled(3)
    force, other = forces(export, 0.03, 1e-4), forces(export, 0.03, 1e-4, scipy=True)
    # Round-off of two factorisations in different orders, through a landing.
    np.testing.assert_allclose(force, other, atol=1e-8 * force.max())


def test_all_modes_of_a_reduced_model_give_the_forces_of_the_whole_and_few_give_them_nearly():
    whole = exported(tb.Track.slab("seed-slab", length=13.0))
    inner = whole.mass.shape[0] - int((whole.w >= 0).sum() + (whole.theta >= 0).sum())
    full = forces(whole, 0.04, 1e-4)
    all_modes = forces(reduced(whole, inner).shuffled(1), 0.04, 1e-4)
    # The condition of the modes' own frequencies: the reduction is exact, its numbers are rounded.
    np.testing.assert_allclose(all_modes, full, atol=1e-7 * full.max())
    few = np.abs(forces(reduced(whole, 30), 0.04, 1e-4) - full).max()
    fewer = np.abs(forces(reduced(whole, 8), 0.04, 1e-4) - full).max()
    assert few < 0.5 * fewer
    assert few < 1e-3 * full.max()


def test_rotations_without_mass_are_the_limit_of_little_mass():
    beams = sleeper_track(X)
    lumped = np.diag(beams.mass.toarray()).copy()
    lumped[beams.w] = 60.0 * np.gradient(X)
    results = []
    for share in (0.0, 1e-6):
        lumped[beams.theta] = share
        results.append(forces(replace(beams, mass=csc_array(np.diag(lumped))).shuffled(2), 0.03, 1e-4))
    # An inertia of 1e-6 kg m2 on 1e7 N m/rad answers within 2 us of a step of 100.
    np.testing.assert_allclose(results[0], results[1], atol=1e-5 * results[0].max())


def test_a_point_mass_on_a_rigid_arm_may_leave_a_motion_without_mass():
    beams = sleeper_track(X)
    mass = np.diag(np.diag(beams.mass.toarray()))
    mass[beams.theta, beams.theta] = 0.0
    # 20 kg at the end of an arm of 0.1 m in the running direction, on node 5.
    arm = np.zeros(len(mass))
    arm[beams.w[5]], arm[beams.theta[5]] = 1.0, 0.1
    mass[beams.w[5], beams.w[5]] = 0.0
    mass += 20.0 * np.outer(arm, arm)
    force = forces(replace(beams, mass=csc_array(mass)), 0.03, 1e-4)
    mass[beams.theta, beams.theta] += 1e-6
    np.testing.assert_allclose(force, forces(replace(beams, mass=csc_array(mass)), 0.03, 1e-4), atol=1e-5 * force.max())


@pytest.mark.parametrize("name", ["newmark_linear", "hht_alpha", "two_step"])
def test_the_comparison_methods_take_imported_tracks(name):
    export = sleeper_track(X).shuffled(9)
    contact = tb.Contact.linear(stiffness=SPRING)
    given = {"speed": SPEED, "irregularity": None, "start": START, "duration": 0.02, "step": 2.5e-5}
    save = tb.SaveAt(1e-4, ("contact_force", "rail", "rail_acceleration", "rail_under_wheel"), [2.5, 3.3])
    method = getattr(tb.methods, name)(wheel(), export.track(), contact, **given, save=save)
    of = Model.build(wheel(), export.track(), contact, step=2.5e-5)
    engine = tb.simulate(of, tb.Runs([SPEED], [None], START), 0.02, save=save)
    assert method.status[0] == 0
    # Newmark and HHT hold their wheels to the step before and differ in period; two-step is the same scheme.
    share = 1e-9 if name == "two_step" else 5e-3
    for channel in ("contact_force", "rail"):
        a, b = method.channels[channel], engine.channels[channel]
        np.testing.assert_allclose(a, b, rtol=0.0, atol=share * np.abs(b).max())
