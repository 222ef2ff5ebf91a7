"""What matrices and node maps are refused for, and what is taken out of them."""

from dataclasses import replace

import numpy as np
import pytest
from finite_elements import Export, exported, sleeper_track
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import block_diag, coo_array, csc_array

from tbatch import Track
from tbatch.physics.imported.checks import MatrixError

X = np.array([0.0, 0.6, 1.2, 1.7])
SIZE = 12


def export() -> Export:
    """Four rail nodes on sleepers: rows 0-7 the rail, 8-11 the sleepers."""
    return sleeper_track(X)


def changed(name: str, row: int, column: int, value: float, *, mirrored: bool = True) -> Export:
    """The track with another entry."""
    whole = export()
    matrix = getattr(whole, name).toarray()
    matrix[row, column] = value
    if mirrored:
        matrix[column, row] = value
    return replace(whole, **{name: csc_array(matrix)})


def zero_diagonal(name: str) -> Export:
    """A row that only couples, as that of a Lagrange multiplier."""
    whole = export()
    matrices = {part: csc_array(block_diag([getattr(whole, part), np.zeros((1, 1))])) for part in
                ("mass", "damping", "stiffness")}  # fmt: skip
    entries = matrices[name].tolil()
    entries[12, 2], entries[2, 12] = 1.0, 1.0
    return replace(whole, **(matrices | {name: csc_array(entries)}))


def loose() -> Export:
    """A rail on nothing."""
    whole = export()
    rows = np.arange(8)
    return replace(whole.kept(rows), stiffness=csc_array(_rail_alone()))


def _rail_alone() -> np.ndarray:
    stiffness = export().stiffness.toarray()[:8, :8]
    stiffness[whole_w(), whole_w()] -= 8e7
    return stiffness


def whole_w() -> np.ndarray:
    """Rows of the rail's vertical dofs."""
    return 2 * np.arange(4)


REFUSED = {
    "not square": (lambda: replace(export(), mass=csc_array(np.ones((3, 4)))), "track.mass has shape (3, 4): must be"),
    "another size": (
        lambda: replace(export(), damping=csc_array(np.eye(3))),
        "track.damping has shape (3, 3): must be (12, 12) like the mass",
    ),
    "not finite": (lambda: changed("stiffness", 4, 2, np.nan), "track.stiffness[4, 2] = nan: must be finite"),
    "not symmetric": (
        lambda: changed("stiffness", 10, 4, -8.1e7, mirrored=False),
        "track.stiffness is not symmetric: [4, 10] = -80000000.0 but [10, 4] = -81000000.0",
    ),
    "one triangle": (
        lambda: export().mapped(lambda part: csc_array(np.tril(part.toarray()))),
        "on one side of its diagonal only: mirror them",
    ),
    "negative mass": (lambda: changed("mass", 9, 9, -150.0), "track.mass[9, 9] = -150.0: must be 0 or more [kg or kg"),
    "mass without a diagonal": (lambda: zero_diagonal("mass"), "track.mass[2, 12] = 1.0 is larger than its diagonal"),
    "a motion of negative mass": (lambda: changed("mass", 8, 9, 151.0), "track.mass[8, 9] = 151.0 is larger than"),
    "a motion of three rows": (
        lambda: replace(
            export(),
            mass=export().mass - csc_array(np.pad(np.ones((3, 3)) - np.eye(3), ((8, 1), (8, 1)))) * 140.0,
        ),
        "has a negative mass",
    ),
    "negative damper": (
        lambda: changed("damping", 11, 11, -1.0),
        "track.damping[11, 11] = -1.0: must be 0 or more [N s/m",
    ),
    "no stiffness": (lambda: changed("stiffness", 9, 9, 0.0), "track.stiffness[9, 9] = 0.0: must be above 0 on free"),
    "negative spring": (lambda: changed("stiffness", 9, 9, -1.0), "track.stiffness[9, 9] = -1.0: must be above 0"),
    "Lagrange multiplier": (lambda: zero_diagonal("stiffness"), "Eliminate constraints before the export"),
    "indefinite": (
        lambda: changed("stiffness", 9, 2, 1e9),
        "constraint equations must be eliminated before the export",
    ),
    "not held": (loose, "is not held: support the track, or export the free dofs"),
    "one rail node": (lambda: replace(export(), x=X[:1], w=[0], theta=[1]), "at least two nodes"),
    "node twice": (lambda: replace(export(), x=np.array([0.0, 0.6, 0.6, 1.7])), "track.rail_x = 0.6 m twice"),
    "node without a row": (
        lambda: replace(export(), w=[0, 2, 4]),
        "track.rail_w: 4 whole numbers are required, one for each of rail_x",
    ),
    "row too far": (lambda: replace(export(), w=[0, 2, 4, 12]), "track.rail_w[3] = 12: must be a row from 0 to 11"),
    "row counted from 1 and more": (lambda: replace(export(), theta=[1, 3, 5, -2]), "track.rail_theta[3] = -2"),
    "row twice": (lambda: replace(export(), theta=[1, 3, 5, 4]), "track.rail_theta[3] = 4: already taken by "
                                                                "track.rail_w[2]"),
    "no node moves": (lambda: replace(export(), w=[-1, -1, -1, -1]), "every rail node is held"),
    "rotations of solid elements": (
        lambda: export().mapped(lambda part: _without(part, [1, 3, 5, 7])),
        "has rail_theta = None",
    ),
    "EI without rotations": (lambda: replace(export(), theta=None, EI=6.4e6), "which need rail_theta"),
    "EI of no beam": (lambda: replace(export(), EI=-1.0), "track.rail_EI = -1.0: must be above 0 [N m2]"),
    "complex": (lambda: export().mapped(lambda part: part * 1j), "track.mass holds complex128 numbers: must be real"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_is_named_with_its_entry(case):
    make, message = REFUSED[case]
    with pytest.raises(ValueError) as error:
        make().track()
    assert message in str(error.value)


def test_an_error_of_a_matrix_says_which():
    with pytest.raises(MatrixError) as error:
        changed("damping", 11, 11, -1.0).track()
    assert (error.value.matrix, error.value.row) == ("damping", 11)


def test_what_rounding_leaves_is_accepted():
    track = changed("stiffness", 10, 4, -8e7 * (1.0 + 1e-8), mirrored=False).track()
    entries = track.stiffness.entries
    assert abs(entries - entries.T).max() == 0.0


def test_dense_lists_and_any_sparse_form_are_one():
    whole = export()
    tracks = [
        Track.from_matrices(*(make(part) for part in whole.matrices), rail_x=X, rail_w=whole.w, rail_theta=whole.theta)
        for make in (lambda part: part.toarray().tolist(), lambda part: part.toarray(), coo_array, lambda part: part)
    ]
    for track in tracks[1:]:
        np.testing.assert_array_equal(track.stiffness.entries.toarray(), tracks[0].stiffness.entries.toarray())


def back(track: Track, size: int) -> list[np.ndarray]:
    """M, C and K of a track in the order of the given rows, zero where a row is not stepped."""
    given_row = track.imported.given_row
    held = given_row >= 0
    result = []
    for part in (track.mass, track.damping, track.stiffness):
        whole = np.zeros((size, size))
        whole[np.ix_(given_row[held], given_row[held])] = part.entries.toarray()[np.ix_(held, held)]
        result.append(whole)
    return result


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31))
def test_rows_in_any_order_are_stepped_with_the_rail_where_it_was(seed):
    shuffled = export().shuffled(seed)
    track = shuffled.track()
    for given_matrix, stepped in zip(shuffled.matrices, back(track, SIZE), strict=True):
        np.testing.assert_array_equal(stepped, given_matrix.toarray())
    rail = track.imported.rail
    np.testing.assert_array_equal(rail.x, X)
    order = np.argsort(shuffled.x)
    np.testing.assert_array_equal(track.imported.given_row[rail.row], shuffled.w[order])
    np.testing.assert_array_equal(track.imported.given_row[rail.row + 1], shuffled.theta[order])


def test_an_empty_row_and_a_penalty_are_supports():
    whole = export()
    clean = whole.kept(np.setdiff1d(np.arange(SIZE), [3, 9])).track()
    supports = [
        whole.mapped(lambda part: _without(part, [3, 9])),
        replace(whole, stiffness=whole.stiffness + csc_array(_at([3, 9], 1e36))),
    ]
    for support in supports:
        track = support.track()
        assert track.imported.held_count == 2
        assert "12 given, 10 stepped, 2 held" in str(track.describe_rows())
        np.testing.assert_array_equal(track.stiffness.entries.toarray(), clean.stiffness.entries.toarray())
        np.testing.assert_array_equal(track.pinned, clean.pinned)


def test_rows_that_the_rail_never_moves_are_left_out_unheld_or_not():
    whole = export()
    # Lateral dofs: a chain of two masses that nothing holds, in front of the others.
    ahead = {"mass": np.eye(2), "damping": np.zeros((2, 2)), "stiffness": np.array([[1.0, -1.0], [-1.0, 1.0]])}
    joined = {name: csc_array(block_diag([part, getattr(whole, name)])) for name, part in ahead.items()}
    track = replace(whole, **joined, w=whole.w + 2, theta=whole.theta + 2).track()
    assert track.imported.apart_count == 2
    np.testing.assert_array_equal(track.stiffness.entries.toarray(), whole.track().stiffness.entries.toarray())


def test_rotations_about_the_other_way_are_turned_round():
    whole = export()
    sign = np.ones(SIZE)
    sign[whole.theta] = -1.0
    track = whole.mapped(lambda part: csc_array(np.diag(sign) @ part.toarray() @ np.diag(sign))).track()
    assert "-dw/dx" in str(track.describe_rows())
    np.testing.assert_array_equal(track.stiffness.entries.toarray(), whole.track().stiffness.entries.toarray())


def test_the_factor_of_a_long_track_stays_a_band():
    slab = exported(Track.slab("seed-slab", length=65.0, elements_per_bay=2)).shuffled(7).track()
    from tbatch.numerics.factorization import factorise
    from tbatch.numerics.two_step import TwoStep

    factor = factorise(slab, TwoStep(1e-4)).factors[0]
    # The node-by-node band of six dofs has eleven entries a row below the diagonal.
    assert factor.lower.nnz < 11 * slab.node_count


def _without(part: csc_array, rows: list[int]) -> np.ndarray:
    matrix = part.toarray()
    matrix[rows] = matrix[:, rows] = 0.0
    return matrix


def _at(rows: list[int], value: float) -> np.ndarray:
    diagonal = np.zeros(SIZE)
    diagonal[rows] = value
    return np.diag(diagonal)
