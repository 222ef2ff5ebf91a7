"""Whatever bytes a file has, reading it ends in a matrix or in one ValueError of one line that names the file."""

import io
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from matrix_writers import labels_of, write_abaqus, write_dmig, write_harwell_boeing, write_mapping
from scipy import io as scipy_io
from scipy import sparse

from tbatch.physics.substructure.ansys_mapping import read_mapping
from tbatch.physics.substructure.file_matrix import FileMatrix
from tbatch.physics.substructure.node_map import read_node_map
from tbatch.physics.substructure.reading import read_matrix, text_of

SMALL = sparse.csc_matrix(np.array([[4.0, -1.0, 0.0], [-1.0, 4.0, -2.5e-7], [0.0, -2.5e-7, 1e12]]))
LABELS = labels_of(3, 2)
NODES = b"node,x [mm],w_dof,theta_dof,w_sign\n101,0,1,2,-1\n102,650,UX,held,-1\n"


WORDS = "9 99999999 -1 0 nan inf 1e999 1.5D+999 . , ; # * ** %% ( ) \n \r \0 é ² RSA RUE (3E5) (9999I1)"
PIECES = [word.encode("latin-1") for word in WORDS.split(" ")]
PIECES += [b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\x00\x00\x00\x00", b"\n\n", b" "]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A sound file of each format."""
    folder = tmp_path_factory.mktemp("sound")
    scipy_io.mmwrite(folder / "symmetric.mtx", SMALL, symmetry="symmetric")
    scipy_io.mmwrite(folder / "array.mtx", SMALL.toarray())
    sparse.save_npz(folder / "packed.npz", SMALL)
    sparse.save_npz(folder / "plain.npz", SMALL, compressed=False)
    write_abaqus(folder / "labels.mtx", SMALL, LABELS)
    write_abaqus(folder / "rows.mtx", SMALL)
    write_harwell_boeing(folder / "rsa.matrix", SMALL, style="1PD", right_hand_sides=True)
    write_harwell_boeing(folder / "rua.matrix", SMALL, kind="RUA")
    if find_spec("pyyeti"):
        from pyyeti.nastran import op4

        write_dmig(folder / "K.pch", SMALL, LABELS)
        for layout in ("dense", "bigmat", "nonbigmat"):
            for binary in (True, False):
                op4.write(str(folder / f"{layout}{binary}.op4"), {"K": SMALL.toarray()}, binary=binary, sparse=layout)
    write_mapping(folder / "K.mapping", LABELS)
    (folder / "rail.csv").write_bytes(NODES)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def ends_well(path: Path) -> bool:
    """Whether a file was read; anything but a matrix and a ValueError of one line fails."""
    try:
        if path.suffix == ".csv":
            read_node_map(text_of(path.read_bytes()), str(path)).rows(FileMatrix("K", SMALL, tuple(LABELS)))
        elif path.suffix == ".mapping":
            read_mapping(text_of(path.read_bytes()), str(path))
        else:
            read = read_matrix(path)
            assert read.matrix.shape == (read.size, read.size)
            assert read.labels is None or len(read.labels) == read.size
            assert np.isfinite(read.matrix.data).all()
            read.matrix.sum()
    except ValueError as error:
        assert type(error) is ValueError
        assert str(error).startswith(str(path)) and "\n" not in str(error)
        return False
    return True


def test_sound_files_are_read(files: dict[str, bytes], tmp_path: Path) -> None:
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        assert ends_well(tmp_path / name), name


def test_every_truncation_ends_well(files: dict[str, bytes], tmp_path: Path) -> None:
    for name, content in files.items():
        path = tmp_path / name
        step = max(1, len(content) // 120)
        for length in range(0, len(content), step):
            path.write_bytes(content[:length])
            ends_well(path)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_garbled_files_end_well(files: dict[str, bytes], tmp_path: Path, data: st.DataObject) -> None:
    """Some bytes are changed, taken out or put in; those that formats give meaning to more often than others."""
    name = data.draw(st.sampled_from(sorted(files)))
    content = bytearray(files[name])
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        stop = start + data.draw(st.integers(0, 6))
        new = data.draw(st.binary(max_size=4) | st.sampled_from(PIECES))
        content[start:stop] = new
    path = tmp_path / name
    path.write_bytes(bytes(content))
    ends_well(path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=300), name=st.sampled_from(["a.mtx", "a.matrix", "a.npz", "a.csv", "a.mapping"]))
@example(b"%%MatrixMarket matrix coordinate real general\n5000000 5000000 30\n1 1 1\n", "a.mtx")
@example(b"DMIG    K              0       6       2       0\n", "a.mtx")
def test_any_bytes_end_well(tmp_path: Path, content: bytes, name: str) -> None:
    (tmp_path / name).write_bytes(content)
    ends_well(tmp_path / name)


def test_an_npz_that_unpacks_to_something_else_ends_well(tmp_path: Path) -> None:
    one, two = np.ones(1), np.array([2, 2])
    for arrays in (
        {"format": b"csc", "shape": two, "data": np.ones(3), "indices": [0, 1], "indptr": [0, 1, 9]},
        {"format": b"csc", "shape": two, "data": np.ones(2), "indices": [0, -7], "indptr": [0, 1, 2]},
        {"format": b"xyz", "shape": two},
        {"format": b"coo", "shape": -two, "data": one, "row": [0], "col": [0]},
        {"format": b"coo", "shape": two, "data": one, "row": [5], "col": [0]},
        {"format": b"dia", "shape": two, "data": np.ones((1, 2)), "offsets": [0, 0]},
        {"format": b"bsr", "shape": two, "data": np.ones((1, 2, 2)), "indices": [9], "indptr": [0, 1]},
    ):
        stream = io.BytesIO()
        np.savez(stream, **arrays)
        (tmp_path / "a.npz").write_bytes(stream.getvalue())
        assert not ends_well(tmp_path / "a.npz")
