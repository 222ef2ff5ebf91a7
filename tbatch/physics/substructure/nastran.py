"""Nastran: OUTPUT4 files and DMIG entries of a punch file. Both are read by pyYeti, the extra ``nastran``."""

from io import StringIO
from types import ModuleType
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np
from scipy import sparse

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, Label, assemble

_SQUARE, _SYMMETRIC = 1, 6
_REAL = (1, 2)


def read_op4(path: str, name: str | None = None) -> FileMatrix:
    """Read a real square matrix of an OUTPUT4 file, text or binary.

    Args:
        path: The file.
        name: Name of the matrix, as in Nastran; may be left out where the file has one.
    """
    op4 = _pyyeti(path).op4
    try:
        with catch_warnings():
            simplefilter("ignore")  # pyYeti warns of names that it replaces
            return _read_op4(op4, path, name)
    except Exception as error:  # pyYeti 1.4 leaves what goes wrong in a file to NumPy, struct and int()
        raise ValueError(_said(path, error)) from None


def _read_op4(op4: ModuleType, path: str, name: str | None) -> FileMatrix:
    names, sizes, _, kinds = op4.dir(path, verbose=False)
    at = _chosen(path, [str(found) for found in names], name)
    rows, columns = (int(size) for size in sizes[at])
    if rows != columns or not 1 <= rows <= MOST_ROWS:
        raise ValueError(f"{rows} x {columns}; accepted: a square matrix of 1 to {MOST_ROWS} rows")
    if kinds[at] not in _REAL:
        raise ValueError("is complex; accepted: a real matrix")
    _, matrices, forms, _ = op4.read(path, [names[at]], into="list", justmatrix=False, sparse=(True, None))
    given = sparse.coo_matrix(matrices[0])
    i, j = given.row.astype(np.int64), given.col.astype(np.int64)
    values = np.asarray(given.data, dtype=np.float64)
    named = lambda entry: f"entry ({i[entry] + 1}, {j[entry] + 1})"  # noqa: E731
    shown = _shown(path, name)
    return FileMatrix(shown, assemble(shown, i, j, values, rows, half=forms[0] == _SYMMETRIC, named=named))


def read_dmig(text: str, path: str, name: str | None = None) -> FileMatrix:
    """Read a real square or symmetric matrix of a file with DMIG entries.

    Args:
        text: The file's text.
        path: The file, for messages.
        name: Name of the matrix, as in Nastran; may be left out where the file has one.
    """
    try:
        # pyYeti's rddmig makes dense tables; its cards do.
        cards = _pyyeti(path).bulk.rdcards(
            StringIO(text), "dmig", return_var="list", blank="", no_data_return=[], follow_includes=False
        )
        heads = {str(card[0]): card for card in cards if card[1] in (0, "")}
        chosen = list(heads)[_chosen(path, list(heads), name)]
        form, kind = heads[chosen][2:4]
        if form not in (_SQUARE, _SYMMETRIC) or kind not in _REAL:
            raise ValueError(f"has form {form}, type {kind}; accepted: form 1 or 6 (square), type 1 or 2 (real)")
        places: dict[Label, int] = {}
        entries = []
        for card in cards:
            if str(card[0]) == chosen and card is not heads[chosen]:
                entries += _column(card)
        labels = tuple(sorted({label for row, column, _ in entries for label in (row, column)}))
        places = {label: place for place, label in enumerate(labels)}
        i = np.array([places[row] for row, _, _ in entries], dtype=np.int64)
        j = np.array([places[column] for _, column, _ in entries], dtype=np.int64)
        values = np.array([value for _, _, value in entries], dtype=np.float64)
        if not entries:
            raise ValueError(f"no entries of {chosen}")
    except Exception as error:
        raise ValueError(_said(path, error)) from None

    def named(entry: int) -> str:
        (row, component), (column, other), _ = entries[entry]
        return f"entry (node {row} dof {component}, node {column} dof {other})"

    shown = _shown(path, name)
    matrix = assemble(shown, i, j, values, len(labels), half=form == _SYMMETRIC, named=named)
    return FileMatrix(shown, matrix, labels, stated=False)


def _column(card: list[Any]) -> list[tuple[Label, Label, float]]:
    """Return (row, column, value) of the entries of a card, one column of the matrix."""
    column = _label(card[1:3])
    entries = []
    for start in range(4, len(card), 4):
        group = card[start : start + 4]
        if all(field == "" for field in group):
            continue
        if len(group) < 3 or isinstance(group[2], str):
            raise ValueError(f"a DMIG entry of column {column} has no value")
        entries.append((_label(group[:2]), column, float(group[2])))
    return entries


def _label(fields: list[Any]) -> Label:
    node, dof = fields
    dof = 0 if dof == "" else dof
    if not (isinstance(node, int) and isinstance(dof, int) and node > 0 and 0 <= dof <= 6):
        raise ValueError(f"there is no component {str(dof)[:20]} of a point {str(node)[:20]}")
    return node, dof


def _chosen(path: str, names: list[str], name: str | None) -> int:
    """Return the index of the matrix to read."""
    if name is None and len(names) == 1:
        return 0
    upper = [found.upper() for found in names]
    if name is not None and upper.count(name.upper()) == 1:
        return upper.index(name.upper())
    if not names:
        raise ValueError("no matrix is found")
    listed = ", ".join(upper[:20])
    if name is None:
        raise ValueError(f'holds {listed}; say which, as in "{path}#{upper[0]}"')
    raise ValueError(f"matrix {name!r} is not there just once; it holds {listed}")


def _said(path: str, error: Exception) -> str:
    """Return a one-line message of what went wrong in a file."""
    said = " ".join(str(error).split()) or type(error).__name__
    return said if said.startswith(path) else f"{path}: {said}"


def _shown(path: str, name: str | None) -> str:
    return path if name is None else f"{path}#{name}"


def _pyyeti(path: str) -> ModuleType:
    try:
        from pyyeti import nastran
    except ImportError:
        message = f"{path}: Nastran files need pyYeti, which is not installed: pip install 'tbatch[nastran]'"
        raise ValueError(message) from None
    return nastran
