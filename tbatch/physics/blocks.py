"""Symmetric block tridiagonal matrices: a track ordered node by node."""

from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from tbatch.physics.quantities import FloatArray


@dataclass(frozen=True, eq=False)
class BlockTridiagonal:
    """Symmetric matrix whose node i meets the nodes i-1, i and i+1 only.

    The dofs of node i are the rows i m ... i m + m - 1. The block of node i towards node i+1 is `lower[i + 1].T`.
    """

    diagonal: FloatArray
    """coupling of each node with itself, shape (node, m, m)"""
    lower: FloatArray
    """coupling of each node with the node before it, shape (node, m, m); lower[0] is zero"""

    def __post_init__(self) -> None:
        """Check the shapes."""
        shape = self.diagonal.shape
        if len(shape) != 3 or shape[1] != shape[2] or self.lower.shape != shape:
            raise ValueError(f"diagonal {shape} and lower {self.lower.shape}: both must be (node, m, m)")

    @classmethod
    def zeros(cls, node_count: int, node_dofs: int) -> "BlockTridiagonal":
        """Return the zero matrix."""
        shape = (node_count, node_dofs, node_dofs)
        return cls(np.zeros(shape), np.zeros(shape))

    @classmethod
    def from_elements(cls, elements: ArrayLike, element_count: int) -> "BlockTridiagonal":
        """Assemble a chain of two-node elements.

        Args:
            elements: element matrices, shape (element, 2m, 2m), or one (2m, 2m) for all; first node first.
            element_count: number of elements; there is one node more.
        """
        matrices = np.asarray(elements, dtype=np.float64)
        m = matrices.shape[-1] // 2
        matrices = np.broadcast_to(matrices, (element_count, 2 * m, 2 * m))
        chain = cls.zeros(element_count + 1, m)
        chain.diagonal[:-1] += matrices[:, :m, :m]
        chain.diagonal[1:] += matrices[:, m:, m:]
        chain.lower[1:] += matrices[:, m:, :m]
        return chain

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return self.diagonal.shape[0]

    @property
    def node_dofs(self) -> int:
        """Number m of dofs of a node."""
        return self.diagonal.shape[1]

    def __add__(self, other: "BlockTridiagonal") -> "BlockTridiagonal":
        """Return the sum of two matrices of the same layout."""
        return BlockTridiagonal(self.diagonal + other.diagonal, self.lower + other.lower)

    def __mul__(self, factor: float) -> "BlockTridiagonal":
        """Return the matrix times a number."""
        return BlockTridiagonal(self.diagonal * factor, self.lower * factor)

    __rmul__ = __mul__

    def pinned(self, dofs: np.ndarray, *, unit: float = 0.0) -> "BlockTridiagonal":
        """Return the matrix with the rows and columns of some dofs zero.

        Args:
            dofs: true where a dof is pinned, shape (node, m).
            unit: value put on the diagonal of the pinned dofs; 1 keeps an effective matrix regular.
        """
        free = np.where(dofs, 0.0, 1.0)
        diagonal = self.diagonal * free[:, :, None] * free[:, None, :]
        lower = self.lower.copy()
        lower[1:] *= free[1:, :, None] * free[:-1, None, :]
        node, dof = np.nonzero(dofs)
        diagonal[node, dof, dof] = unit
        return BlockTridiagonal(diagonal, lower)

    def dot(self, u: np.ndarray) -> np.ndarray:
        """Return the product with `u`, shape (node, m) or (node, m, ...)."""
        columns = u.reshape(*u.shape[:2], prod(u.shape[2:]))
        product = self.diagonal @ columns
        product[1:] += self.lower[1:] @ columns[:-1]
        product[:-1] += self.lower[1:].transpose(0, 2, 1) @ columns[1:]
        return product.reshape(u.shape)

    def to_csc(self) -> sparse.csc_matrix:
        """Return the matrix in compressed columns, without stored zeros."""
        n, m = self.node_count, self.node_dofs
        if m == 0:
            return sparse.csc_matrix((0, 0))
        node, row, column = np.meshgrid(np.arange(n) * m, np.arange(m), np.arange(m), indexing="ij")
        i, j = node + row, node + column
        below = (i[1:], j[1:] - m)
        rows = np.concatenate([part.ravel() for part in (i, below[0], below[1])])
        columns = np.concatenate([part.ravel() for part in (j, below[1], below[0])])
        values = np.concatenate([self.diagonal.ravel(), self.lower[1:].ravel(), self.lower[1:].ravel()])
        kept = values != 0.0
        return sparse.csc_matrix((values[kept], (rows[kept], columns[kept])), shape=(n * m, n * m))

    def banded(self) -> FloatArray:
        """Return SciPy's lower banded form, shape (2m, node m): entry (i, j) of the matrix at [i - j, j]."""
        n, m = self.node_count, self.node_dofs
        band = np.zeros((2 * m, n * m))
        first = np.arange(n) * m
        for column in range(m):
            for row in range(column, m):
                band[row - column, first + column] = self.diagonal[:, row, column]
            for row in range(m):
                band[m + row - column, first[:-1] + column] = self.lower[1:, row, column]
        return band
