"""Symmetric sparse matrices: tracks whose dofs follow no pattern."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, csc_matrix, diags_array

from tbatch.physics.quantities import FloatArray


@dataclass(frozen=True, eq=False)
class SparseSymmetric:
    """Symmetric sparse matrix with the methods of `BlockTridiagonal`: each row is a node of one dof.

    M, C and K of a track store the same places, zeros among them, so that what is computed from them entry by entry
    has one elimination pattern.
    """

    entries: csc_array
    """shape (row, row), both triangles"""

    @property
    def node_count(self) -> int:
        """Number of rows."""
        return self.entries.shape[0]

    @property
    def node_dofs(self) -> int:
        """One."""
        return 1

    def __add__(self, other: "SparseSymmetric") -> "SparseSymmetric":
        """Return the sum of two matrices that store the same places."""
        return self._with(self.entries.data + other.entries.data)

    def __mul__(self, factor: float) -> "SparseSymmetric":
        """Return the matrix times a number."""
        return self._with(self.entries.data * factor)

    __rmul__ = __mul__

    def pinned(self, dofs: np.ndarray, *, unit: float = 0.0) -> "SparseSymmetric":
        """Return the matrix with the rows and columns of some dofs zero.

        Args:
            dofs: true where a dof is pinned, shape (row, 1).
            unit: value put on the diagonal of the pinned dofs; 1 keeps an effective matrix regular.
        """
        held = dofs.ravel()
        column = np.repeat(np.arange(self.node_count), np.diff(self.entries.indptr))
        row = self.entries.indices
        values = np.where(held[row] | held[column], 0.0, self.entries.data)
        values[(row == column) & held[row]] = unit
        return self._with(values)

    def dot(self, u: np.ndarray) -> np.ndarray:
        """Return the product with `u`, shape (row, 1) or (row, 1, ...)."""
        return (self.entries @ u.reshape(self.node_count, -1)).reshape(u.shape)

    def to_csc(self) -> csc_matrix:
        """Return the matrix in compressed columns, without stored zeros."""
        kept = csc_matrix(self.entries, copy=True)
        kept.eliminate_zeros()
        return kept

    def _with(self, values: FloatArray) -> "SparseSymmetric":
        """Return the matrix with other values at the same places."""
        entries = self.entries
        return SparseSymmetric(csc_array((values, entries.indices, entries.indptr), shape=entries.shape))


def same_places(matrices: list[csc_array]) -> list[SparseSymmetric]:
    """Return symmetric matrices of one shape so that all store the places that any of them has, and the diagonal."""
    union = diags_array(np.ones(matrices[0].shape[0])).tocsc()
    for matrix in matrices:
        union = union + abs(matrix).tocsc()
    places = csc_array((np.zeros(union.nnz), union.indices, union.indptr), shape=union.shape)
    places.sort_indices()
    result = []
    column = np.repeat(np.arange(union.shape[0], dtype=np.int64), np.diff(places.indptr))
    keys = column * union.shape[0] + places.indices
    for matrix in matrices:
        coordinates = matrix.tocoo()
        values = np.zeros(len(keys))
        rows, columns = coordinates.coords
        wanted = columns.astype(np.int64) * union.shape[0] + rows
        values[np.searchsorted(keys, wanted)] = coordinates.data
        entries = csc_array((values, places.indices.copy(), places.indptr.copy()), shape=places.shape)
        result.append(SparseSymmetric(entries))
    return result
