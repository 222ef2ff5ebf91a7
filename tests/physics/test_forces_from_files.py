"""A coach on the slab track has the same contact forces when the track's matrices have been through files.

Two-step on the host: the kernels give the same bits, which the engine's own tests hold.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matrix_writers import labels_of, write_abaqus, write_dmig, write_harwell_boeing, write_mapping
from scipy import io as scipy_io
from scipy import sparse

import tbatch as tb

SLAB = tb.Track.slab("seed-slab", length=32.0)
MATRICES = {"mass": SLAB.mass.to_csc(), "damping": SLAB.damping.to_csc(), "stiffness": SLAB.stiffness.to_csc()}
SIZE, NODES = SLAB.pinned.size, SLAB.node_count
HELD = np.flatnonzero(SLAB.pinned.ravel())
LABELS = labels_of(SIZE, 6)
RELATIVE = 1e-9
"""Of the largest force: at most 17 digits are printed, and a stiffness of 1e9 N/m in 16 digits is 1e-7 N/m off."""


def forces(track: tb.Track) -> np.ndarray:
    rough = tb.Irregularity.cosines([0.5, 1.3], [3e-4, 1e-4], [0.1, 2.0])
    contact = tb.Contact.hertz(wheel_radius=0.4575)
    save = tb.SaveAt(every=1e-4, channels=("contact_force",))
    vehicle = tb.Vehicle.coach("seed-multiwheel")
    return tb.methods.two_step(
        vehicle, track, contact, speed=80.0, irregularity=rough, start=22.0, duration=0.05, step=1e-4, save=save
    ).contact_force


@cache
def expected() -> np.ndarray:
    return forces(SLAB)


def by_row(folder: Path) -> Path:
    lines = [f"{0.65 * node!r},{6 * node + 1},{6 * node + 2}" for node in range(NODES)]
    return written(folder, "x [m],w_row [from 1],theta_row [from 1]", lines)


def written(folder: Path, heading: str, lines: list[str]) -> Path:
    (folder / "rail.csv").write_text("\n".join([heading, *lines]) + "\n")
    return folder / "rail.csv"


def same(folder: Path, suffix: str = "", relative: float = RELATIVE, **options) -> None:
    """Hold the forces of a folder's files against those of the slab track; the node map is rail.csv."""
    files = {name: options.pop(name, folder / f"{name}{suffix}") for name in MATRICES}
    track = tb.Track.from_files(**files, nodes=folder / "rail.csv", rail_EI=SLAB.rail_EI, rails=2, **options)
    found = forces(track)
    assert np.abs(found - expected()).max() <= relative * expected().max()
    assert expected().min() < 0.9 * expected().max()  # the forces do vary


@pytest.mark.parametrize("kind", ["matrix market", "npz", "rows of Abaqus"])
def test_by_rows(tmp_path: Path, kind: str) -> None:
    by_row(tmp_path)
    for name, matrix in MATRICES.items():
        if kind == "npz":
            sparse.save_npz(tmp_path / f"{name}.npz", matrix)
        elif kind == "matrix market":
            scipy_io.mmwrite(tmp_path / f"{name}.mtx", matrix, symmetry="symmetric", precision=17)
        else:
            write_abaqus(tmp_path / f"{name}.mtx", matrix)
    same(tmp_path, ".npz" if kind == "npz" else ".mtx")


def test_abaqus_nodes_in_any_order_with_held_dofs_in_millimetres_and_z_up(tmp_path: Path) -> None:
    """With z up and x along the track, w down is -uz and its slope is the rotation about y: -d(uz)/dx."""
    scale = np.tile([-1e-3, 1.0], SIZE // 2)
    order = np.random.default_rng(8).permutation(SIZE)
    for name, matrix in MATRICES.items():
        model = sparse.csc_matrix(1e3 * sparse.diags(scale) @ matrix @ sparse.diags(scale))[order][:, order]
        held = np.flatnonzero(np.isin(order, HELD)) if name == "stiffness" else ()
        write_abaqus(tmp_path / f"{name}.mtx", model, [LABELS[at] for at in order], held=set(held))
    lines = [f"{101 + node},{650 * node},UX,UY,-1,1" for node in range(NODES)]
    written(tmp_path, "node,x [mm],w_dof,theta_dof,w_sign,theta_sign", lines)
    same(tmp_path, ".mtx", units="mm-t-s")
    # Without signs the stiffness tells that the rotations are -dw/dx of w upwards, and all is turned alike.
    lines = [f"{101 + node},{650 * node},UX,UY" for node in range(NODES)]
    written(tmp_path, "node,x [mm],w_dof,theta_dof", lines)
    same(tmp_path, ".mtx", units="mm-t-s")


@pytest.mark.parametrize(("kind", "style"), [("RSA", "1PE"), ("RUA", "D")])
def test_ansys_equations_without_the_held_dofs(tmp_path: Path, kind: str, style: str) -> None:
    free = np.random.default_rng(9).permutation(np.setdiff1d(np.arange(SIZE), HELD))
    for name, matrix in MATRICES.items():
        write_harwell_boeing(tmp_path / name, matrix[free][:, free], kind=kind, style=style, right_hand_sides=True)
    write_mapping(tmp_path / "K.mapping", [LABELS[at] for at in free])
    ends = (0, NODES - 1)
    lines = [f"{101 + node},{0.65 * node!r},{'held' if node in ends else 'UX'},UY" for node in range(NODES)]
    written(tmp_path, "node,x [m],w_dof,theta_dof", lines)
    same(tmp_path, mapping=tmp_path / "K.mapping")


def test_nastran_output4_and_dmig(tmp_path: Path) -> None:
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    by_row(tmp_path)
    names = {"mass": "MAA", "damping": "BAA", "stiffness": "KAA"}
    for binary in (True, False):
        matrices = {names[name]: matrix.toarray() for name, matrix in MATRICES.items()}
        op4.write(str(tmp_path / "track.op4"), matrices, binary=binary, digits=17)
        same(tmp_path, **{name: f"{tmp_path / 'track.op4'}#{short}" for name, short in names.items()})
    free = np.setdiff1d(np.arange(SIZE), HELD)
    for name, matrix in MATRICES.items():
        part = matrix[free][:, free]
        write_dmig(tmp_path / f"{name}.pch", part, [LABELS[at] for at in free], name=names[name])
    ends = (0, NODES - 1)
    lines = [f"{101 + node},{0.65 * node!r},{'held' if node in ends else 1},2" for node in range(NODES)]
    written(tmp_path, "node,x [m],w_dof,theta_dof", lines)
    # A punch file has ten digits, and bending is the small difference of large entries: 7e-9.
    same(tmp_path, ".pch", relative=1e-7)


def test_rayleigh_damping_is_added_to_that_of_the_file(tmp_path: Path) -> None:
    by_row(tmp_path)
    slab = tb.Track.slab("seed-slab", length=32.0, rayleigh=(2.0, 1e-4))
    for name, matrix in MATRICES.items():
        sparse.save_npz(tmp_path / f"{name}.npz", matrix)
    files = {name: tmp_path / f"{name}.npz" for name in MATRICES}
    track = tb.Track.from_files(**files, nodes=tmp_path / "rail.csv", rayleigh=(2.0, 1e-4))
    assert np.sort(track.damping.to_csc().diagonal())[-20:] == pytest.approx(
        np.sort(slab.damping.to_csc().diagonal())[-20:], rel=1e-12
    )


def test_what_the_matrices_must_be_is_said_of_the_file_and_the_dof(tmp_path: Path) -> None:
    lines = [f"{101 + node},{0.65 * node!r},UX,UY" for node in range(NODES)]
    written(tmp_path, "node,x [m],w_dof,theta_dof", lines)
    wrong = MATRICES["mass"].tolil()
    wrong[14, 14] = -7.0
    for name, matrix in {**MATRICES, "mass": wrong.tocsc()}.items():
        write_abaqus(tmp_path / f"{name}.mtx", matrix, LABELS, held=set(HELD) if name == "stiffness" else ())
    files = {name: tmp_path / f"{name}.mtx" for name in MATRICES}
    with pytest.raises(ValueError) as caught:
        tb.Track.from_files(**files, nodes=tmp_path / "rail.csv")
    said = str(caught.value)
    assert said.startswith(f"{tmp_path / 'mass.mtx'}: track.mass") and "node 103 dof 3 (UZ)" in said
    by_row(tmp_path)
    for name, matrix in {**MATRICES, "stiffness": sparse.tril(MATRICES["stiffness"])}.items():
        sparse.save_npz(tmp_path / f"{name}.npz", sparse.csc_matrix(matrix))
    files = {name: tmp_path / f"{name}.npz" for name in MATRICES}
    with pytest.raises(ValueError, match=r"stiffness.npz: track.stiffness is not symmetric.*row \d+ of the file"):
        tb.Track.from_files(**files, nodes=tmp_path / "rail.csv")
