"""A node map says where the rail is in the matrices; what it says wrongly is refused with its line."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from tbatch.physics.substructure.file_matrix import FileMatrix
from tbatch.physics.substructure.node_map import HELD, read_node_map

ROWS = """\
# the rail of a hand-made model
x [m], w_row [from 1], theta_row [from 1]
0.00, 1, 2
0.65, 3, 4   # a seat
1.30, 5, 6
"""
LABELS = """\
node,x [mm],w_dof,theta_dof,w_sign,theta_sign
11,0,UZ,5,-1,1
12,650,3,ROTY,-1,+1
13,1300,U3,UR2,-1,1
"""
LABELLED = FileMatrix("K.mtx", sparse.csc_matrix((7, 7)), ((-1, 1), *((n, d) for n in (11, 12, 13) for d in (3, 5))))
PLAIN = FileMatrix("K.mtx", sparse.csc_matrix((6, 6)))


def test_rows_are_counted_as_the_heading_says() -> None:
    found = read_node_map(ROWS, "rail.csv")
    assert found.x.tolist() == [0.0, 0.65, 1.3]
    w, theta = found.rows(PLAIN)
    assert theta is not None
    assert (w.tolist(), theta.tolist()) == ([0, 2, 4], [1, 3, 5])
    assert found.w_sign is None and found.theta_sign is None
    from_zero = ROWS.replace("from 1", "from 0").replace("1, 2", "0, 1").replace("3, 4", "2, 3").replace("5, 6", "4, 5")
    assert read_node_map(from_zero, "rail.csv").rows(PLAIN)[0].tolist() == [0, 2, 4]


def test_labels_find_their_rows_by_number_or_name() -> None:
    found = read_node_map(LABELS, "rail.csv")
    assert found.x.tolist() == pytest.approx([0.0, 0.65, 1.3], rel=1e-15)
    w, theta = found.rows(LABELLED)
    assert theta is not None
    assert (w.tolist(), theta.tolist()) == ([1, 3, 5], [2, 4, 6])
    assert found.w_sign is not None and found.theta_sign is not None
    assert (found.w_sign.tolist(), found.theta_sign.tolist()) == ([-1, -1, -1], [1, 1, 1])


def test_semicolons_with_decimal_commas_and_other_column_orders_are_read() -> None:
    text = "W_ROW [from 1]; X [m]\n1; 0,0\n3; 0,65\n"
    found = read_node_map("\ufeff" + text, "rail.csv")
    assert found.theta is None
    assert found.x.tolist() == [0.0, 0.65]
    assert found.rows(PLAIN)[0].tolist() == [0, 2]


def test_a_held_dof_has_no_row() -> None:
    found = read_node_map(ROWS.replace("0.00, 1,", "0.00, held,"), "rail.csv")
    assert found.rows(PLAIN)[0].tolist() == [HELD, 2, 4]
    found = read_node_map(LABELS.replace("11,0,UZ", "11,0,held"), "rail.csv")
    assert found.rows(LABELLED)[0].tolist() == [HELD, 3, 5]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("x [m], ", ""), "line 2: no column x, its position"),
        (("x [m]", "x [ft]"), "line 2: column x [ft]; accepted: x [m]"),
        (("w_row [from 1], ", ""), "line 2: no column w_row, or node and w_dof"),
        (("w_row [from 1]", "w_row"), "line 2: column w_row []; accepted: w_row [from 1] or w_row [from 0]"),
        (("theta_row [from 1]", "w_row [from 1]"), "line 2: column w_row stands there twice"),
        (("theta_row [from 1]", "rotation"), "line 2: column 'rotation'; accepted: x, w_row"),
        (("theta_row [from 1]", "theta_dof"), "line 2: rows and (node, dof) are mixed"),
        (("theta_row [from 1]", "theta_sign"), "line 2: theta_sign without theta_row or theta_dof"),
        (("0.65, 3, 4 ", "0.65, 3"), "line 4: 2 entries; the heading has 3: x, w_row, theta_row"),
        (("0.65", "abc"), "line 4, x: 'abc' is not a finite number [m]"),
        (("0.65", "nan"), "line 4, x: 'nan' is not a finite number [m]"),
        (("0.65", "0.00"), "line 4: x = 0 m does not lie beyond the node before (0 m)"),
        (("3, 4", "3.5, 4"), "line 4, w_row: '3.5' is not a whole number"),
        (("3, 4", "0, 4"), "line 4, w_row: row 0; the heading says that rows count from 1"),
        (("0.65, 3, 4   # a seat\n1.30, 5, 6\n", ""), "1 nodes; at least 2 are needed"),
        ((ROWS, "# nothing\n"), "is empty; accepted: a heading line"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(change: tuple[str, str], said: str) -> None:
    assert change[0] in ROWS
    with pytest.raises(ValueError) as caught:
        read_node_map(ROWS.replace(*change), "rail.csv")
    assert str(caught.value).startswith("rail.csv") and said in str(caught.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("UZ", "Z"), "line 2, w_dof: 'Z'; accepted: 1 to 6, UX to UZ"),
        (("-1,+1", "-1,2"), "line 3, theta_sign: '2'; accepted: 1 (w down, theta = dw/dx) or -1"),
        (("12,", "1x,"), "line 3, node: '1x' is not a whole number"),
    ],
)
def test_what_is_wrong_with_a_label_is_said_with_its_line(change: tuple[str, str], said: str) -> None:
    with pytest.raises(ValueError) as caught:
        read_node_map(LABELS.replace(*change, 1), "rail.csv")
    assert f"rail.csv, {said}" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "matrix", "said"),
    [
        (ROWS.replace("5, 6", "5, 7"), PLAIN, "line 5: theta_row is beyond the 6 rows of K.mtx"),
        (ROWS.replace("5, 6", "5, 3"), PLAIN, "line 5: theta is the row of w of line 4"),
        (ROWS, LABELLED, "line 3: K.mtx knows its rows by node and dof; accepted: node, w_dof in place of w_row"),
        (LABELS, PLAIN, "line 2: K.mtx has rows without node and dof; accepted: w_row [from 1] in place of"),
        (LABELS.replace("12,", "99,"), LABELLED, "line 3: node 99 dof 3 (UZ) is not in K.mtx, nor any other of that"),
        (LABELS.replace("U3", "1"), LABELLED, "line 4: node 13 dof 1 (UX) is not in K.mtx, its dofs there: 3, 5"),
        (LABELS.replace("12,", "11,"), LABELLED, "line 3: w is the row of w of line 2"),
    ],
)
def test_a_map_that_does_not_fit_the_matrices_is_refused(text: str, matrix: FileMatrix, said: str) -> None:
    with pytest.raises(ValueError) as caught:
        read_node_map(text, "rail.csv").rows(matrix)
    assert f"rail.csv, {said}" in str(caught.value)


@pytest.mark.parametrize(
    "heading", ["x, w, theta", "rail_x, rail_w, rail_theta", "x [m], w_row [from 0], theta_row [from 0]"]
)
def test_columns_may_be_named_as_the_arguments_of_from_matrices_with_rows_from_0(heading: str) -> None:
    for node in ("", "node, "):
        number = "7, " if node else ""
        found = read_node_map(f"{node}{heading}\n{number}0.0, 0, 1\n{number}0.65, 2, 3\n", "rail.csv")
        w, theta = found.rows(PLAIN)
        assert found.x.tolist() == [0.0, 0.65]
        assert w.tolist() == [0, 2]
        assert theta is not None and theta.tolist() == [1, 3]


def test_positions_are_exact_in_metres() -> None:
    found = read_node_map("x [m],w_row [from 1]\n0.1,1\n0.7,2\n", "rail.csv")
    assert np.array_equal(found.x, [0.1, 0.7])


def test_the_node_maps_of_the_documentation_are_read() -> None:
    page = (Path(__file__).parents[2] / "docs" / "exporting_matrices.md").read_text(encoding="utf-8")
    blocks = re.findall(r"\n\n((?:    .*,.*\n)+)", page)
    maps = [read_node_map(block, "page") for block in blocks if re.match(r"    (x|node),? ", block)]
    assert [found.x.tolist() for found in maps] == [[0.0, 0.65], [0.0, 0.65, 1.3]]
    assert maps[1].w == ((101, 3), (102, 3), (103, HELD))
