"""The node map: a table that says which rows of the matrices are the rail's, and where its nodes are."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.substructure.file_matrix import FileMatrix, Label, shown_label

HELD = -1
"""Stands for the row of a dof that is held and has no row."""
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3}
_BASES = {"from 1": 1, "from 0": 0}
_ARGUMENTS = {
    "rail_x": ("x", ""),
    "rail_w": ("w_row", "from 0"),
    "rail_theta": ("theta_row", "from 0"),
    "w": ("w_row", "from 0"),
    "theta": ("theta_row", "from 0"),
}
"""Columns named as the arguments of `Track.from_matrices`, with rows from 0 as there."""
_COLUMNS = ("x", "w_row", "theta_row", "node", "w_dof", "theta_dof", "w_sign", "theta_sign")
_DOFS = {
    name: dof
    for dof, axis in enumerate("XYZ", start=1)
    for name in (str(dof), f"U{axis}", f"U{dof}", f"T{dof}", f"T{axis}")
} | {
    name: dof
    for dof, axis in enumerate("XYZ", start=4)
    for name in (str(dof), f"ROT{axis}", f"UR{dof - 3}", f"R{dof - 3}", f"R{axis}")
}


@dataclass(frozen=True, eq=False)
class NodeMap:
    """The rail's nodes, in the order of x."""

    path: str
    """The file."""
    lines: tuple[int, ...]
    """Line of each node in it."""
    x: NDArray[np.float64]
    """Positions, strictly increasing [m], shape (node,)."""
    w: tuple[int | Label, ...]
    """Row of each node's vertical dof from 0, or its label; ``HELD`` where it is held and not in the matrices."""
    theta: tuple[int | Label, ...] | None
    """The same of each node's rotation; None where the rail has none."""
    w_sign: NDArray[np.float64] | None
    """1 where the vertical dof counts downwards, -1 where upwards, shape (node,); None if not said."""
    theta_sign: NDArray[np.float64] | None
    """1 where the rotation counts as dw/dx of w downwards, -1 where the other way round; None if not said."""

    def rows(self, matrix: FileMatrix) -> tuple[NDArray[np.int64], NDArray[np.int64] | None]:
        """Return the rows of a matrix, from 0, that are each node's vertical dof and its rotation; ``HELD`` for none.

        Args:
            matrix: The stiffness.
        """
        w = self._rows("w", self.w, matrix)
        theta = None if self.theta is None else self._rows("theta", self.theta, matrix)
        seen: dict[int, str] = {}
        for name, found in (("w", w), ("theta", theta)):
            for line, row in zip(self.lines, [] if found is None else found.tolist(), strict=False):
                if row == HELD:
                    continue
                if row in seen:
                    raise ValueError(f"{self.path}, line {line}: {name} is the row of {seen[row]}")
                seen[row] = f"{name} of line {line}"
        return w, theta

    def _rows(self, name: str, given: Sequence[int | Label], matrix: FileMatrix) -> NDArray[np.int64]:
        places = {label: row for row, label in enumerate(matrix.labels or ())}
        found = []
        for line, entry in zip(self.lines, given, strict=True):
            place = f"{self.path}, line {line}"
            if entry == HELD or (isinstance(entry, tuple) and entry[1] == HELD):
                found.append(HELD)
            elif isinstance(entry, int):
                if places:
                    message = f"{matrix.path} knows its rows by node and dof"
                    raise ValueError(f"{place}: {message}; accepted: node, {name}_dof in place of {name}_row")
                if not 0 <= entry < matrix.size:
                    raise ValueError(f"{place}: {name}_row is beyond the {matrix.size} rows of {matrix.path}")
                found.append(entry)
            elif entry in places:
                found.append(places[entry])
            elif not places:
                message = f"has rows without node and dof; accepted: w_row [from 1] in place of node and {name}_dof"
                raise ValueError(f"{place}: {matrix.path} {message}")
            else:
                others = sorted(label[1] for label in places if label[0] == entry[0])
                there = f"its dofs there: {', '.join(map(str, others))}" if others else "nor any other of that node"
                accepted = f"one of the matrices', or held in place of {name}_dof"
                raise ValueError(
                    f"{place}: {shown_label(entry)} is not in {matrix.path}, {there}; accepted: {accepted}"
                )
        return np.array(found, dtype=np.int64)


def read_node_map(text: str, path: str) -> NodeMap:
    """Read a node map: comma-separated, one heading line, one line a node.

    Args:
        text: The file's text.
        path: The file, for messages.
    """
    rows = _cells(text)
    if not rows:
        raise ValueError(f"{path}: is empty; accepted: a heading line and a line for each rail node")
    (line, heading), *body = rows
    columns = _heading(heading, f"{path}, line {line}")
    by_row = "w_row" in columns
    rotates = ("theta_row" if by_row else "theta_dof") in columns
    table: dict[str, list[float | int]] = {name: [] for name in columns}
    for line, cells in body:
        place = f"{path}, line {line}"
        if len(cells) != len(columns):
            raise ValueError(f"{place}: {len(cells)} entries; the heading has {len(columns)}: {', '.join(columns)}")
        for (name, unit), cell in zip(columns.items(), cells, strict=True):
            table[name].append(_READERS[name](cell, unit, f"{place}, {name}"))
        if len(table["x"]) > 1 and table["x"][-1] <= table["x"][-2]:
            before, now = table["x"][-2:]
            raise ValueError(f"{place}: x = {now:g} m does not lie beyond the node before ({before:g} m)")
    if len(body) < 2:
        raise ValueError(f"{path}: {len(body)} nodes; at least 2 are needed")

    def signs(name: str) -> NDArray[np.float64] | None:
        return np.array(table[name], dtype=np.float64) if name in table else None

    def entries(row: str, dof: str) -> tuple[int | Label, ...]:
        if by_row:
            return tuple(int(number) for number in table[row])
        return tuple((int(node), int(number)) for node, number in zip(table["node"], table[dof], strict=True))

    return NodeMap(
        path,
        tuple(number for number, _ in body),
        np.array(table["x"], dtype=np.float64),
        entries("w_row", "w_dof"),
        entries("theta_row", "theta_dof") if rotates else None,
        signs("w_sign"),
        signs("theta_sign"),
    )


def _cells(text: str) -> list[tuple[int, list[str]]]:
    """Return the cells of each line that has any, with the line's number."""
    found = []
    for number, line in enumerate(text.removeprefix("\ufeff").split("\n"), start=1):
        if content := line.split("#", 1)[0].strip():
            # With semicolons a decimal comma is understood, as in measured levels.
            cells = content.replace(",", ".").split(";") if ";" in content else content.split(",")
            found.append((number, [cell.strip().strip('"').strip() for cell in cells]))
    return found


def _heading(cells: list[str], place: str) -> dict[str, str]:
    """Return the columns in order, with what stands in brackets behind each."""
    columns: dict[str, str] = {}
    for cell in cells:
        found = re.fullmatch(r"([A-Za-z_]+)\s*(?:\[([^\]]*)\])?", cell)
        name = found[1].lower() if found else ""
        unit = (found[2] or "").strip().lower() if found else ""
        if name in _ARGUMENTS:
            name, base = _ARGUMENTS[name]
            unit = unit or base
        if name == "x":
            unit = unit or "m"
        if found is None or name not in _COLUMNS:
            raise ValueError(f"{place}: column {cell[:40]!r}; accepted: {', '.join(_COLUMNS)}")
        if name in columns:
            raise ValueError(f"{place}: column {name} stands there twice")
        columns[name] = unit
    for needed, why in (("x", "its position, as in x [m]"), ("w_row", "or node and w_dof: its vertical dof")):
        if needed not in columns and not (needed == "w_row" and {"node", "w_dof"} <= columns.keys()):
            raise ValueError(f"{place}: no column {needed}, {why}")
    mixed = {"w_row", "theta_row"} & columns.keys() and {"w_dof", "theta_dof"} & columns.keys()
    if mixed:
        accepted = "either w_row, theta_row or node, w_dof, theta_dof"
        raise ValueError(f"{place}: rows and (node, dof) are mixed; accepted: {accepted}")
    if "theta_sign" in columns and not {"theta_row", "theta_dof"} & columns.keys():
        raise ValueError(f"{place}: theta_sign without theta_row or theta_dof")
    for name, unit in columns.items():
        units = tuple(LENGTHS) if name == "x" else tuple(_BASES) if name.endswith("_row") else ("",)
        if unit not in units:
            ways = " or ".join(f"{name} [{way}]" if way else name for way in units)
            raise ValueError(f"{place}: column {name} [{unit[:20]}]; accepted: {ways}")
    return columns


def _position(cell: str, unit: str, place: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{place}: {cell[:40]!r} is not a finite number [{unit}]")
    return number * LENGTHS[unit]


def _whole(cell: str, place: str) -> int:
    if re.fullmatch(r"\d{1,12}", cell, re.ASCII) is None:
        raise ValueError(f"{place}: {cell[:40]!r} is not a whole number")
    return int(cell)


def _row(cell: str, unit: str, place: str) -> int:
    if cell.lower() == "held":
        return HELD
    row = _whole(cell, place) - _BASES[unit]
    if row < 0:
        raise ValueError(f"{place}: row {cell}; the heading says that rows count {unit}")
    return row


def _dof(cell: str, _: str, place: str) -> int:
    if cell.lower() == "held":
        return HELD
    if cell.upper() not in _DOFS:
        raise ValueError(f"{place}: {cell[:40]!r}; accepted: 1 to 6, UX to UZ, ROTX to ROTZ, U1, UR1, ..., held")
    return _DOFS[cell.upper()]


def _sign(cell: str, _: str, place: str) -> int:
    if cell not in ("1", "+1", "-1"):
        raise ValueError(f"{place}: {cell[:40]!r}; accepted: 1 (w down, theta = dw/dx) or -1 (the other way round)")
    return int(cell)


_READERS: dict[str, Callable[[str, str, str], float]] = {
    "x": _position,
    "w_row": _row,
    "theta_row": _row,
    "node": lambda cell, _, place: _whole(cell, place),
    "w_dof": _dof,
    "theta_dof": _dof,
    "w_sign": _sign,
    "theta_sign": _sign,
}
