"""K̂⁻¹ at the rail of an imported track, cut to the rows near each element that matter."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbatch.numerics.sparse_factor import SparseFactor
from tbatch.physics.imported.rail import RailNodes

COLUMN_TOLERANCE = 1e-12
"""Entries of K̂⁻¹ at the rail smaller than this fraction of the diagonal entries of their row and column, or of the
largest in their row, are left out."""
_ELEMENTS_AT_ONCE = 64
"""Elements whose columns are solved together: those of a large track do not all fit into memory."""


@dataclass(frozen=True, eq=False)
class NearRail:
    """Columns of K̂⁻¹ at the four rail dofs of each element; `rate` as in `FactorisedTrack`."""

    columns: np.ndarray
    """[m/N], shape (rate, element, place, 4)."""
    rows: np.ndarray
    """The row behind each place, int32, shape (element, place): rail nodes first, two rows a node."""
    first: np.ndarray
    """First rail node among an element's places, int32, shape (element,)."""
    rail_places: int
    """Places of rail nodes, the same number for each element."""

    @classmethod
    def of(cls, rail: RailNodes, factors: tuple[SparseFactor, ...]) -> "NearRail":
        """Solve for the columns and cut them."""
        dofs = (rail.row[:, None].astype(np.int64) + np.arange(2)).ravel()
        size = len(factors[0].pinned)
        # Rotations and displacements have different units: each column counts against its own diagonal.
        # The inverse of a pivot is a lower bound of the row's diagonal entry of K̂⁻¹.
        largest = np.stack([1.0 / np.sqrt(factor.pivot) for factor in factors])
        for _, columns, own in _parts(dofs, factors):
            np.maximum(largest, (np.abs(columns) / own[:, None]).max(axis=2), out=largest)
        node_of = np.full(size, -1)
        node_of[dofs] = np.arange(len(dofs)) // 2
        found = []
        for first, columns, own in _parts(dofs, factors):
            kept = (np.abs(columns) / own[:, None] > COLUMN_TOLERANCE * largest[:, :, None]).any(axis=0)
            for place in range(0, columns.shape[2] - 2, 2):
                wanted = np.flatnonzero(kept[:, place : place + 4].any(axis=1))
                element = first + place // 2
                nodes = np.append(node_of[wanted], [element, element + 1])
                low, high = int(nodes[nodes >= 0].min()), int(nodes.max())
                others = wanted[node_of[wanted] < 0]
                rows = np.concatenate([dofs[2 * low : 2 * high + 2], others])
                found.append((low, high, rows, columns[:, rows, place : place + 4]))
        return cls._arranged(found, dofs)

    @classmethod
    def _arranged(cls, found: list[tuple[int, int, np.ndarray, np.ndarray]], dofs: np.ndarray) -> "NearRail":
        """Give every element the same number of places.

        Args:
            found: for each element its first and last rail node, the rows of these and others, their columns.
            dofs: rows of all rail nodes, two a node.
        """
        width = 2 * max(high - low + 1 for low, high, _, _ in found)
        places = width + max(len(rows) - 2 * (high - low + 1) for low, high, rows, _ in found)
        places += places % 2
        first = np.array([min(low, len(dofs) // 2 - width // 2) for low, _, _, _ in found], np.int32)
        # Places that an element does not need multiply their row by zero.
        near = np.zeros((len(found), places), np.int32)
        columns = np.zeros((len(found[0][3]), len(found), places, 4))
        for element, (low, high, rows, values) in enumerate(found):
            own = 2 * (high - low + 1)
            ahead = 2 * (low - int(first[element]))
            near[element, :width] = dofs[2 * first[element] : 2 * first[element] + width]
            columns[:, element, ahead : ahead + own] = values[:, :own]
            near[element, width : width + len(rows) - own] = rows[own:]
            columns[:, element, width : width + len(rows) - own] = values[:, own:]
        return cls(columns, near, first, width)


def _parts(dofs: np.ndarray, factors: tuple[SparseFactor, ...]) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """The columns of some elements at a time.

    Yields:
        the first element; K̂⁻¹ at its nodes and the following ones, shape (rate, row, 2 node); the roots of its
        diagonal there, infinite for held dofs, shape (rate, 2 node).
    """
    size, elements = len(factors[0].pinned), len(dofs) // 2 - 1
    for first in range(0, elements, _ELEMENTS_AT_ONCE):
        part = dofs[2 * first : 2 * (first + _ELEMENTS_AT_ONCE + 1)]
        units = np.zeros((size, len(part)))
        units[part, np.arange(len(part))] = 1.0
        columns = np.stack([factor.solve(units) for factor in factors])
        own = np.sqrt(np.abs(columns[:, part, np.arange(len(part))]))
        yield first, columns, np.where(own > 0.0, own, np.inf)
