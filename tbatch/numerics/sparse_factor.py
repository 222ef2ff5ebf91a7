"""K̂ of an imported track, factorised in the order in which its rows stand: K̂ = L D Lᵀ by SuperLU."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from tbatch.physics.sparse import SparseSymmetric


@dataclass(frozen=True, eq=False)
class SparseFactor:
    """L D Lᵀ of one symmetric positive definite sparse matrix; solutions vanish at pinned rows whatever the load."""

    lower: csr_array
    """L without its unit diagonal [-], shape (row, row), columns of a row rising"""
    pivot: np.ndarray
    """D [N/m], shape (row,)"""
    pinned: np.ndarray
    """true where a row is held, shape (row,)"""
    solver: Any = field(repr=False)

    @classmethod
    def of(cls, matrix: SparseSymmetric, pinned: np.ndarray) -> "SparseFactor":
        """Factorise a matrix.

        Args:
            matrix: The matrix [N/m].
            pinned: True where a row is held, shape (row, 1).

        Raises:
            ValueError: If the matrix is not positive definite on the free rows; names the row.
        """
        entries = matrix.pinned(pinned, unit=1.0).entries
        try:
            solver = splu(entries, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:
            raise ValueError("the track's matrix is singular: a dof is loose") from None
        # SuperLU renumbers the rows along its elimination tree. That changes no entry of the factor; in the old order
        # it is as triangular. It exchanges rows only where a pivot is zero.
        place = solver.perm_c
        pivot = solver.U.diagonal()[place]
        moved = np.flatnonzero(solver.perm_r != place)
        if moved.size or not (pivot > 0.0).all():
            row = int(moved[0]) if moved.size else int(np.argmin(pivot))
            raise ValueError(f"the track's matrix is not positive definite at its stepped row {row}: a dof is loose")
        lower = csr_array(csr_array(solver.L)[place][:, place])
        lower.setdiag(0.0)
        lower.eliminate_zeros()
        lower.sort_indices()
        return cls(lower, pivot, pinned.ravel(), solver)

    def solve(self, load: np.ndarray) -> np.ndarray:
        """Solve for any number of loads at once.

        Args:
            load: Right-hand sides [N], shape (row, ...).

        Returns:
            Displacements [m], shape of `load`.
        """
        columns = load.reshape(len(self.pinned), -1).copy()
        columns[self.pinned] = 0.0
        return self.solver.solve(columns).reshape(load.shape)
