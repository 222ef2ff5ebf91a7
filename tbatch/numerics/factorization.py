"""Each (track, step) factorised once, in the layout the kernels read.

A track ordered node by node has block tridiagonal K, C and M, hence a block tridiagonal effective matrix K̂. Its block
Cholesky elimination runs over the nodes i with pivots D and keeps two small dense blocks a node:

    D_i = K̂_ii - K̂_i,i-1 D_i-1⁻¹ K̂_i,i-1ᵀ          B_i = D_i⁻¹ K̂_i+1,iᵀ
    forward   t_i = D_i⁻¹ (b_i - K̂_i,i-1 t_i-1)     backward   x_i = t_i - B_i x_i+1

The pivots are factorised by SciPy; their explicit inverses turn a chain of divisions into independent products. Blocks
of the inverse follow from the same factors, offset by offset (Takahashi's recursion):

    (K̂⁻¹)_ii = D_i⁻¹ + B_i (K̂⁻¹)_i+1,i+1 B_iᵀ       (K̂⁻¹)_ij = -B_i (K̂⁻¹)_i+1,j   for j > i

They decay fast away from the diagonal; the radius is taken from the computed blocks.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from tbatch.numerics.pattern import RowPattern, classify, row_table
from tbatch.numerics.sparse_factor import SparseFactor
from tbatch.numerics.sparse_factorization import FactorisedSparse, factorise_sparse
from tbatch.numerics.two_step import TwoStep, effective
from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.line import Line, TrackMatrix

COLUMN_TOLERANCE = 1e-12
"""Blocks of K̂⁻¹ smaller than this fraction of its diagonal are left out of the columns."""


@dataclass(frozen=True, eq=False)
class BlockFactor:
    """Block Cholesky factors of one symmetric positive definite block tridiagonal matrix.

    Rows and columns of pinned dofs are zero in `pivot` and `back`, so that solutions vanish there whatever the load.
    """

    lower: np.ndarray
    """K̂_i,i-1 [N/m], shape (node, dof, dof); the first block is zero."""
    pivot: np.ndarray
    """D_i⁻¹ [m/N], shape (node, dof, dof)."""
    back: np.ndarray
    """B_i [-], shape (node, dof, dof); the last block is zero."""

    @classmethod
    def of(cls, diagonal: np.ndarray, lower: np.ndarray, pinned: np.ndarray) -> "BlockFactor":
        """Factorise a matrix.

        Args:
            diagonal: Diagonal blocks [N/m], shape (node, dof, dof), zero in the rows and columns of pinned dofs.
            lower: Blocks below the diagonal [N/m], shape (node, dof, dof); `lower[i]` couples node i to node i - 1.
            pinned: True where a dof is held, shape (node, dof).

        Raises:
            ValueError: If the matrix is not positive definite on the free dofs; names the node.
        """
        nodes, dofs, _ = diagonal.shape
        pivot, back = np.zeros_like(diagonal), np.zeros_like(diagonal)
        identity = np.eye(dofs)
        for node in range(nodes):
            block = diagonal[node] + np.diag(pinned[node].astype(float))
            if node:
                block = block - lower[node] @ back[node - 1]
            try:
                inverse = cho_solve(cho_factor(block, lower=True), identity)
            except LinAlgError:
                message = f"the track's matrix is not positive definite at node {node}: a dof is loose"
                raise ValueError(message) from None
            inverse = 0.5 * (inverse + inverse.T)
            inverse[pinned[node], :] = 0.0
            inverse[:, pinned[node]] = 0.0
            pivot[node] = inverse
            if node + 1 < nodes:
                back[node] = inverse @ lower[node + 1].T
        return cls(lower, pivot, back)

    def solve(self, load: np.ndarray) -> np.ndarray:
        """Solve for any number of loads at once.

        Args:
            load: Right-hand sides [N], shape (node, dof, ...).

        Returns:
            Displacements [m], shape of `load`.
        """
        solution = np.empty_like(load)
        previous = np.zeros_like(load[0])
        for node in range(len(load)):
            carried = load[node] - _product(self.lower[node], previous)
            previous = solution[node] = _product(self.pivot[node], carried)
        for node in range(len(load) - 2, -1, -1):
            solution[node] = solution[node] - _product(self.back[node], solution[node + 1])
        return solution

    def inverse_band(self, dofs: tuple[int, int], tolerance: float) -> list[np.ndarray]:
        """Blocks (K̂⁻¹)_i,i+k for k = 0, 1, ... until those that touch `dofs` fall below the tolerance.

        Args:
            dofs: Local dofs whose rows and columns will be used.
            tolerance: Size relative to the largest diagonal entries of its two dofs, below which a block is dropped.

        Returns:
            One array an offset k, blocks [m/N], shape (node - k, dof, dof).
        """
        nodes = len(self.pivot)
        diagonal = self.pivot.copy()
        for node in range(nodes - 2, -1, -1):
            diagonal[node] += self.back[node] @ diagonal[node + 1] @ self.back[node].T
        chosen = list(dofs)
        # Rotations and displacements have different units: each entry counts against the diagonal of its own two dofs.
        scale = np.sqrt(np.diagonal(diagonal, axis1=1, axis2=2).max(axis=0))
        scale[scale == 0.0] = np.inf
        relative = 1.0 / np.outer(scale, scale)
        band = [diagonal]
        while len(band) < nodes:
            block = -self.back[: nodes - len(band)] @ band[-1][1:]
            size = np.abs(block) * relative
            if max(size[:, chosen, :].max(), size[:, :, chosen].max()) <= tolerance:
                break
            band.append(block)
        return band


@dataclass(frozen=True, eq=False)
class FactorisedTrack:
    """Everything constant that a step of the track needs, by class of node and element.

    Nodes (elements) with equal coefficients share a class, so that a periodic track's tables stay in cache.
    The leading axis `rate` has one entry if both substeps share K̂, else two.
    """

    pattern: RowPattern
    """Where the non-zero coefficients stand in `rows`; plain hashable data, known at compile time."""
    rows: np.ndarray
    """Coefficients of the products and sweeps, shape (rate, class, coefficient)."""
    node_class: np.ndarray
    """Class of each node, int32, shape (node,)."""
    columns: np.ndarray
    """K̂⁻¹ of an element's four rail dofs [m/N], shape (rate, class, window row, 4)."""
    element_class: np.ndarray
    """Class of each element in `columns`, int32, shape (element,)."""
    window_start: np.ndarray
    """First row (node * dofs) of each element's window, int32, shape (element,)."""
    factors: tuple[BlockFactor, ...] = field(repr=False)
    """The factors behind the tables, one a rate."""

    @property
    def node_dofs(self) -> int:
        """Degrees of freedom of a node; 0 for a rigid track."""
        return self.pattern.dofs

    @property
    def window_rows(self) -> int:
        """Rows of K̂⁻¹ kept around an element."""
        return self.columns.shape[2]


def _product(block: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Block times x, column by column, so that the bits do not depend on how many x there are."""
    block = block.reshape(block.shape + (1,) * (x.ndim - 1))
    total = block[:, 0] * x[0]
    for column in range(1, len(x)):
        total = total + block[:, column] * x[column]
    return total


def factor_of(matrix: TrackMatrix, pinned: np.ndarray) -> BlockFactor | SparseFactor:
    """Factorise a track's matrix of either form.

    Args:
        matrix: The matrix [N/m].
        pinned: True where a dof is held, shape (node, dof).

    Raises:
        ValueError: If the matrix is not positive definite on the free dofs; names the node.
    """
    if isinstance(matrix, BlockTridiagonal):
        return BlockFactor.of(matrix.diagonal, matrix.lower, pinned)
    return SparseFactor.of(matrix, pinned)


@lru_cache(maxsize=8)
def factorise(track: Line, scheme: TwoStep) -> FactorisedTrack | FactorisedSparse:
    """Factorise a track for one step length; the last few stay known, for models that differ in other things only.

    Args:
        track: The track; a rigid one gives empty tables.
        scheme: The two-step scheme with its step.

    Raises:
        ValueError: If an effective matrix is not positive definite.
    """
    if track.node_dofs == 0:
        empty, rates = np.zeros(0, np.int32), len(scheme.rates)
        rows, columns = np.zeros((rates, 1, 1)), np.zeros((rates, 1, 0, 4))
        return FactorisedTrack(RowPattern.empty(), rows, empty, columns, empty, empty, factors=())
    stiffness, damping, mass = track.stiffness, track.damping, track.mass
    if not (
        isinstance(stiffness, BlockTridiagonal)
        and isinstance(damping, BlockTridiagonal)
        and isinstance(mass, BlockTridiagonal)
    ):
        return factorise_sparse(track, scheme)
    factors = []
    for rate in scheme.rates:
        diagonal = effective(stiffness.diagonal, damping.diagonal, mass.diagonal, rate)
        lower = effective(stiffness.lower, damping.lower, mass.lower, rate)
        factors.append(BlockFactor.of(diagonal, lower, track.pinned))
    pattern, rows, node_class = row_table(mass, damping, factors)
    columns, element_class, window_start = _rail_columns(factors, track.layers["rail"])
    return FactorisedTrack(pattern, rows, node_class, columns, element_class, window_start, factors=tuple(factors))


def _rail_columns(factors: list[BlockFactor], rail: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns of K̂⁻¹ at the rail dofs of each element, cut to one window width and grouped in classes."""
    bands = [factor.inverse_band(rail, COLUMN_TOLERANCE) for factor in factors]
    nodes, dofs, _ = factors[0].pivot.shape
    elements = nodes - 1
    radius = max(len(band) for band in bands) - 1
    width = min(2 * radius + 2, nodes)
    window_node = np.clip(np.arange(elements) - radius, 0, nodes - width)
    columns = np.zeros((len(factors), elements, width, dofs, 4))
    for rate, band in enumerate(bands):
        for end in range(2):
            column = np.arange(elements) + end
            entries = slice(2 * end, 2 * end + 2)
            for offset, blocks in enumerate(band):
                # blocks[i] couples node i to node i + offset: above the column's node, and transposed below it.
                place = column - offset - window_node
                held = np.flatnonzero((place >= 0) & (column >= offset))
                columns[rate, held, place[held], :, entries] = blocks[column[held] - offset][:, :, list(rail)]
                place = column + offset - window_node
                held = np.flatnonzero((place < width) & (column + offset < nodes))
                columns[rate, held, place[held], :, entries] = blocks[column[held]].transpose(0, 2, 1)[:, :, list(rail)]
    # Far entries are round-off of near ones: they are compared on the scale of the largest of their kind.
    largest = np.broadcast_to(np.abs(columns).max(axis=(1, 2), keepdims=True), columns.shape)[:, 0].ravel()
    columns = columns.reshape(len(factors), elements, width * dofs, 4)
    element_class, first = classify(columns.swapaxes(0, 1).reshape(elements, -1), largest)
    return np.ascontiguousarray(columns[:, first]), element_class, (window_node * dofs).astype(np.int32)
