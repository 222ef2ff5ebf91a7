"""Abaqus: the text files of ``*MATRIX OUTPUT`` after ``*MATRIX GENERATE``."""

import re

import numpy as np

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, assemble

_ACCEPTED = "*MATRIX OUTPUT with FORMAT=MATRIX INPUT (node, dof, node, dof, value) or COORDINATE (row, column, value)"
_MOST_DOFS = 64
_LARGEST_NODE = 2**40


def is_abaqus(head: str) -> bool:
    """Return whether a text begins as such a file does."""
    for line in head.split("\n"):
        text = line.strip()
        if text and not text.startswith("**"):
            return re.match(r"\*[A-Za-z]|-?\d+\s*,\s*-?\d+\s*,", text) is not None
    return False


def read_abaqus(text: str, path: str) -> FileMatrix:
    """Read a matrix in either layout.

    The stiffness and mass files hold the lower half of a symmetric matrix, as Abaqus orders its equations, or all of
    an unsymmetric one. Nodes that Abaqus adds itself have negative numbers. A dof that is held has 1e36 on the
    diagonal; what to do about it is not decided here.

    Args:
        text: The file's text.
        path: The file, for messages.
    """
    rows: list[int] = []
    columns: list[int] = []
    values: list[float] = []
    lines: list[int] = []
    width, half = 0, True
    for number, line in enumerate(text.split("\n"), start=1):
        stripped = line.strip()
        if not stripped or stripped.startswith("**"):
            continue
        if stripped.startswith("*"):
            half = _accept_keyword(stripped, f"{path}, line {number}") and half
            continue
        words = stripped.rstrip(",").split(",")
        width = width or len(words)
        if len(words) != width or width not in (3, 5):
            raise ValueError(f"{path}, line {number}: {len(words)} values; accepted: {_ACCEPTED}, the same all through")
        try:
            whole = [int(word) for word in words[:-1]]
            value = float(words[-1].replace("D", "E").replace("d", "e"))
        except ValueError:
            raise ValueError(f"{path}, line {number}: {stripped[:60]!r} is not read; accepted: {_ACCEPTED}") from None
        if width == 5:
            for node, dof in (whole[:2], whole[2:]):
                if not (0 < dof < _MOST_DOFS and 0 < abs(node) < _LARGEST_NODE):
                    raise ValueError(f"{path}, line {number}: there is no dof {dof} of a node {node}")
            whole = [whole[0] * _MOST_DOFS + whole[1], whole[2] * _MOST_DOFS + whole[3]]
        elif not (1 <= min(whole) and max(whole) <= MOST_ROWS):
            raise ValueError(f"{path}, line {number}: row {whole[0]}, column {whole[1]}: must be from 1 to {MOST_ROWS}")
        rows.append(whole[0])
        columns.append(whole[1])
        values.append(value)
        lines.append(number)
    if not values:
        raise ValueError(f"{path}: no entries; accepted: {_ACCEPTED}")
    i, j = np.array(rows, dtype=np.int64), np.array(columns, dtype=np.int64)
    labels = None
    if width == 5:
        keys, at = np.unique(np.concatenate([i, j]), return_inverse=True)
        i, j = at[: i.size], at[i.size :]
        labels = tuple((key // _MOST_DOFS, key % _MOST_DOFS) for key in keys.tolist())
        size = len(labels)
    else:
        i, j = i - 1, j - 1
        size = int(max(i.max(), j.max())) + 1
    matrix = assemble(path, i, j, np.array(values), size, half=half, named=lambda entry: f"line {lines[entry]}")
    return FileMatrix(path, matrix, labels, stated=False)


def _accept_keyword(line: str, place: str) -> bool:
    """Return whether the keyword line announces a symmetric matrix; refuse it if it announces something else."""
    keyword, *options = (word.strip().upper() for word in line[1:].split(","))
    if keyword == "MATRIX INPUT":
        return "UNSYMMETRIC" not in "".join(options)
    what = {"CLOAD": "a load", "USER ELEMENT": "the matrices of a substructure or of single elements"}
    raise ValueError(f"{place}: *{keyword[:40]} is {what.get(keyword, 'not a matrix')}; accepted: {_ACCEPTED}")
