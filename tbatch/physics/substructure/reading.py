"""From a path to a matrix: which format a file has is told by its content, and by its suffix for Nastran's binary."""

import re
from pathlib import Path

from tbatch.physics.substructure.abaqus import is_abaqus, read_abaqus
from tbatch.physics.substructure.file_matrix import FileMatrix
from tbatch.physics.substructure.harwell_boeing import is_harwell_boeing, read_harwell_boeing
from tbatch.physics.substructure.matrix_market import MARK as MATRIX_MARKET
from tbatch.physics.substructure.matrix_market import read_matrix_market
from tbatch.physics.substructure.nastran import read_dmig, read_op4
from tbatch.physics.substructure.scipy_npz import MARK as NPZ
from tbatch.physics.substructure.scipy_npz import read_npz

LARGEST_FILE = 2**30
_HEAD = 2**16
FORMATS = (
    "Matrix Market, scipy.sparse.save_npz, Abaqus *MATRIX OUTPUT, Harwell-Boeing (ANSYS HBMAT), Nastran OP4 or DMIG"
)


def read_matrix(path: str | Path) -> FileMatrix:
    """Read a square matrix from a file of any format known here.

    Args:
        path: The file; one of several matrices of a Nastran file by its name, as in ``"track.pch#KAAX"``.

    Raises:
        ValueError: What is wrong, with the file and the line or the entry.
        OSError: The file cannot be read.
    """
    file, name = split_name(path)
    return parse_matrix(load(file), str(file), name)


def split_name(path: str | Path) -> tuple[Path, str | None]:
    """Return the file of a path and the name of the matrix in it, if one follows a ``#``."""
    file, mark, name = str(path).rpartition("#")
    return (Path(file), name) if mark and file and name and not Path(path).exists() else (Path(path), None)


def load(file: Path) -> bytes:
    """Return the bytes of a file that is not too large.

    Args:
        file: The file.
    """
    if file.stat().st_size > LARGEST_FILE:
        raise ValueError(f"{file}: more than {LARGEST_FILE / 2**30:g} GiB; scipy.sparse.save_npz makes smaller files")
    return file.read_bytes()


def parse_matrix(content: bytes, path: str, name: str | None = None) -> FileMatrix:
    """Read a matrix from a file's bytes.

    Args:
        content: The bytes.
        path: The file: for messages, and to be read again if it is Nastran's binary.
        name: Name of the matrix in a Nastran file.
    """
    head = content[:_HEAD].lstrip()
    dmig = re.search(rb"^DMIG[ *,\t]", content, re.MULTILINE | re.IGNORECASE) is not None
    if Path(path).suffix.lower() == ".op4":
        return read_op4(path, name)
    if dmig:
        return read_dmig(text_of(content), path, name)
    if name is not None:
        raise ValueError(f"{path}#{name}: only Nastran files hold several matrices")
    if content.startswith(NPZ):
        return read_npz(content, path)
    if content[: len(MATRIX_MARKET)].lower() == MATRIX_MARKET:
        return read_matrix_market(text_of(content), path)
    if is_harwell_boeing(text_of(content[:_HEAD])):
        return read_harwell_boeing(text_of(content), path)
    if is_abaqus(text_of(head)):
        return read_abaqus(text_of(content), path)
    raise ValueError(f"{path}: the format is not known; accepted: {FORMATS}")


def text_of(content: bytes) -> str:
    """Return bytes as text with lines that end in a line feed; characters beyond ASCII are for messages only.

    Args:
        content: The bytes.
    """
    return content.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
