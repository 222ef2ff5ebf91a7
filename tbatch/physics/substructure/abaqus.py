"""Abaqus: the text files of ``*MATRIX OUTPUT`` after ``*MATRIX GENERATE``."""

import re

import numpy as np

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, assemble
from tbatch.physics.substructure.number_table import read_table

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
    lines = text.split("\n")
    at: list[int] = []
    half = True
    for number, line in enumerate(lines):
        if line.lstrip()[:1] == "*":
            if not line.lstrip().startswith("**"):
                half = _accept_keyword(line.strip(), f"{path}, line {number + 1}") and half
        elif line and not line.isspace():
            at.append(number)
    if not at:
        raise ValueError(f"{path}: no entries; accepted: {_ACCEPTED}")
    width = len(lines[at[0]].strip().rstrip(",").split(","))

    def parse(index: int) -> tuple[list[int], float]:
        place = f"{path}, line {at[index] + 1}"
        words = lines[at[index]].strip().rstrip(",").split(",")
        if len(words) != width or width not in (3, 5):
            raise ValueError(f"{place}: {len(words)} values; accepted: {_ACCEPTED}, the same all through")
        try:
            whole = [int(word) for word in words[:-1]]
            value = float(words[-1].replace("D", "E").replace("d", "e"))
        except ValueError:
            shown = lines[at[index]].strip()[:60]
            raise ValueError(f"{place}: {shown!r} is not read; accepted: {_ACCEPTED}") from None
        if width == 5:
            for node, dof in (whole[:2], whole[2:]):
                if not (0 < dof < _MOST_DOFS and 0 < abs(node) < _LARGEST_NODE):
                    raise ValueError(f"{place}: there is no dof {dof} of a node {node}")
        elif not (1 <= min(whole) and max(whole) <= MOST_ROWS):
            raise ValueError(f"{place}: row {whole[0]}, column {whole[1]}: must be from 1 to {MOST_ROWS}")
        return whole, value

    numbers, values = read_table([lines[number] for number in at], width - 1, parse, delimiter=",")
    if width == 5:
        node, dof = numbers[:, 0::2], numbers[:, 1::2]
        wrong = (dof < 1) | (dof >= _MOST_DOFS) | (node == 0) | (np.abs(node) >= _LARGEST_NODE)
    else:
        wrong = (numbers < 1) | (numbers > MOST_ROWS)
    if width not in (3, 5) or wrong.any():
        parse(int(np.argmax(wrong.any(axis=1))))
    labels = None
    if width == 5:
        keys, rows = np.unique(np.concatenate((node * _MOST_DOFS + dof).T), return_inverse=True)
        i, j = rows.reshape(2, -1)
        labels = tuple((key // _MOST_DOFS, key % _MOST_DOFS) for key in keys.tolist())
        size = len(labels)
    else:
        i, j = numbers.T - 1
        size = int(numbers.max())
    matrix = assemble(path, i, j, values, size, half=half, named=lambda entry: f"line {at[entry] + 1}")
    return FileMatrix(path, matrix, labels, stated=False)


def _accept_keyword(line: str, place: str) -> bool:
    """Return whether the keyword line announces a symmetric matrix; refuse it if it announces something else."""
    keyword, *options = (word.strip().upper() for word in line[1:].split(","))
    if keyword == "MATRIX INPUT":
        return "UNSYMMETRIC" not in "".join(options)
    what = {"CLOAD": "a load", "USER ELEMENT": "the matrices of a substructure or of single elements"}
    raise ValueError(f"{place}: *{keyword[:40]} is {what.get(keyword, 'not a matrix')}; accepted: {_ACCEPTED}")
