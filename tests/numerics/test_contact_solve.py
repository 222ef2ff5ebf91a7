"""The contact solve finds the one solution of δ + H F(δ) = δ_free, whatever the wheels, laws and stiffnesses."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, nnls, root

from tbatch.numerics.contact_solve import law, solve_contact
from tbatch.physics.contact import ContactConstants

EPSILON = np.finfo(float).eps


def constants(kind: str, wheels: int, stiffness: np.ndarray, load: float = 6e4) -> ContactConstants:
    """The law's constants for wheels of these tangent stiffnesses [N/m] at a static load [N]."""
    if kind == "hertz":
        # Tangent 1.5 P0^(1/3) K^(2/3).
        K = (stiffness / (1.5 * load ** (1.0 / 3.0))) ** 1.5
        return ContactConstants(K, 1.5, (load / K) ** (2.0 / 3.0), np.zeros(wheels))
    approach = load / stiffness
    separation = np.zeros(wheels) if kind == "linear" else approach / 3.0
    return ContactConstants(stiffness, 1.0, approach + separation, separation)


def random_flexibility(random: np.random.Generator, wheels: int, size: float, spread: float) -> np.ndarray:
    """A symmetric positive definite H [m/N] with eigenvalues from size/spread to size."""
    rotation, _ = np.linalg.qr(random.standard_normal((wheels, wheels)))
    values = size * spread ** -random.random(wheels)
    H = (rotation * values) @ rotation.T
    return 0.5 * (H + H.T)


def assert_solved(free: np.ndarray, H: np.ndarray, of: ContactConstants, guess: np.ndarray) -> np.ndarray:
    """The solution satisfies law and compatibility to round-off; returns the forces."""
    force, overlap, solved = solve_contact(free, H, of, guess)
    assert solved
    assert (force >= 0.0).all()
    # The forces are the law's at these overlaps, in its own order of operations.
    expected, slope, _ = law(of, overlap.tolist())
    np.testing.assert_array_equal(force, expected)
    assert ((force == 0.0) == (overlap <= of.separation)).all()
    # Overlaps are known to some roundings of the largest terms that make them, those of the guess included; and a
    # rounding of δ is worth dF/dδ of force.
    terms = np.full_like(free, (of.approach + np.abs(free) + np.abs(H) @ (force + guess)).max())
    error = np.abs(overlap + H @ force - free)
    allowed = 40.0 * EPSILON * (terms + np.abs(H) @ (np.array(slope) * terms))
    assert (error <= allowed).all()
    return force


@pytest.mark.parametrize("kind", ["hertz", "linear", "affine"])
@pytest.mark.parametrize("wheels", range(1, 9))
def test_random_systems_are_solved_to_round_off(kind, wheels):
    random = np.random.default_rng(100 * wheels + len(kind))
    for _ in range(60):
        of = constants(kind, wheels, 10.0 ** random.uniform(8.0, 10.0, wheels))
        H = random_flexibility(random, wheels, 10.0 ** random.uniform(-13.0, -8.0), 10.0 ** random.uniform(0.0, 6.0))
        free = random.standard_normal(wheels) * 10.0 ** random.uniform(-6.0, -3.0)
        guess = np.where(random.random(wheels) < 0.3, 0.0, 6e4 * random.random(wheels))
        assert_solved(free, H, of, guess)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_stiffness_ratios_far_beyond_any_vehicle_are_solved(data):
    # Contact from a millionth of the rest's stiffness to a thousand times it (a wheel on a rail: 0.01 to 10), wheels
    # nine decades apart, overlaps from 1 nm to 10 mm either way, guesses from nothing to ten wheel loads.
    wheels = data.draw(st.integers(1, 4))
    kind = data.draw(st.sampled_from(["hertz", "linear", "affine"]))
    size = 10.0 ** data.draw(st.floats(-12.0, -7.0))
    ratios = data.draw(st.lists(st.floats(-6.0, 3.0), min_size=wheels, max_size=wheels))
    of = constants(kind, wheels, 10.0 ** np.array(ratios) / size)
    signs = np.array(data.draw(st.lists(st.sampled_from([-1.0, 1.0]), min_size=wheels, max_size=wheels)))
    reach = np.array(data.draw(st.lists(st.floats(-9.0, -2.0), min_size=wheels, max_size=wheels)))
    random = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    H = random_flexibility(random, wheels, size, 10.0 ** data.draw(st.floats(0.0, 8.0)))
    guess = np.array(data.draw(st.lists(st.sampled_from([0.0, 1.0, 1e5, 1e6]), min_size=wheels, max_size=wheels)))
    assert_solved(of.separation + signs * 10.0**reach, H, of, guess)


@pytest.mark.parametrize("kind", ["hertz", "linear", "affine"])
@pytest.mark.parametrize("wheels", [1, 2, 4])
def test_the_edge_of_separation_is_resolved(kind, wheels):
    random = np.random.default_rng(5)
    for distance in (1e-17, -1e-17, 1e-14, -1e-14, 1e-10, -1e-10):
        of = constants(kind, wheels, np.full(wheels, 1.5e9))
        H = random_flexibility(random, wheels, 1e-10, 10.0)
        free = of.separation + distance * (0.1 + random.random(wheels))
        for guess in (0.0, 1.0, 6e4):
            assert_solved(free, H, of, np.full(wheels, guess))
        # With one wheel pressed hard the others are pushed or lifted by it.
        free[-1] += 1e-4
        for guess in (0.0, 6e4):
            assert_solved(free, H, of, np.full(wheels, guess))


@pytest.mark.parametrize("kind", ["linear", "affine"])
@pytest.mark.parametrize("wheels", [1, 2, 3, 5])
def test_linear_laws_agree_with_two_independent_solvers(kind, wheels):
    random = np.random.default_rng(wheels)
    for _ in range(40):
        of = constants(kind, wheels, 10.0 ** random.uniform(8.5, 9.5, wheels))
        H = random_flexibility(random, wheels, 1e-9, 100.0)
        free = 2e-4 * random.standard_normal(wheels)
        force = assert_solved(free, H, of, np.zeros(wheels))
        # As a linear complementarity problem, all active sets tried: (H + 1/k) F = δ_free - δ_sep where F > 0.
        matrix, reach = H + np.diag(1.0 / of.stiffness), free - of.separation
        found = []
        for active in product((False, True), repeat=wheels):
            on = np.array(active)
            trial = np.zeros(wheels)
            if on.any():
                trial[on] = np.linalg.solve(matrix[np.ix_(on, on)], reach[on])
            if (trial >= 0.0).all() and (reach - matrix @ trial <= 1e-15).all():
                found.append(trial)
        assert len(found) >= 1
        # The condition of these systems is below 1e3.
        np.testing.assert_allclose(force, found[0], rtol=1e-11, atol=1e-8)
        # As a least-squares problem with F >= 0: min ½ Fᵀ A F - Fᵀ b = ½ |Lᵀ F - L⁻¹ b|².
        L = np.linalg.cholesky(matrix)
        scale = np.sqrt(matrix[0, 0])
        least, _ = nnls(L.T / scale, np.linalg.solve(L, reach) / scale)
        np.testing.assert_allclose(force, least, rtol=1e-8, atol=1e-5)


def test_one_hertz_wheel_agrees_with_bisection():
    random = np.random.default_rng(11)
    for _ in range(200):
        of = constants("hertz", 1, np.array([10.0 ** random.uniform(8.0, 10.0)]))
        h, free = 10.0 ** random.uniform(-12.0, -8.0), 10.0 ** random.uniform(-7.0, -3.0)
        force = assert_solved(np.array([free]), np.array([[h]]), of, np.zeros(1))
        K = of.stiffness[0]
        overlap = brentq(lambda d, K=K, h=h, free=free: d + h * K * d**1.5 - free, 0.0, free, xtol=1e-300, rtol=1e-15)
        # Overlaps are found to some roundings of δ_free and δ₀.
        allowed = 1.5 * K * np.sqrt(overlap) * 20.0 * EPSILON * (free + of.approach[0])
        assert abs(force[0] - K * overlap**1.5) <= allowed


@pytest.mark.parametrize("wheels", [2, 4])
def test_several_hertz_wheels_agree_with_scipy_s_root(wheels):
    random = np.random.default_rng(13)
    compared = 0
    for _ in range(40):
        of = constants("hertz", wheels, 10.0 ** random.uniform(8.5, 9.5, wheels))
        H = random_flexibility(random, wheels, 1e-9, 30.0)
        free = 1.5e-4 * random.standard_normal(wheels)
        force = assert_solved(free, H, of, np.zeros(wheels))
        # In units of 0.1 mm, for MINPACK's scaling.
        answer = root(
            lambda d, of=of, H=H, free=free: d + H @ of.force(1e-4 * d) * 1e4 - free * 1e4, free * 1e4, tol=1e-14
        )
        if np.abs(answer.fun).max() < 1e-12:
            np.testing.assert_allclose(force, of.force(1e-4 * answer.x), rtol=1e-8, atol=1e-2)
            compared += 1
    assert compared > 20


def test_the_guess_does_not_change_the_answer():
    random = np.random.default_rng(17)
    of = constants("hertz", 4, np.full(4, 1.5e9))
    H = random_flexibility(random, 4, 1e-10, 20.0)
    free = np.array([1e-4, -2e-4, 3e-5, 2e-4])
    first = assert_solved(free, H, of, np.zeros(4))
    for guess in (np.full(4, 6e4), np.array([0.0, 1e6, 0.0, 0.0]), first, 30.0 * first):
        np.testing.assert_allclose(assert_solved(free, H, of, guess), first, rtol=1e-12)


def test_without_flexibility_the_forces_are_the_law_s():
    of = constants("hertz", 3, np.full(3, 1.5e9))
    free = np.array([7e-5, -1e-5, 2e-4])
    np.testing.assert_array_equal(assert_solved(free, np.zeros((3, 3)), of, np.zeros(3)), law(of, free.tolist())[0])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", ["hertz", "linear"])
def test_what_is_not_finite_is_not_solved(bad, kind):
    of = constants(kind, 2, np.full(2, 1.5e9))
    H = np.array([[2e-10, 1e-10], [1e-10, 2e-10]])
    force, _, solved = solve_contact(np.array([1e-4, bad]), H, of, np.zeros(2))
    assert not solved
    np.testing.assert_array_equal(force, 0.0)
    force, _, solved = solve_contact(np.array([1e-4, 1e-4]), H * np.array([[1.0, bad], [bad, 1.0]]), of, np.ones(2))
    assert not solved


@pytest.mark.parametrize("kind", ["hertz", "linear", "affine"])
def test_a_grazing_wheel_does_not_stall_the_solve(kind):
    # δ_free at the edge of separation, to the last digit or within 0.1 µm, after a wheel load or two at the last step.
    random = np.random.default_rng(23)
    of = constants(kind, 4, np.full(4, 2.9e9), load=132e3)
    for _ in range(2000):
        size = 10.0 ** random.uniform(-10.0, -8.5)
        coupling = random.uniform(-0.2, 0.2, (4, 4))
        H = size * (np.eye(4) * (1.0 - np.diag(coupling)) + 0.5 * (coupling + coupling.T))
        nearness = random.integers(0, 2, 4) * 10.0 ** random.uniform(-16.0, -7.0, 4)
        graze = of.separation + random.choice([-1.0, 1.0], 4) * nearness
        apart = of.separation - 10.0 ** random.uniform(-6.0, -2.0, 4)
        free = np.where(random.random(4) < 0.5, graze, apart)
        assert_solved(free, H, of, random.choice([0.0, 1.0, 1.0], 4) * 3e5 * random.random(4))
