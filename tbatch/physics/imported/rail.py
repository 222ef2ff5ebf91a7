"""The rail of an imported track: at which places it has nodes, and which rows move them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.quantities import FloatArray, array

HELD = -1
"""Stands for the row of a dof that is held and therefore not in the matrices."""


@dataclass(frozen=True, eq=False)
class RailNodes:
    """Rail nodes along the line, and the rows of a track's vectors that move them; nodes may stand at any distances.

    A node owns two rows, w and theta = dw/dx, one after the other. Where the matrices have no rotations the second row
    is a held one, and the shape between two nodes is a straight line.
    """

    x: FloatArray
    """places of the nodes, rising [m], shape (node,)"""
    row: np.ndarray
    """first of the two rows of each node, int32, shape (node,)"""
    linear: bool
    """true for straight shapes between the nodes, false for cubic Hermite ones"""

    def place(self, x: ArrayLike) -> tuple[np.ndarray, FloatArray, FloatArray]:
        """Return the element under each position, the local coordinate [-] and the shape values there.

        Operations stand in the order of the kernels. Positions beyond the ends continue the end elements.

        Args:
            x: positions [m], shape (point,).

        Returns:
            element, shape (point,); local coordinate, shape (point,); values of (w1, theta1, w2, theta2), (point, 4).
        """
        position = np.atleast_1d(np.asarray(x, dtype=np.float64))
        element = np.clip(np.searchsorted(self.x, position, side="right") - 1, 0, len(self.x) - 2)
        length = self.x[element + 1] - self.x[element]
        s = (position - self.x[element]) / length
        if self.linear:
            return element, s, np.stack([1.0 - s, 0.0 * s, s, 0.0 * s], axis=1)
        shape = [
            1.0 - s * s * (3.0 - 2.0 * s),
            length * (s * (1.0 - s) * (1.0 - s)),
            s * s * (3.0 - 2.0 * s),
            length * (s * s * (s - 1.0)),
        ]
        return element, s, np.stack(shape, axis=1)


@dataclass(frozen=True, eq=False)
class NodeMap:
    """A node map as given: where the rail has nodes, and the rows of the given matrices that move them."""

    x: FloatArray
    """[m], rising, shape (node,)"""
    w: np.ndarray
    """row of the vertical dof; HELD where it is not in the matrices, shape (node,)"""
    theta: np.ndarray | None
    """row of the rotation, likewise; None without rotations"""

    @classmethod
    def of(
        cls, x: ArrayLike, w: Sequence[int] | np.ndarray, theta: Sequence[int] | np.ndarray | None, rows: int
    ) -> "NodeMap":
        """Check a node map and sort it by place.

        Args:
            x: places [m], in any order.
            w: rows of the vertical dofs, from 0; -1 for a dof that is held and not in the matrices.
            theta: rows of the rotations, likewise; None without rotations.
            rows: number of rows of the matrices.

        Raises:
            ValueError: Naming the entry.
        """
        places = array("track.rail_x", x)
        if places.ndim != 1 or places.size < 2:
            raise ValueError(f"track.rail_x has shape {places.shape}: must be (node,), with at least two nodes [m]")
        given = [("rail_w", w)] + ([] if theta is None else [("rail_theta", theta)])
        columns = [_rows(f"track.{field}", value, places.size, rows) for field, value in given]
        together = np.concatenate(columns)
        named = [f"track.{field}[{node}]" for field, _ in given for node in range(places.size)]
        first: dict[int, int] = {}
        for entry, row in enumerate(together.tolist()):
            if row != HELD and row in first:
                raise ValueError(f"{named[entry]} = {row}: already taken by {named[first[row]]}; each row once")
            first[row] = entry
        order = np.argsort(places, kind="stable")
        gap = np.diff(places[order])
        if (gap <= 0.0).any():
            at = float(places[order][int(np.argmin(gap))])
            raise ValueError(f"track.rail_x = {at:g} m twice: rail nodes must stand at different places")
        return cls(places[order], columns[0][order], None if theta is None else columns[1][order])


def _rows(field: str, value: Sequence[int] | np.ndarray, count: int, rows: int) -> np.ndarray:
    given = np.asarray(value)
    if given.shape != (count,) or not np.issubdtype(given.dtype, np.integer):
        raise ValueError(f"{field}: {count} whole numbers are required, one for each of rail_x, from 0")
    wrong = np.flatnonzero((given < HELD) | (given >= rows))
    if wrong.size:
        at = int(wrong[0])
        raise ValueError(
            f"{field}[{at}] = {int(given[at])}: must be a row from 0 to {rows - 1}, or -1 for a dof that is held"
        )
    return given.astype(np.int64)
