"""What the matrices of a track must be; each refusal names the matrix, the row, the column and the value.

Rows are counted from 0, as in Python. A motion is judged on matrices scaled to a unit diagonal, so that metres and
radians compare.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, diags_array, issparse, sparray, spmatrix
from scipy.sparse.linalg import splu

from tbatch.physics.quantities import FloatArray

GivenMatrix: TypeAlias = ArrayLike | sparray | spmatrix
"""A matrix as users have it: lists, a dense array or any sparse form."""
SYMMETRY = 1e-6
"""Accepted difference of two mirrored entries, relative to the root of the product of their diagonal entries: the
rounding of single precision is 10 times less."""
NEGATIVE = 1e-7
"""Accepted negative mass or damping of a motion relative to the diagonal: entries printed with 8 digits."""
LOOSE = 1e-13
"""A stiffness pivot below this fraction of its diagonal entry is round-off: at 6 km, a beam of 10,000 elements between
two supports has 2e-12, a beam without supports 3e-15."""
SHIFT = 1e-14
"""Added to the scaled stiffness, so that a loose motion leaves a small pivot and not none."""


class MatrixError(ValueError):
    """A matrix that cannot be a track's.

    Attributes:
        matrix: "mass", "damping" or "stiffness".
        row: The row in question, from 0; None where it is not one row.
    """

    def __init__(self, matrix: str, message: str, row: int | None = None) -> None:
        super().__init__(f"track.{matrix}{message}")
        self.matrix, self.row = matrix, row


def accept_matrix(name: str, value: GivenMatrix, size: int | None = None) -> csc_array:
    """Return a dense or sparse matrix as a symmetric one in compressed columns, without stored zeros.

    Args:
        name: "mass", "damping" or "stiffness".
        value: The matrix.
        size: Number of rows it must have; None for any.

    Raises:
        MatrixError: If it is not square, finite or symmetric.
    """
    given: Any = value if issparse(value) else np.asarray(value)
    if given.dtype.kind == "O" or given.ndim != 2 or given.shape[0] != given.shape[1]:
        raise MatrixError(name, f" has shape {given.shape}: must be square, (dof, dof), of numbers")
    if given.shape[0] == 0 or (size is not None and given.shape[0] != size):
        wanted = "at least (1, 1)" if size is None else f"({size}, {size}) like the mass"
        raise MatrixError(name, f" has shape {given.shape}: must be {wanted}")
    if np.iscomplexobj(given) or not np.can_cast(given.dtype, np.float64):
        raise MatrixError(name, f" holds {given.dtype} numbers: must be real (structural damping goes into `damping`)")
    matrix = csc_array(given, dtype=np.float64, copy=True)
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    column = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    wrong = np.flatnonzero(~np.isfinite(matrix.data))
    if wrong.size:
        row, at = int(matrix.indices[wrong[0]]), int(column[wrong[0]])
        raise MatrixError(name, f"[{row}, {at}] = {float(matrix.data[wrong[0]])}: must be finite", row)
    _check_symmetry(name, matrix)
    return csc_array(0.5 * (matrix + matrix.T))


def _check_symmetry(name: str, matrix: csc_array) -> None:
    difference = (matrix - matrix.T).tocoo()
    if not difference.nnz:
        return
    rows, columns = difference.coords
    scale = np.sqrt(np.abs(matrix.diagonal()))
    size = np.maximum(scale[rows] * scale[columns], np.finfo(float).tiny)
    worst = int(np.argmax(np.abs(difference.data) / size))
    if np.abs(difference.data[worst]) <= SYMMETRY * size[worst]:
        return
    row, column = sorted((int(rows[worst]), int(columns[worst])))
    triangle = ""
    entries = matrix.tocoo()
    below = entries.coords[0] - entries.coords[1]
    if (below >= 0).all() or (below <= 0).all():
        triangle = "; it has entries on one side of its diagonal only: mirror them"
    raise MatrixError(
        name,
        f" is not symmetric: [{row}, {column}] = {float(matrix[row, column])!r} but [{column}, {row}] = "
        f"{float(matrix[column, row])!r}, accepted is a difference of {SYMMETRY:g} of the diagonal{triangle}",
        row,
    )


def check_not_negative(name: str, matrix: csc_array, rows: np.ndarray) -> None:
    """Check that no motion has a negative mass or damping; one without any is accepted.

    Args:
        name: "mass" or "damping".
        matrix: A symmetric matrix.
        rows: What each row is called in a message, shape (row,).

    Raises:
        MatrixError: Naming the worst entry.
    """
    diagonal = matrix.diagonal()
    unit = {"mass": "kg or kg m2", "damping": "N s/m or N m s"}[name]
    if (diagonal < 0.0).any():
        worst = int(np.argmin(diagonal))
        row = int(rows[worst])
        raise MatrixError(name, f"[{row}, {row}] = {float(diagonal[worst])!r}: must be 0 or more [{unit}]", row)
    scale = np.sqrt(diagonal)
    entries = matrix.tocoo()
    i, j = entries.coords
    excess = np.abs(entries.data) - (1.0 + NEGATIVE) * scale[i] * scale[j]
    if entries.nnz and excess.max() > 0.0:
        worst = int(np.argmax(excess / np.maximum(scale[i] * scale[j], np.finfo(float).tiny)))
        first, second = sorted((int(i[worst]), int(j[worst])))
        row, column = int(rows[first]), int(rows[second])
        raise MatrixError(
            name,
            f"[{row}, {column}] = {float(entries.data[worst])!r} is larger than its diagonal entries allow "
            f"({float(diagonal[first]):.6g} and {float(diagonal[second]):.6g}): some motion of these two rows has "
            f"a negative {name}",
            row,
        )
    own = np.flatnonzero(diagonal > 0.0)
    if own.size:
        place, pivot = _least_pivot(_scaled(matrix, own), NEGATIVE)
        if pivot <= 0.0:
            row = int(rows[own[place]])
            raise MatrixError(name, f": some motion that moves row {row} has a negative {name}", row)


def check_definite(matrix: csc_array, rows: np.ndarray) -> None:
    """Check that the stiffness holds every dof.

    Args:
        matrix: The symmetric stiffness matrix of the free dofs.
        rows: What each row is called in a message, shape (row,).

    Raises:
        MatrixError: Naming the row, and what may be wrong with it.
    """
    diagonal = matrix.diagonal()
    if (diagonal <= 0.0).any():
        worst = int(np.argmin(diagonal))
        row, value = int(rows[worst]), float(diagonal[worst])
        filled = np.diff(matrix.indptr)[worst] > 0
        why = "nothing holds this dof"
        if value < 0.0:
            why = "a negative spring"
        elif filled:
            why = "a constraint equation (Lagrange multiplier)? Eliminate constraints before the export"
        raise MatrixError("stiffness", f"[{row}, {row}] = {value!r}: must be above 0 on free dofs; {why}", row)
    place, pivot = _least_pivot(_scaled(matrix, np.arange(len(diagonal))), SHIFT)
    if pivot < LOOSE:
        row = int(rows[place])
        why = "is not held: support the track, or export the free dofs of the supported one"
        if pivot < -1e-9:
            why = "has a negative stiffness: constraint equations must be eliminated before the export"
        raise MatrixError(
            "stiffness", f" is not positive definite on the free dofs: some motion that moves row {row} {why}", row
        )


def _scaled(matrix: csc_array, rows: np.ndarray) -> csc_array:
    """Return the part of some rows and columns, scaled to a unit diagonal."""
    part = matrix[rows][:, rows]
    scale = diags_array(1.0 / np.sqrt(part.diagonal()))
    return csc_array(scale @ part @ scale)


def _least_pivot(matrix: csc_array, shift: float) -> tuple[int, float]:
    """Return the row of the least pivot of matrix + shift, eliminated symmetrically, and that pivot."""
    size = matrix.shape[0]
    shifted = csc_array(matrix + diags_array(np.full(size, shift)))
    try:
        factor = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return 0, 0.0
    order = np.empty(size, int)
    order[factor.perm_c] = np.arange(size)
    pivots: FloatArray = factor.U.diagonal()
    # A row taken out of turn stands for a pivot that was zero.
    swapped = np.flatnonzero(factor.perm_c != factor.perm_r)
    if swapped.size and pivots.min() > 0.0:
        return int(swapped[0]), 0.0
    worst = int(np.argmin(pivots))
    return int(order[worst]), float(pivots[worst])
