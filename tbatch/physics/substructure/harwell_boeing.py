"""Harwell-Boeing files, as ANSYS writes them (HBMAT)."""

import re
from collections.abc import Callable

import numpy as np

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, assemble
from tbatch.physics.substructure.fortran_format import FortranFormat

_TYPE = re.compile(r"[RCP][SUHZR][AE]", re.IGNORECASE)
_HEADER_LINES = 4


def is_harwell_boeing(head: str) -> bool:
    """Return whether a text begins as such a file does: its third line begins with a matrix type."""
    lines = head.split("\n", 4)
    return len(lines) > 3 and _TYPE.match(lines[2].strip()) is not None and "(" in lines[3]


def read_harwell_boeing(text: str, path: str) -> FileMatrix:
    """Read an assembled real matrix, symmetric (RSA) or unsymmetric (RUA); right-hand sides are passed over.

    The lines are laid out by the formats alone: their numbers in the header are not needed, but for that of the
    right-hand sides, which adds a line to the header.

    Args:
        text: The file's text.
        path: The file, for messages.
    """
    lines = text.split("\n")
    if len(lines) <= _HEADER_LINES:
        raise ValueError(f"{path}: ends in its header; accepted: a Harwell-Boeing file")
    code = lines[2].strip()[:3].upper()
    if code not in ("RSA", "RUA"):
        raise ValueError(f"{path}, line 3: type {code!r}; accepted: RSA or RUA, a real assembled square matrix")
    rows, columns, entries = _whole_numbers(lines[2].strip()[3:], f"{path}, line 3", 3)[:3]
    if rows != columns or not 1 <= rows <= MOST_ROWS:
        raise ValueError(f"{path}, line 3: {rows} x {columns}; accepted: a square matrix of 1 to {MOST_ROWS} rows")
    if not 1 <= entries <= len(text):
        raise ValueError(f"{path}, line 3: {entries} entries; the file is too short for that")
    counts = _whole_numbers(lines[1], f"{path}, line 2", 4)
    has_right_hand_sides = len(counts) > 4 and counts[4] > 0
    formats = re.findall(r"\([^()]*(?:\([^()]*\)[^()]*)*\)", lines[3])
    if len(formats) < 3:
        raise ValueError(f"{path}, line 4: {lines[3].strip()[:80]!r}; accepted: formats of pointers, rows and values")
    try:
        pointer_format, row_format, value_format = (FortranFormat.parse(format) for format in formats[:3])
    except ValueError as error:
        raise ValueError(f"{path}, line 4: {error}") from None
    next_line = _HEADER_LINES + has_right_hand_sides

    def numbers(format: FortranFormat, count: int, parse: Callable[[str], float], what: str) -> list[float]:
        nonlocal next_line
        begin, next_line = next_line, next_line + format.lines(count)
        fields = format.fields(lines[begin:next_line], count)
        found = []
        for index, field in enumerate(fields):
            try:
                found.append(parse(field))
            except ValueError as error:
                line = begin + index // format.count + 1
                said = f"the file ends in its {what}" if line > len(lines) or not field else f"{what}: {error}"
                raise ValueError(f"{path}, line {line}: {said}") from None
        return found

    pointers = np.array(numbers(pointer_format, columns + 1, pointer_format.whole, "column pointers"), dtype=np.int64)
    if pointers[0] != 1 or pointers[-1] != entries + 1 or (np.diff(pointers) < 0).any():
        raise ValueError(f"{path}: the column pointers do not rise from 1 to {entries + 1}, the number of entries + 1")
    i = np.array(numbers(row_format, entries, row_format.whole, "row numbers"), dtype=np.int64)
    if not (inside := (i >= 1) & (i <= rows)).all():
        raise ValueError(f"{path}: row {i[~inside][0]} of an entry; must be from 1 to {rows}")
    values = np.array(numbers(value_format, entries, value_format.real, "values"), dtype=np.float64)
    i -= 1
    j = np.repeat(np.arange(columns), np.diff(pointers))
    named = lambda entry: f"entry ({i[entry] + 1}, {j[entry] + 1})"  # noqa: E731
    return FileMatrix(path, assemble(path, i, j, values, rows, half=code == "RSA", named=named))


def _whole_numbers(text: str, place: str, least: int) -> list[int]:
    words = text.split()
    if len(words) < least or any(re.fullmatch(r"\d{1,15}", word, re.ASCII) is None for word in words):
        raise ValueError(f"{place}: {text.strip()[:80]!r}; accepted: at least {least} whole numbers")
    return [int(word) for word in words]
