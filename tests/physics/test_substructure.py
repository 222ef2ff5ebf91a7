"""Matrices from files come in one order of rows, in SI, and with the rail's deflection down and theta = dw/dx."""

from pathlib import Path

import numpy as np
import pytest
from matrix_writers import labels_of, write_abaqus, write_harwell_boeing, write_mapping
from scipy import io as scipy_io
from scipy import sparse

from tbatch.physics.substructure.file_matrix import FileMatrix
from tbatch.physics.substructure.node_map import NodeMap, read_node_map
from tbatch.physics.substructure.substructure import Substructure
from tbatch.physics.track import Track

PARAMETERS = Track.slab("seed-slab", length=3.25).parameters
assert PARAMETERS is not None
M, C, K = (matrix.to_csc() for matrix in PARAMETERS.matrices(5, 1))  # type: ignore[call-arg]
SIZE, DOFS = K.shape[0], 6
LABELS = labels_of(SIZE, DOFS)
X = [0.65 * node for node in range(6)]


def node_map(heading: str, row: str) -> NodeMap:
    lines = [
        row.format(x=x, mm=650 * node, w=6 * node + 1, theta=6 * node + 2, node=101 + node) for node, x in enumerate(X)
    ]
    return read_node_map("\n".join([heading, *lines]), "rail.csv")


BY_ROW = node_map("x [m],w_row [from 1],theta_row [from 1]", "{x},{w},{theta}")


def combined(scale: np.ndarray | float = 1.0, factor: float = 1.0, nodes: NodeMap = BY_ROW, **options) -> Substructure:
    """The slab track as a model with other signs or units would have it, brought back."""
    turn = sparse.diags(np.ones(SIZE) * scale)
    turned = [FileMatrix("file", sparse.csc_matrix(factor * (turn @ matrix @ turn))) for matrix in (M, C, K)]
    return Substructure.combine(*turned, nodes, **options)


def same(found: Substructure) -> None:
    for matrix, wanted in ((found.mass, M), (found.damping, C), (found.stiffness, K)):
        assert abs(matrix - wanted).max() <= 1e-15 * abs(wanted).max()
        assert matrix.format == "csc"


def rail(w: float, theta: float) -> np.ndarray:
    """Factors of the rail's dofs, 1 for the others."""
    scale = np.ones(SIZE)
    scale[0::DOFS], scale[1::DOFS] = w, theta
    return scale


def test_matrices_in_tbatch_s_own_terms_stay_as_they_are() -> None:
    found = combined()
    same(found)
    assert found.rail_x.tolist() == X
    assert found.rail_w.tolist() == list(range(0, SIZE, 6))


@pytest.mark.parametrize(("w", "theta"), [(-1, 1), (1, -1), (-1, -1)])
def test_signs_bring_the_rail_to_w_down_and_theta_dw_dx(w: int, theta: int) -> None:
    """A model with z up along x has w = -uz and dw/dx = +roty; one with y up, w = -uy and dw/dx = -rotz."""
    heading = "x [m],w_row [from 1],theta_row [from 1],w_sign,theta_sign"
    nodes = node_map(heading, f"{{x}},{{w}},{{theta}},{w},{theta}")
    same(combined(rail(w, theta), nodes=nodes))


@pytest.mark.parametrize(("w", "theta"), [(1, -1), (-1, 1)])
def test_signs_that_contradict_the_stiffness_are_refused(w: int, theta: int) -> None:
    heading = "x [m],w_row [from 1],theta_row [from 1],w_sign,theta_sign"
    nodes = node_map(heading, f"{{x}},{{w}},{{theta}},{w},{theta}")
    with pytest.raises(ValueError, match=r"rail.csv: the signs make the rotations -dw/dx"):
        combined(nodes=nodes)


def test_millimetres_and_tonnes_become_metres_and_kilograms() -> None:
    """With all translations in mm the energies in mJ are the same: K in N/mm is K/1000, K in N mm is 1000 K."""
    to_mm = np.ones(SIZE)
    to_mm[0::DOFS] = 1e-3
    same(combined(to_mm, 1e3, units="mm-t-s"))
    # the model's inner dofs keep their unit of length, which nothing outside it meets
    inner = to_mm.copy()
    inner[2::DOFS] = 1e-3
    found = combined(inner, 1e3, units="mm-t-s")
    solved, wanted = (np.linalg.solve(A.toarray(), np.eye(SIZE)[:, 0:1]) for A in (found.stiffness, K))
    assert solved[0::DOFS] == pytest.approx(wanted[0::DOFS], rel=1e-9)
    with pytest.raises(ValueError, match="units = 'inches': must be one of"):
        combined(units="inches")


def test_files_with_labels_are_joined_by_them(tmp_path: Path) -> None:
    """The mass lists its rows in another order, and no dofs without mass."""
    shuffled = np.random.default_rng(5).permutation(SIZE)
    write_abaqus(tmp_path / "K.mtx", K, LABELS)
    write_abaqus(tmp_path / "M.mtx", M[shuffled][:, shuffled], [LABELS[at] for at in shuffled], half="upper")
    (tmp_path / "C.mtx").write_text("101,3, 101,3, 7.0\n")
    nodes = "node,x [mm],w_dof,theta_dof\n" + "".join(f"{101 + n},{650 * n},1,UY\n" for n in range(6))
    (tmp_path / "rail.csv").write_text(nodes)
    found = Substructure.read(
        mass=tmp_path / "M.mtx", damping=tmp_path / "C.mtx", stiffness=tmp_path / "K.mtx", nodes=tmp_path / "rail.csv"
    )
    assert found.labels == tuple(LABELS)
    assert abs(found.mass - M).max() <= 1e-14 * abs(M).max()
    assert abs(found.stiffness - K).max() <= 1e-14 * abs(K).max()
    assert found.damping.nnz == 1 and found.damping[2, 2] == 7.0


def test_an_ansys_mapping_gives_harwell_boeing_its_labels(tmp_path: Path) -> None:
    shuffled = np.random.default_rng(6).permutation(SIZE)
    for name, matrix in (("M", M), ("K", K)):
        write_harwell_boeing(tmp_path / name, matrix[shuffled][:, shuffled])
    write_mapping(tmp_path / "K.mapping", [LABELS[at] for at in shuffled])
    (tmp_path / "rail.csv").write_text("node,x [m],w_dof\n" + "".join(f"{101 + n},{0.65 * n},UX\n" for n in range(6)))
    files = {"mass": tmp_path / "M", "stiffness": tmp_path / "K", "nodes": tmp_path / "rail.csv"}
    found = Substructure.read(**files, mapping=tmp_path / "K.mapping")
    assert found.rail_theta is None and found.labels == tuple(LABELS)
    assert abs(found.stiffness - K).max() <= 1e-15 * abs(K).max()
    write_mapping(tmp_path / "K.mapping", LABELS[:-1])
    with pytest.raises(ValueError, match=f"{SIZE} rows, but the mapping has {SIZE - 1} equations"):
        Substructure.read(**files, mapping=tmp_path / "K.mapping")


def test_files_of_one_kind_alone_go_together(tmp_path: Path) -> None:
    write_abaqus(tmp_path / "K.mtx", K, LABELS)
    scipy_io.mmwrite(tmp_path / "M.mtx", M)
    (tmp_path / "rail.csv").write_text("node,x [m],w_dof\n101,0,1\n102,0.65,1\n")
    files = {"stiffness": tmp_path / "K.mtx", "nodes": tmp_path / "rail.csv"}
    with pytest.raises(ValueError, match=r"M.mtx: has rows without node and dof, but .*K.mtx has them; give all alike"):
        Substructure.read(mass=tmp_path / "M.mtx", **files)


def test_matrices_of_different_sizes_are_refused_and_unstated_ones_filled() -> None:
    whole, part = FileMatrix("K.mtx", K), FileMatrix("M.mtx", M[:10][:, :10])
    with pytest.raises(ValueError, match=rf"M.mtx: 10 rows, but K.mtx has {SIZE}"):
        Substructure.combine(part, None, whole, BY_ROW)
    found = Substructure.combine(FileMatrix("M.mtx", part.matrix, stated=False), None, whole, BY_ROW)
    assert found.mass.shape == K.shape


def test_an_offset_moves_the_rail() -> None:
    assert combined(offset=-3.25).rail_x == pytest.approx(np.array(X) - 3.25, abs=1e-15)
