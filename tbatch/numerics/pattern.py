"""Which coefficients a node's rows have, and which nodes share them.

The kernels unroll the rows of one node. Which entries are non-zero is plain Python data, known when they are compiled;
the numbers stand in one table, a line a class of equal nodes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tbatch.physics.blocks import BlockTridiagonal

if TYPE_CHECKING:
    from tbatch.numerics.factorization import BlockFactor

Row = tuple[tuple[int, int], ...]
"""(Place in the table, column in the block) of a row's non-zero coefficients."""
Rows = tuple[Row, ...]
"""The rows of a node."""

CLASS_TOLERANCE = 4e-15
"""Coefficients that differ by less than this fraction of the largest are the same: round-off of the elimination."""


@dataclass(frozen=True)
class Stencil:
    """The three blocks of a block row: own node i, previous node i - 1, next node i + 1."""

    own: Rows
    previous: Rows
    following: Rows


@dataclass(frozen=True)
class RowPattern:
    """Non-zero pattern of one node's rows; hashable, so that it can select a compiled kernel."""

    dofs: int
    mass: Stencil
    """Coefficients of M."""
    damping: Stencil
    """Coefficients of -C."""
    lower: Rows
    """Coefficients of -K̂_i,i-1, which carry the forward sweep from node to node."""
    pivot: Rows
    """Coefficients of D_i⁻¹."""
    back: Rows
    """Coefficients of -B_i, which carry the backward sweep."""
    sparse: bool = False
    """An imported track's rows have no common pattern."""
    linear: bool = False
    """Straight shapes between the rail nodes, instead of cubic ones."""

    @classmethod
    def empty(cls) -> "RowPattern":
        """The pattern of a track without dofs."""
        none = Stencil((), (), ())
        return cls(0, none, none, (), (), ())


class _Table:
    """Collects coefficients column by column while the pattern is drawn up."""

    def __init__(self) -> None:
        self.columns: list[np.ndarray] = []

    def rows(self, blocks: np.ndarray) -> Rows:
        """Enter blocks of shape (rate, node, dof, dof); entries that are zero at every node are left out."""
        used = np.abs(blocks).max(axis=(0, 1)) > 0.0
        rows = []
        for row in range(blocks.shape[2]):
            entries = []
            for column in np.flatnonzero(used[row]):
                entries.append((len(self.columns), int(column)))
                self.columns.append(blocks[:, :, row, column])
            rows.append(tuple(entries))
        return tuple(rows)

    def stencil(self, diagonal: np.ndarray, lower: np.ndarray, factor: float, rates: int) -> Stencil:
        """Enter the three blocks of each block row of one matrix, scaled."""
        upper = np.zeros_like(lower)
        upper[:-1] = lower[1:].transpose(0, 2, 1)
        own, previous, following = (
            self.rows(np.repeat(factor * blocks[None], rates, axis=0)) for blocks in (diagonal, lower, upper)
        )
        return Stencil(own, previous, following)


def row_table(
    mass: BlockTridiagonal, damping: BlockTridiagonal, factors: "Sequence[BlockFactor]"
) -> tuple[RowPattern, np.ndarray, np.ndarray]:
    """Draw up the pattern, the coefficients and the node classes of a factorised track.

    Args:
        mass: M of the track.
        damping: C.
        factors: Its factors, one a rate.

    Returns:
        The pattern; the coefficients, shape (rate, class, coefficient); the class of each node, int32, shape (node,).
    """
    table, rates = _Table(), len(factors)
    pattern = RowPattern(
        dofs=mass.node_dofs,
        mass=table.stencil(mass.diagonal, mass.lower, 1.0, rates),
        damping=table.stencil(damping.diagonal, damping.lower, -1.0, rates),
        lower=table.rows(-np.stack([factor.lower for factor in factors])),
        pivot=table.rows(np.stack([factor.pivot for factor in factors])),
        back=table.rows(-np.stack([factor.back for factor in factors])),
    )
    coefficients = np.stack(table.columns, axis=2)
    nodes = coefficients.shape[1]
    lines = coefficients.swapaxes(0, 1).reshape(nodes, -1)
    node_class, first = classify(lines, np.abs(lines).max(axis=0))
    return pattern, np.ascontiguousarray(coefficients[:, first]), node_class


def classify(lines: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Group equal lines, to round-off.

    Args:
        lines: One line of numbers an item, shape (item, number).
        scale: Size against which a difference counts, shape (number,).

    Returns:
        The class of each item, int32, shape (item,), and the first item of each class, shape (class,).
    """
    allowed = CLASS_TOLERANCE * scale
    item_class = np.zeros(len(lines), np.int32)
    first: list[int] = []
    for item, line in enumerate(lines):
        if first:
            equal = (np.abs(lines[first] - line) <= allowed).all(axis=1)
            if equal.any():
                item_class[item] = np.argmax(equal)
                continue
        item_class[item] = len(first)
        first.append(item)
    return item_class, np.asarray(first)
