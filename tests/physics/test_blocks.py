"""Block tridiagonal matrices against dense ones."""

import numpy as np
import pytest
from scipy.linalg import cholesky_banded, solveh_banded

from tbatch.physics.blocks import BlockTridiagonal


@pytest.fixture
def elements():
    """Five random symmetric positive definite element matrices of two nodes with three dofs."""
    a = np.random.default_rng(1).normal(size=(5, 6, 6))
    return a @ a.transpose(0, 2, 1) + np.eye(6)


@pytest.fixture
def dense(elements):
    matrix = np.zeros((18, 18))
    for e, element in enumerate(elements):
        matrix[3 * e : 3 * e + 6, 3 * e : 3 * e + 6] += element
    return matrix


def test_assembly_adds_every_element_at_its_two_nodes(elements, dense):
    np.testing.assert_allclose(BlockTridiagonal.from_elements(elements, 5).to_csc().toarray(), dense, rtol=1e-14)


def test_one_element_matrix_serves_for_all(elements):
    one = BlockTridiagonal.from_elements(elements[0], 5)
    np.testing.assert_array_equal(one.diagonal, BlockTridiagonal.from_elements([elements[0]] * 5, 5).diagonal)


@pytest.mark.parametrize("shape", [(6, 3), (6, 3, 4)])
def test_product_equals_the_dense_one(elements, dense, shape):
    u = np.random.default_rng(2).normal(size=shape)
    expected = (dense @ u.reshape(18, -1)).reshape(shape)
    np.testing.assert_allclose(BlockTridiagonal.from_elements(elements, 5).dot(u), expected, rtol=1e-13, atol=1e-13)


def test_banded_form_solves_the_dense_system(elements, dense):
    band = BlockTridiagonal.from_elements(elements, 5).banded()
    b = np.arange(18.0)
    np.testing.assert_allclose(solveh_banded(band, b, lower=True), np.linalg.solve(dense, b), rtol=1e-11)
    assert cholesky_banded(band, lower=True).shape == (6, 18)


def test_pinned_dofs_lose_rows_and_columns_and_keep_the_unit(elements, dense):
    dofs = np.zeros((6, 3), dtype=bool)
    dofs[0, 1] = dofs[3, 2] = dofs[5, 0] = True
    flat = dofs.ravel()
    expected = dense.copy()
    expected[flat] = 0.0
    expected[:, flat] = 0.0
    expected[flat, flat] = 1.0
    pinned = BlockTridiagonal.from_elements(elements, 5).pinned(dofs, unit=1.0)
    np.testing.assert_allclose(pinned.to_csc().toarray(), expected, rtol=1e-14)


def test_sums_and_multiples_are_those_of_the_matrices(elements, dense):
    a = BlockTridiagonal.from_elements(elements, 5)
    np.testing.assert_allclose((a + 2.0 * a * 0.25).to_csc().toarray(), 1.5 * dense, rtol=1e-14)
