"""A matrix written in any of the formats is read back to the digits that were printed."""

from pathlib import Path

import numpy as np
import pytest
from matrix_writers import (
    labels_of,
    largest_relative,
    write_abaqus,
    write_dmig,
    write_harwell_boeing,
    write_mapping,
)
from scipy import io as scipy_io
from scipy import sparse

from tbatch.physics.substructure.ansys_mapping import read_mapping
from tbatch.physics.substructure.file_matrix import FileMatrix
from tbatch.physics.substructure.fortran_format import FortranFormat
from tbatch.physics.substructure.reading import read_matrix
from tbatch.physics.track import Track

TRACK = Track.slab("seed-slab", length=3.25)
FREE = [matrix.to_csc() for matrix in TRACK.parameters.matrices(5, 1)]  # type: ignore[union-attr]
K = FREE[2]
LABELS = labels_of(K.shape[0], 6)
PRINTED = 1e-15
"""15 digits after the point are printed: half a unit in the last place of the smallest mantissa."""


def shuffled(labels: list[tuple[int, int]]) -> list[tuple[int, int]]:
    return [labels[at] for at in np.random.default_rng(3).permutation(len(labels))]


def by_label(read: FileMatrix, labels: list[tuple[int, int]]) -> sparse.csc_matrix:
    assert read.labels is not None
    at = [read.labels.index(label) for label in labels]
    return read.matrix[at][:, at]


@pytest.mark.parametrize("matrix", FREE, ids=["mass", "damping", "stiffness"])
def test_scipy_writes_matrix_market_and_npz(tmp_path: Path, matrix: sparse.csc_matrix) -> None:
    for symmetry in ("symmetric", "general"):
        scipy_io.mmwrite(tmp_path / "a.mtx", matrix, symmetry=symmetry, precision=17)
        assert largest_relative(read_matrix(tmp_path / "a.mtx").matrix, matrix) <= 1e-16
    scipy_io.mmwrite(tmp_path / "dense.mtx", matrix.toarray(), precision=17)
    assert largest_relative(read_matrix(tmp_path / "dense.mtx").matrix, matrix) <= 1e-16
    for number, form in enumerate((sparse.csc_matrix, sparse.csr_array, sparse.coo_matrix, sparse.bsr_matrix)):
        sparse.save_npz(tmp_path / f"{number}.npz", form(matrix))
        read = read_matrix(tmp_path / f"{number}.npz")
        assert (read.matrix != matrix).nnz == 0
        assert read.matrix.format == "csc" and read.matrix.dtype == np.float64


@pytest.mark.parametrize("half", ["lower", "upper", "full"])
@pytest.mark.parametrize("order", ["rising", "shuffled"])
def test_abaqus_labels_find_their_rows_whatever_half_is_written(tmp_path: Path, half: str, order: str) -> None:
    labels = LABELS if order == "rising" else shuffled(LABELS)
    write_abaqus(tmp_path / "STIF1.mtx", K, labels, half=half)
    read = read_matrix(tmp_path / "STIF1.mtx")
    assert largest_relative(by_label(read, labels), K) <= PRINTED


def test_abaqus_coordinates_keep_their_rows(tmp_path: Path) -> None:
    write_abaqus(tmp_path / "STIF1.mtx", K)
    read = read_matrix(tmp_path / "STIF1.mtx")
    assert read.labels is None and not read.stated
    assert largest_relative(read.matrix, K) <= PRINTED


def test_abaqus_internal_nodes_comments_and_keywords_are_understood(tmp_path: Path) -> None:
    file = tmp_path / "K.mtx"
    file.write_text(
        "** written by hand\n*MATRIX INPUT, NAME=K, TYPE=SYMMETRIC\n"
        "-1,1, -1,1,  3.0e+01\n 7,2, -1,1, -2.5D+01,\n\n7,2, 7,2, 1.000000000000000e+36\n"
    )
    read = read_matrix(file)
    assert read.labels == ((-1, 1), (7, 2))
    assert read.matrix.toarray().tolist() == [[30.0, -25.0], [-25.0, 1e36]]


def test_an_unsymmetric_file_stays_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "K.mtx"
    file.write_text("1, 1, 2.0\n2, 1, 1.0\n1, 2, -1.0\n2, 2, 2.0\n3, 2, 5.0\n3, 3, 1.0\n")
    assert read_matrix(file).matrix.toarray().tolist() == [[2, -1, 0], [1, 2, 0], [0, 5, 1]]


@pytest.mark.parametrize("style", ["E", "D", "1PE", "1PD"])
@pytest.mark.parametrize("kind", ["RSA", "RUA"])
@pytest.mark.parametrize("loaded", [False, True])
def test_harwell_boeing_in_every_number_format(tmp_path: Path, style: str, kind: str, loaded: bool) -> None:
    file = tmp_path / "K.matrix"
    write_harwell_boeing(file, K, kind=kind, style=style, right_hand_sides=loaded)
    assert largest_relative(read_matrix(file).matrix, K) <= 1e-16


def test_harwell_boeing_with_one_number_a_line(tmp_path: Path) -> None:
    write_harwell_boeing(tmp_path / "K.matrix", K, style="D", per_line=1)
    assert largest_relative(read_matrix(tmp_path / "K.matrix").matrix, K) <= 1e-16


def test_scipy_writes_harwell_boeing_too(tmp_path: Path) -> None:
    scipy_io.hb_write(tmp_path / "K.hb", K)
    assert largest_relative(read_matrix(tmp_path / "K.hb").matrix, K) <= 1e-15


def test_a_full_matrix_under_a_symmetric_heading_is_not_doubled(tmp_path: Path) -> None:
    """ANSYS wrote superelements so."""
    write_harwell_boeing(tmp_path / "K.matrix", K, kind="RUA")
    text = (tmp_path / "K.matrix").read_text().replace("RUA", "RSA")
    (tmp_path / "K.matrix").write_text(text)
    assert largest_relative(read_matrix(tmp_path / "K.matrix").matrix, K) <= 1e-16


@pytest.mark.parametrize(
    ("text", "count", "kind", "width", "scale"),
    [
        ("(10I8)", 10, "I", 8, 0),
        ("(I14)", 1, "I", 14, 0),
        ("(3E25.16)", 3, "E", 25, 0),
        ("(1P,3E25.16)", 3, "E", 25, 1),
        ("(1P3E25.16E3)", 3, "E", 25, 1),
        ("(3(1PD25.16))", 3, "D", 25, 1),
        ("( 1P, 4 ES 20.12 )", 4, "E", 20, 1),
        ("(5F16.4)", 5, "F", 16, 0),
        ("(1p,g24.16)", 1, "G", 24, 1),
    ],
)
def test_fortran_formats(text: str, count: int, kind: str, width: int, scale: int) -> None:
    found = FortranFormat.parse(text)
    assert (found.count, found.kind, found.width, found.scale) == (count, kind, width, scale)


def test_fortran_numbers() -> None:
    plain, scaled = FortranFormat.parse("(3E25.16)"), FortranFormat.parse("(1P,3E25.16)")
    for text, value in {
        "1.5E+03": 1.5e3,
        "-.5d-2": -5e-3,
        "1.5-105": 1.5e-105,
        "2.E5": 2e5,
        "+1.25+100": 1.25e100,
    }.items():
        assert plain.real(text) == scaled.real(text) == value
    assert plain.real("12.5") == 12.5
    assert scaled.real("12.5") == 1.25  # a scale factor divides numbers without an exponent, on input
    for text in ("", "12", "1E5", "1.5F3", "nan", "inf", "1.5E", "1 .5", "１.5"):
        with pytest.raises(ValueError, match="decimal point"):
            plain.real(text)


def test_an_ansys_mapping_names_the_equations(tmp_path: Path) -> None:
    labels = shuffled(LABELS)
    write_mapping(tmp_path / "K.mapping", labels)
    assert list(read_mapping((tmp_path / "K.mapping").read_text(), "K.mapping")) == labels


@pytest.mark.parametrize("form", [1, 6])
def test_dmig_entries_find_their_rows(tmp_path: Path, form: int) -> None:
    pytest.importorskip("pyyeti")
    labels = shuffled(LABELS)
    write_dmig(tmp_path / "K.pch", K, labels, form=form)
    read = read_matrix(tmp_path / "K.pch")
    assert largest_relative(by_label(read, labels), K) <= 1e-9  # ten digits are punched


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("layout", ["dense", "bigmat", "nonbigmat"])
def test_pyyeti_writes_output4(tmp_path: Path, binary: bool, layout: str) -> None:
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    file = str(tmp_path / "track.op4")
    op4.write(file, {"KAA": K.toarray(), "MAA": FREE[0].toarray()}, binary=binary, sparse=layout)
    assert largest_relative(read_matrix(f"{file}#KAA").matrix, K) <= 1e-15
    assert largest_relative(read_matrix(f"{file}#maa").matrix, FREE[0]) <= 1e-15
    with pytest.raises(ValueError, match=r'holds KAA, MAA; say which, as in ".*track.op4#KAA"'):
        read_matrix(file)
    with pytest.raises(ValueError, match="matrix 'BAA' is not there just once; it holds KAA, MAA"):
        read_matrix(f"{file}#BAA")


def test_pyyeti_writes_dmig_too(tmp_path: Path) -> None:
    nastran = pytest.importorskip("pyyeti.nastran")
    pandas = pytest.importorskip("pandas")
    index = pandas.MultiIndex.from_tuples(LABELS, names=["id", "dof"])
    nastran.wtdmig(str(tmp_path / "K.pch"), {"k": pandas.DataFrame(K.toarray(), index=index, columns=index)})
    read = read_matrix(tmp_path / "K.pch")
    assert largest_relative(by_label(read, LABELS), K) <= 1e-8


def test_without_pyyeti_nastran_files_say_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyyeti", None)
    write_dmig(tmp_path / "K.pch", K, LABELS)
    (tmp_path / "K.op4").write_bytes(b"anything")
    for file in ("K.pch", "K.op4"):
        with pytest.raises(ValueError, match=r"need pyYeti, which is not installed: pip install 'tbatch\[nastran\]'$"):
            read_matrix(tmp_path / file)


COORDINATES = "%%MatrixMarket matrix coordinate real general\n"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "the format is not known"),
        ("hello\nworld\n", "the format is not known"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", "complex general; accepted: real"),
        (f"{COORDINATES}2 3 1\n1 1 1.0\n", "2 x 3; accepted: a square"),
        (
            f"{COORDINATES}2 2 2\n2 1 1.0\n2 1 1.0\n",
            "line 4: the same entry stands at line 3",
        ),
        (f"{COORDINATES}2 2 900\n2 1 1.0\n", "1 entries; line 2 says 900"),
        ("%%MatrixMarket matrix array real general\n900000 900000\n1.0\n", "1 entries; line 2 says 810000000000"),
        (
            f"{COORDINATES}2 2 2\n2 1 1.0\n3 1 1.0\n",
            "line 4: '3 1 1.0'; accepted: row, column (1 to 2)",
        ),
        (
            f"{COORDINATES}% no\n1 1 1\n1 x 1\n",
            "line 4: '1 x 1'; accepted: row, column (1 to 1)",
        ),
        (f"{COORDINATES}1 1 1\n1 1 nan\n", "line 3: nan is not a finite number"),
        ("1,1, 1,1, 2.0\n1,1, 1,1, 2.0\n", "line 2: the same entry stands at line 1"),
        ("1,1, 1,1, 2.0\n1,2, 1,1, x\n", "line 2: '1,2, 1,1, x' is not read"),
        ("1,1, 1,1, 2.0\n2, 1, 1.0\n", "line 2: 3 values; accepted"),
        ("1,1, 1,1, 2.0\n2,99, 1,1, 1.0\n", "line 2: there is no dof 99 of a node 2"),
        ("1, 1, 2.0\n0, 1, 1.0\n", "line 2: row 0, column 1: must be from 1 to"),
        ("1, 1, 2.0\n2, 1, inf\n", "line 2: inf is not a finite number"),
        ("** Assembled nodal loads\n*CLOAD, REAL\n2,3,  5.4e+04\n", "line 2: *CLOAD is a load"),
        ("*USER ELEMENT, NODES=2\n1, 2\n", "a substructure or of single elements"),
    ],
)
def test_what_is_wrong_in_a_text_is_said_with_its_place(tmp_path: Path, content: str, said: str) -> None:
    file = tmp_path / "bad.mtx"
    file.write_text(content)
    with pytest.raises(ValueError) as caught:
        read_matrix(file)
    assert str(caught.value).startswith(str(file)) and said in str(caught.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("RSA", "CSA"), "line 3: type 'CSA'; accepted: RSA or RUA"),
        (("RSA", "RSE"), "line 3: type 'RSE'; accepted: RSA or RUA"),
        (("(3E26.17)", "(3X26.17)"), "line 4: '(3X26.17)' is no number format"),
        (("0.2048", "0,2048"), "is not a number with a decimal point"),
    ],
)
def test_what_is_wrong_in_harwell_boeing_is_said_with_its_line(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    file = tmp_path / "K.matrix"
    write_harwell_boeing(file, 2.048 * sparse.identity(4))
    text = file.read_text()
    assert change[0] in text
    file.write_text(text.replace(*change, 1))
    with pytest.raises(ValueError) as caught:
        read_matrix(file)
    assert str(caught.value).startswith(str(file)) and said in str(caught.value)
    file.write_text(text[: len(text) - 40])
    with pytest.raises(ValueError, match="the file ends in its values"):
        read_matrix(file)


def test_only_square_real_npz_are_read(tmp_path: Path) -> None:
    file = tmp_path / "K.npz"
    for matrix, said in (
        (sparse.csr_matrix((2, 3)), "2 x 3; accepted"),
        (1j * sparse.identity(2, format="csc"), "complex128"),
    ):
        sparse.save_npz(file, matrix)
        with pytest.raises(ValueError, match=said):
            read_matrix(file)
    np.savez(file, a=np.eye(2))
    with pytest.raises(ValueError, match=r"not a matrix of scipy.sparse.save_npz"):
        read_matrix(file)
    wild = sparse.csc_matrix(sparse.identity(3))
    wild.indices[:] = 10**6  # read out of bounds if believed
    sparse.save_npz(file, wild)
    with pytest.raises(ValueError, match=r"not a matrix of scipy.sparse.save_npz"):
        read_matrix(file)
