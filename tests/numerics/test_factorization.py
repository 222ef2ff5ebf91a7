"""Block factors and their tables equal what SciPy's sparse and banded solvers say of the same matrices."""

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from scipy.sparse.linalg import splu

from tbatch.numerics.factorization import COLUMN_TOLERANCE, BlockFactor, FactorisedTrack, factorise
from tbatch.numerics.pattern import Rows, Stencil, classify
from tbatch.numerics.two_step import EQUAL_SPLITTING, TwoStep, effective
from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.track import Track

TRACKS = {
    "slab": Track.slab("seed-slab", length=26.0),
    "fine slab": Track.slab("seed-slab", length=13.0, elements_per_bay=4, rayleigh=(0.5, 1e-5)),
    "winkler": Track.winkler("koh-winkler", length=20.0, elements=40),
    "beam": Track.beam(length=20.0, elements=10, EI=2e9, mass=2000.0, rayleigh=(0.5, 1e-5)),
}
SCHEMES = [TwoStep(1e-4), TwoStep(1e-3, 0.5), TwoStep(1e-4, 0.4)]


@pytest.fixture(params=TRACKS)
def track(request):
    return TRACKS[request.param]


@pytest.fixture(params=SCHEMES, ids=lambda scheme: f"{scheme.step:g}-{scheme.splitting:.2f}")
def scheme(request):
    return request.param


def matrix(track: Track, rate: float) -> BlockTridiagonal:
    """K̂ with ones at the pinned dofs."""
    return effective(track.stiffness, track.damping, track.mass, rate).pinned(track.pinned, unit=1.0)


def loads(track: Track, count: int = 3) -> np.ndarray:
    """Random loads on the free dofs, shape (node, dof, load)."""
    random = np.random.default_rng(1)
    return random.standard_normal((track.node_count, track.node_dofs, count)) * ~track.pinned[:, :, None]


def dense_inverse(track: Track, rate: float) -> np.ndarray:
    """(K̂⁻¹), zero in the rows and columns of pinned dofs."""
    inverse = np.linalg.inv(matrix(track, rate).to_csc().toarray())
    held = track.pinned.ravel()
    inverse[held] = 0.0
    inverse[:, held] = 0.0
    return inverse


def test_solutions_are_those_of_a_banded_and_a_sparse_solver(track, scheme):
    for rate, factor in zip(scheme.rates, factorise(track, scheme).factors, strict=True):
        b = loads(track)
        x = factor.solve(b)
        flat = b.reshape(-1, b.shape[2])
        banded = solveh_banded(matrix(track, rate).banded(), flat, lower=True).reshape(b.shape)
        sparse = splu(matrix(track, rate).to_csc()).solve(flat).reshape(b.shape)
        # K̂ is dominated by c² M: its condition is that of the mass matrix, w beside θ scaled by the element's length.
        scale = np.abs(banded).max()
        np.testing.assert_allclose(x, banded, rtol=0.0, atol=1e-11 * scale)
        np.testing.assert_allclose(x, sparse, rtol=0.0, atol=1e-11 * scale)
        residual = matrix(track, rate).dot(x) - b
        np.testing.assert_allclose(residual, 0.0, atol=1e-10 * np.abs(b).max())


def test_pinned_dofs_stay_where_they_are(track, scheme):
    for factor in factorise(track, scheme).factors:
        x = factor.solve(np.ones((track.node_count, track.node_dofs)))
        assert (x[track.pinned] == 0.0).all()
        assert (x[track.free] != 0.0).all()
        for block in factor.inverse_band((0, 1), 0.0):
            nodes = len(block)
            offset = track.node_count - nodes
            assert (block[track.pinned[:nodes]] == 0.0).all()
            assert (block.swapaxes(1, 2)[track.pinned[offset:]] == 0.0).all()


def test_one_load_has_the_same_bits_alone_and_among_others(track):
    factor = factorise(track, SCHEMES[0]).factors[0]
    b = loads(track, 5)
    together = factor.solve(b)
    for number in range(5):
        np.testing.assert_array_equal(factor.solve(b[:, :, number].copy()), together[:, :, number])


def test_the_static_stiffness_is_factorised_too(track):
    factor = BlockFactor.of(track.stiffness.diagonal, track.stiffness.lower, track.pinned)
    b = loads(track, 1)
    pinned = track.stiffness.pinned(track.pinned, unit=1.0)
    expected = splu(pinned.to_csc()).solve(b.reshape(-1, 1)).reshape(b.shape)
    # The condition of K is some 1e6.
    np.testing.assert_allclose(factor.solve(b), expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("tolerance", [0.0, 1e-12, 1e-6])
def test_the_inverse_s_blocks_are_those_of_the_dense_inverse(track, scheme, tolerance):
    m = track.node_dofs
    for rate, factor in zip(scheme.rates, factorise(track, scheme).factors, strict=True):
        inverse = dense_inverse(track, rate).reshape(track.node_count, m, track.node_count, m)
        band = factor.inverse_band((0, 1), tolerance)
        largest = np.abs(inverse[:, :2, :, :2]).max()
        for offset, blocks in enumerate(band):
            nodes = np.arange(track.node_count - offset)
            np.testing.assert_allclose(blocks, inverse[nodes, :, nodes + offset], rtol=0.0, atol=1e-11 * largest)
        # What is left out is small where it would be used: in the rows and columns of the rail.
        for offset in range(len(band), track.node_count):
            nodes = np.arange(track.node_count - offset)
            dropped = inverse[nodes, :, nodes + offset]
            used = max(np.abs(dropped[:, :2]).max(), np.abs(dropped[:, :, :2]).max())
            assert used <= (2.0 * tolerance + 1e-11) * largest
        if tolerance == 1e-6 and track.kind == "slab":
            assert len(band) < track.node_count / 2


def sparse_of(factorised: FactorisedTrack, rate: int, stencil: Stencil) -> np.ndarray:
    """The dense matrix that a stencil's table stands for."""
    m, nodes = factorised.node_dofs, len(factorised.node_class)
    dense = np.zeros((nodes, m, nodes, m))
    table = factorised.rows[rate][factorised.node_class]
    for blocks, step in ((stencil.own, 0), (stencil.previous, -1), (stencil.following, 1)):
        for row, entries in enumerate(blocks):
            for place, column in entries:
                for node in range(max(0, -step), nodes - max(0, step)):
                    dense[node, row, node + step, column] += table[node, place]
    return dense.reshape(nodes * m, nodes * m)


def blocks_of(factorised: FactorisedTrack, rate: int, rows: Rows) -> np.ndarray:
    """The blocks that a pattern's table stands for, shape (node, dof, dof)."""
    m, nodes = factorised.node_dofs, len(factorised.node_class)
    table = factorised.rows[rate][factorised.node_class]
    blocks = np.zeros((nodes, m, m))
    for row, entries in enumerate(rows):
        for place, column in entries:
            blocks[:, row, column] = table[:, place]
    return blocks


def test_the_tables_of_the_products_are_the_track_s_matrices(track, scheme):
    factorised = factorise(track, scheme)
    for rate in range(len(scheme.rates)):
        for stencil, factor, part in (
            (factorised.pattern.mass, 1.0, track.mass),
            (factorised.pattern.damping, -1.0, track.damping),
        ):
            expected = factor * part.to_csc().toarray()
            # Nodes share a class where they differ by round-off only.
            np.testing.assert_allclose(
                sparse_of(factorised, rate, stencil), expected, rtol=0.0, atol=1e-14 * np.abs(expected).max()
            )


def test_the_tables_of_the_sweeps_are_the_factor_s_blocks(track, scheme):
    factorised = factorise(track, scheme)
    for rate, factor in enumerate(factorised.factors):
        for rows, expected in (
            (factorised.pattern.lower, -factor.lower),
            (factorised.pattern.pivot, factor.pivot),
            (factorised.pattern.back, -factor.back),
        ):
            scale = np.abs(expected).max(axis=0)
            difference = np.abs(blocks_of(factorised, rate, rows) - expected)
            assert (difference <= 1e-14 * scale).all()


def test_the_columns_are_those_of_the_dense_inverse(track, scheme):
    factorised, m = factorise(track, scheme), track.node_dofs
    for rate, number in enumerate(scheme.rates):
        inverse = dense_inverse(track, number)
        # Blocks are cut where they fall below the tolerance, of the largest entry.
        allowed = (1e-11 + 3.0 * COLUMN_TOLERANCE) * np.abs(inverse).max()
        for element in range(track.element_count):
            columns = factorised.columns[rate, factorised.element_class[element]]
            first = factorised.window_start[element]
            rows = np.arange(first, first + factorised.window_rows)
            dofs = element * m + np.array([0, 1, m, m + 1])
            np.testing.assert_allclose(columns, inverse[np.ix_(rows, dofs)], rtol=0.0, atol=allowed)
            assert np.abs(np.delete(inverse[:, dofs], rows, axis=0)).max(initial=0.0) <= allowed


def test_windows_hold_their_element_and_stay_on_the_track(track, scheme):
    factorised, m = factorise(track, scheme), track.node_dofs
    for element, first in enumerate(factorised.window_start):
        assert first % m == 0
        assert 0 <= first <= element * m
        assert (element + 2) * m <= first + factorised.window_rows <= track.node_count * m


def test_equal_substeps_share_one_table(track):
    assert len(factorise(track, TwoStep(1e-4, EQUAL_SPLITTING)).rows) == 1
    assert len(factorise(track, TwoStep(1e-4, 0.5)).rows) == 2


def test_a_periodic_track_has_few_classes_however_long():
    short, long = (factorise(Track.slab("seed-slab", length=length), TwoStep(1e-4)) for length in (65.0, 195.0))
    assert len(long.node_class) > 2.9 * len(short.node_class)
    # The elimination settles within some bays of the ends; beyond, all nodes are one class.
    for factorised in (short, long):
        assert factorised.rows.shape[1] < 60
        assert factorised.columns.shape[1] < 90
    assert long.rows.shape[1] <= short.rows.shape[1] + 2
    assert long.columns.shape[1] <= short.columns.shape[1] + 2
    middle = long.node_class[100:200]
    assert (middle == middle[0]).all()
    per_bay = factorise(Track.slab("seed-slab", length=65.0, elements_per_bay=4), TwoStep(1e-4))
    assert len(set(per_bay.node_class[160:240].tolist())) == 4


def test_classes_join_equal_lines_only():
    lines = np.array([[1.0, 2.0], [1.0 + 1e-16, 2.0], [1.0 + 1e-9, 2.0], [1.0, -2.0], [1.0, 2.0]])
    item_class, first = classify(lines, np.array([1.0, 2.0]))
    assert item_class.tolist() == [0, 0, 1, 2, 0]
    assert first.tolist() == [0, 2, 3]


def test_a_loose_track_is_refused_by_its_node():
    beam = TRACKS["beam"]
    # Its pinned dofs have no stiffness of their own.
    with pytest.raises(ValueError, match=r"not positive definite at node 0: a dof is loose"):
        BlockFactor.of(beam.stiffness.diagonal, beam.stiffness.lower, np.zeros_like(beam.pinned))
    cut = beam.stiffness.diagonal.copy()
    cut[4, 0, 0] = 0.0
    with pytest.raises(ValueError, match=r"at node 4"):
        BlockFactor.of(cut, beam.stiffness.lower, beam.pinned)


def test_a_rigid_track_has_empty_tables():
    for splitting, rates in ((EQUAL_SPLITTING, 1), (0.5, 2)):
        factorised = factorise(Track.rigid(length=10.0), TwoStep(1e-4, splitting))
        assert factorised.node_dofs == 0
        assert factorised.factors == ()
        assert len(factorised.rows) == len(factorised.columns) == rates
