"""The factor of an imported track's matrix, whatever its pattern."""

import numpy as np
import pytest
from finite_elements import reduced, sleeper_track
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array, random_array

from tbatch.numerics.factorization import factorise
from tbatch.numerics.near_rail import COLUMN_TOLERANCE
from tbatch.numerics.sparse_factor import SparseFactor
from tbatch.numerics.sparse_rows import sparse_products, sparse_sweep
from tbatch.numerics.two_step import TwoStep, effective
from tbatch.physics.sparse import SparseSymmetric, same_places


def some_matrix(seed: int, size: int, density: float) -> SparseSymmetric:
    """A definite matrix of any pattern."""
    pattern = random_array((size, size), density=density, rng=np.random.default_rng(seed))
    symmetric = abs(pattern + pattern.T)
    own = np.asarray(symmetric.sum(axis=1)).ravel() + 1.0
    return same_places([csc_array(-symmetric + csc_array(np.diag(own + symmetric.diagonal())))])[0]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 25), st.floats(0.0, 0.5))
def test_any_pattern_is_factorised_in_the_order_given(seed, size, density):
    matrix = some_matrix(seed, size, density)
    pinned = np.random.default_rng(seed).random((size, 1)) < 0.2
    factor = SparseFactor.of(matrix, pinned)
    lower = factor.lower.toarray()
    np.testing.assert_array_equal(lower, np.tril(lower, -1))
    unit = lower + np.eye(size)
    held = matrix.pinned(pinned, unit=1.0).entries.toarray()
    np.testing.assert_allclose(unit @ np.diag(factor.pivot) @ unit.T, held, atol=1e-12 * held.max())
    load = np.arange(1.0, size + 1.0)[:, None]
    solution = factor.solve(load)
    assert (solution[pinned] == 0.0).all()
    np.testing.assert_allclose(held @ solution, np.where(pinned, 0.0, load), atol=1e-10)


TRACKS = {
    "sleepers": lambda: sleeper_track(np.array([0.0, 0.6, 1.2, 1.5, 2.3])).shuffled(1).track(),
    "reduced": lambda: reduced(sleeper_track(0.6 * np.arange(6)), 4).shuffled(1).track(),
    "held ends": lambda: sleeper_track(0.6 * np.arange(6)).kept(np.r_[2:10, 11:18]).track(),
}


@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("splitting", [0.5, 2.0 - 2.0**0.5])
def test_the_lists_solve_and_multiply(track, splitting):
    track, scheme = TRACKS[track](), TwoStep(1e-4, splitting)
    factor = factorise(track, scheme)
    random = np.random.default_rng(0)
    free = track.free.astype(float)
    K, C, M = (part.entries for part in (track.stiffness, track.damping, track.mass))
    for rate, speed in enumerate(scheme.rates):
        load = random.standard_normal((track.node_count, 1))
        x = sparse_sweep(factor, rate, load)
        assert (x[track.pinned] == 0.0).all()
        np.testing.assert_allclose(effective(K, C, M, speed) @ x, load * free, atol=1e-9)
    v, u = (random.standard_normal((track.node_count, 1)) * free for _ in range(2))
    np.testing.assert_allclose(sparse_products(factor, 0, v, u), M @ v - C @ u, rtol=1e-12, atol=1e-9)
    four_h, two_h = 4.0 / scheme.first, 2.0 / scheme.first
    expected = four_h * (M @ (two_h * u + v) + C @ u)
    np.testing.assert_allclose(sparse_products(factor, 1, v, u), expected, rtol=1e-12, atol=1e-9 * abs(expected).max())


@pytest.mark.parametrize("track", TRACKS)
def test_the_columns_near_the_rail_are_those_of_the_inverse(track):
    track, scheme = TRACKS[track](), TwoStep(1e-4)
    near = factorise(track, scheme).near
    K, C, M = (part.entries for part in (track.stiffness, track.damping, track.mass))
    whole = (effective(K, C, M, scheme.c3) + csc_array(np.diag(track.pinned[:, 0].astype(float)))).toarray()
    inverse = np.linalg.inv(whole)
    inverse[track.pinned[:, 0]] = inverse[:, track.pinned[:, 0]] = 0.0
    scale = np.sqrt(np.outer(np.diag(inverse), np.diag(inverse)))
    rows = track.layer_rows(np.arange(track.element_count))
    for element in range(track.element_count):
        kept = np.zeros((track.node_count, 4))
        np.add.at(kept, near.rows[element], near.columns[0, element])
        error = np.abs(kept - inverse[:, rows[element]]) / np.maximum(scale[:, rows[element]], 1e-300)
        assert error[scale[:, rows[element]] > 0.0].max() <= 10 * COLUMN_TOLERANCE
        first = near.first[element]
        nodes = track.imported.rail.row[first : first + near.rail_places // 2]
        np.testing.assert_array_equal(near.rows[element, : near.rail_places : 2], nodes)


def test_a_matrix_that_is_not_definite_is_refused():
    matrix = SparseSymmetric(csc_array(np.array([[1.0, 2.0], [2.0, 1.0]])))
    with pytest.raises(ValueError, match="not positive definite at its stepped row 1: a dof is loose"):
        SparseFactor.of(matrix, np.zeros((2, 1), bool))
    with pytest.raises(ValueError, match="a dof is loose"):
        SparseFactor.of(SparseSymmetric(csc_array(np.ones((2, 2)))), np.zeros((2, 1), bool))
