"""Writers of matrix files, after the public descriptions of the formats: they share no code with the readers."""

from pathlib import Path

import numpy as np
from scipy import sparse

DIRECTIONS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")


def labels_of(size: int, dofs: int) -> list[tuple[int, int]]:
    """Node and dof of each row of a track ordered node by node: nodes 101, 102, ..., dofs 1, 2, ..."""
    return [(101 + row // dofs, 1 + row % dofs) for row in range(size)]


def write_abaqus(path: Path, matrix, labels=None, *, half="lower", held=()):
    """`*MATRIX OUTPUT`: FORMAT=MATRIX INPUT with labels, FORMAT=COORDINATE without. `held` rows get 1e36."""
    dense = matrix.toarray()
    lines = []
    for j in range(dense.shape[0]):
        for i in range(dense.shape[0]):
            if (half == "lower" and i < j) or (half == "upper" and i > j) or (dense[i, j] == 0.0 and i != j):
                continue
            value = 1e36 if i == j and i in held else dense[i, j]
            where = f"{i + 1}, {j + 1}" if labels is None else "{},{}, {},{}".format(*labels[i], *labels[j])
            lines.append(f"{where}, {value: .15e}")
    path.write_text("\n".join(lines) + "\n")


def fortran(value: float, style: str, width: int, digits: int) -> str:
    """A number as Fortran prints it: E and D with a leading zero, 1P with a leading digit."""
    if value == 0.0 or style.startswith("1P"):
        text = f"{value:.{digits}E}"
    else:
        mantissa, exponent = f"{value:.{digits - 1}E}".split("E")
        sign, digits_only = ("-" if value < 0 else ""), mantissa.replace("-", "").replace(".", "")
        text = f"{sign}0.{digits_only}E{int(exponent) + 1:+03d}"
    mantissa, exponent = text.split("E")
    if len(exponent) > 3:  # three digits push the letter out
        return f"{mantissa}{exponent}".rjust(width)
    return f"{mantissa}{'D' if style.endswith('D') else 'E'}{exponent}".rjust(width)


def write_harwell_boeing(path: Path, matrix, *, kind="RSA", style="E", per_line=3, right_hand_sides=False):
    """Harwell-Boeing (Duff, Grimes, Lewis 1989): RSA holds the lower half by columns, RUA all of it."""
    stored = sparse.csc_matrix(sparse.tril(matrix) if kind == "RSA" else matrix)
    stored.sort_indices()
    size, count, width, digits = matrix.shape[0], stored.nnz, 26, 17
    value_format = {
        "E": f"({per_line}E26.17)",
        "D": f"({per_line}D26.17)",
        "1PE": f"(1P,{per_line}E26.17)",
        "1PD": f"(1P{per_line}D26.17)",
    }[style]

    def block(fields, per):
        return ["".join(fields[start : start + per]) for start in range(0, len(fields), per)]

    pointers = block([f"{number + 1:14d}" for number in stored.indptr], 5)
    rows = block([f"{number + 1:8d}" for number in stored.indices], 10)
    values = block([fortran(value, style, width, digits) for value in stored.data], per_line)
    load = block([fortran(float(row), style, width, digits) for row in range(size)], per_line)
    lines = [f"{'a track':72s}{'KEY':8s}"]
    counts = [len(pointers), len(rows), len(values), len(load) if right_hand_sides else 0]
    lines.append("".join(f"{number:14d}" for number in [sum(counts), *counts]))
    lines.append(f"{kind:14s}{size:14d}{size:14d}{count:14d}{0:14d}")
    lines.append(f"{'(5I14)':16s}{'(10I8)':16s}{value_format:20s}{value_format if right_hand_sides else '':20s}")
    lines += [f"{'F':14s}{1:14d}{0:14d}"] if right_hand_sides else []
    lines += pointers + rows + values + (load if right_hand_sides else [])
    path.write_text("\n".join(lines) + "\n")


def write_mapping(path: Path, labels):
    """What ANSYS writes beside it: a heading, then equation, node and name of the dof."""
    body = [f"{row + 1:14d}{node:14d}   {DIRECTIONS[dof - 1]}" for row, (node, dof) in enumerate(labels)]
    path.write_text("\r\n".join(["    Matrix Eqn          Node   DOF", *body]) + "\r\n")


def write_dmig(path: Path, matrix, labels, *, name="KAAX", form=6):
    """Bulk data entry DMIG in large fields of 16 characters, as EXTSEOUT(DMIGPCH) punches it."""
    stored = sparse.csc_matrix(sparse.tril(matrix) if form == 6 else matrix)
    lines = ["$ punched", f"DMIG    {name:8s}{0:8d}{form:8d}{2:8d}{0:8d}{'':8s}{'':8s}{'':8s}".rstrip()]
    for j in range(matrix.shape[0]):
        start, stop = stored.indptr[j : j + 2]
        if start == stop:
            continue
        lines.append(f"DMIG*   {name:16s}{labels[j][0]:16d}{labels[j][1]:16d}")
        for at in range(start, stop):
            i = stored.indices[at]
            number = f"{stored.data[at]:.9E}".replace("E", "D")
            lines.append(f"*       {labels[i][0]:16d}{labels[i][1]:16d}{number:>16s}")
    path.write_text("\n".join(lines) + "\n")


def largest_relative(read, written) -> float:
    """Largest difference of two matrices, entry by entry, relative to the entry; inf where a zero was filled."""
    read, written = read.toarray(), written.toarray()
    error = np.abs(read - written)
    return float(
        np.max(np.divide(error, np.abs(written), out=np.where(error > 0.0, np.inf, 0.0), where=written != 0.0))
    )
