"""A matrix as a file holds it, and how its entries are put together."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

MOST_ROWS = 5_000_000
"""Larger matrices are refused: a file's header must not decide how much memory is taken."""

Label = tuple[int, int]
"""Node number and dof number of a row: 1-3 displacements along x, y, z, 4-6 rotations about them."""

DOF_NAMES = {1: "UX", 2: "UY", 3: "UZ", 4: "ROTX", 5: "ROTY", 6: "ROTZ"}


@dataclass(frozen=True, eq=False)
class FileMatrix:
    """A square matrix as read from a file, in the file's units and signs."""

    path: str
    """The file, with the matrix's name where the file has several."""
    matrix: sparse.csc_matrix
    """Entries, shape (row, row)."""
    labels: tuple[Label, ...] | None = None
    """Node and dof of each row; None where the file does not say."""
    stated: bool = True
    """Whether the file states its size; else rows after the last entry are not known of."""

    @property
    def size(self) -> int:
        """Number of rows."""
        return int(self.matrix.shape[0])

    def with_rows(self, size: int) -> "FileMatrix":
        """Return the matrix with empty rows and columns appended up to a size."""
        entries = self.matrix.tocoo()
        matrix = sparse.csc_matrix((entries.data, (entries.row, entries.col)), shape=(size, size))
        return replace(self, matrix=matrix)

    def sorted_as(self, labels: Sequence[Label]) -> "FileMatrix":
        """Return the matrix with the rows of some labels, in their order; those it lacks are empty.

        Args:
            labels: All labels of this matrix, and more.
        """
        place = {label: row for row, label in enumerate(labels)}
        at = np.array([place[label] for label in self.labels or ()], dtype=np.int64)
        entries = self.matrix.tocoo()
        shape = (len(labels), len(labels))
        matrix = sparse.csc_matrix((entries.data, (at[entries.row], at[entries.col])), shape=shape)
        return replace(self, matrix=matrix, labels=tuple(labels))


def assemble(
    path: str,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    values: NDArray[np.float64],
    size: int,
    *,
    half: bool,
    named: Callable[[int], str],
) -> sparse.csc_matrix:
    """Put the entries of a file together, each of which may stand there once.

    A file that holds one half of a symmetric matrix says nothing of which: codes order their equations by more than
    node numbers, so "lower" there may be either side here. The mirror is added where no entry has its mirror in the
    file; else the file is taken to hold the whole matrix, as it stands.

    Args:
        path: The file, for messages.
        rows: Row of each entry from 0, shape (entry,).
        columns: Column of each entry from 0, shape (entry,).
        values: Values, shape (entry,).
        size: Number of rows and columns.
        half: Whether the file may hold one half only.
        named: Returns how to name an entry, given its index.
    """
    if not (finite := np.isfinite(values)).all():
        raise ValueError(f"{path}, {named(int(np.argmin(finite)))}: {values[~finite][0]} is not a finite number")
    order = np.lexsort((rows, columns))
    repeated = np.flatnonzero((np.diff(rows[order]) == 0) & (np.diff(columns[order]) == 0))
    if repeated.size:
        first, second = sorted((int(order[repeated[0]]), int(order[repeated[0] + 1])))
        raise ValueError(f"{path}, {named(second)}: the same entry stands at {named(first)}")
    shape = (size, size)
    matrix = sparse.csc_matrix((values, (rows, columns)), shape=shape)
    aside = rows != columns
    if half and aside.any():
        pattern = sparse.csc_matrix((np.ones(aside.sum()), (rows[aside], columns[aside])), shape=shape)
        if pattern.multiply(pattern.T).nnz == 0:
            mirror = sparse.csc_matrix((values[aside], (columns[aside], rows[aside])), shape=shape)
            matrix = sparse.csc_matrix(matrix + mirror)
    return matrix


def shown_label(label: Label) -> str:
    """Return a label in words, such as ``node 12 dof 3 (UZ)``."""
    node, dof = label
    return f"node {node} dof {dof}" + (f" ({DOF_NAMES[dof]})" if dof in DOF_NAMES else "")
