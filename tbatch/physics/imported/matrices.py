"""From the matrices of finite element software to those of a track that is stepped.

Held dofs and dofs that the rail never moves are taken out, the rest is checked and put in an order that keeps the
factor small.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, diags_array

from tbatch.physics.imported.checks import GivenMatrix, accept_matrix, check_definite, check_not_negative
from tbatch.physics.imported.order import elimination_order, reached
from tbatch.physics.imported.rail import HELD, NodeMap, RailNodes
from tbatch.physics.quantities import positive
from tbatch.physics.sparse import SparseSymmetric, same_places

PENALTY = 1e30
"""A stiffness diagonal from here on stands for a support: Abaqus writes 1e36 for a boundary condition."""


@dataclass(frozen=True, eq=False)
class ImportedMatrices:
    """A track's matrices in the order in which they are stepped."""

    mass: SparseSymmetric
    damping: SparseSymmetric
    stiffness: SparseSymmetric
    rail: RailNodes
    pinned: np.ndarray
    """true for rows that stand for held dofs of rail nodes, shape (row, 1)"""
    given_row: np.ndarray
    """row of the given matrices behind each row; -1 where it stands for a held dof, shape (row,)"""
    given_count: int
    """rows of the given matrices"""
    held_count: int
    """rows of the given matrices that are held: empty in all three, or with a support's stiffness"""
    apart_count: int
    """rows that no chain of couplings joins to the rail"""
    massless_count: int
    """rows that are stepped and have no mass"""
    downward: bool
    """whether the rail's rotations came as dw/dx; false: as -dw/dx, and were turned round"""

    @classmethod
    def of(
        cls,
        mass: GivenMatrix,
        damping: GivenMatrix,
        stiffness: GivenMatrix,
        rail_x: ArrayLike,
        rail_w: Sequence[int] | np.ndarray,
        rail_theta: Sequence[int] | np.ndarray | None,
    ) -> "ImportedMatrices":
        """Check the matrices and the node map and put them in order.

        Raises:
            MatrixError: Naming the matrix and the entry.
            ValueError: If the node map does not fit.
        """
        M = accept_matrix("mass", mass)
        count = M.shape[0]
        C, K = accept_matrix("damping", damping, count), accept_matrix("stiffness", stiffness, count)
        nodes = NodeMap.of(rail_x, rail_w, rail_theta, count)
        pattern = csc_array(abs(M) + abs(C) + abs(K))
        held = (np.diff(pattern.indptr) == 0) | (K.diagonal() >= PENALTY)
        w, theta = (rows if rows is None else _unless(rows, held) for rows in (nodes.w, nodes.theta))
        assert w is not None
        if (w == HELD).all():
            raise ValueError("track.rail_w: every rail node is held; at least one must be able to move")
        if theta is not None and (theta == HELD).all():
            raise ValueError(
                "track.rail_theta: no rotation can move, they are held or their rows are empty; a rail without "
                "rotations, as of solid elements, has rail_theta = None"
            )
        free = np.flatnonzero(~held)
        new = np.full(count, HELD)
        new[free] = np.arange(len(free))
        joined = reached(csc_array(pattern[free][:, free]), new[w[w != HELD]])
        kept = free[joined]
        for name, matrix in (("mass", M), ("damping", C)):
            part = csc_array(matrix[free][:, free])
            check_not_negative(name, part, free)
        M, C, K = (csc_array(part[kept][:, kept]) for part in (M, C, K))
        check_definite(K, kept)
        new[:] = HELD
        new[kept] = np.arange(len(kept))
        w = _renumbered(w, new)
        theta = None if theta is None else _renumbered(theta, new)
        downward = theta is None or not _upward(K, w, theta)
        if theta is not None and not downward:
            sign = np.ones(len(kept))
            sign[theta[theta != HELD]] = -1.0
            M, C, K = (csc_array(diags_array(sign) @ part @ diags_array(sign)) for part in (M, C, K))
        old, first = _ordered(csc_array(abs(M) + abs(C) + abs(K)), w, theta)
        M, C, K = (_spread(part, old) for part in (M, C, K))
        mass_, damping_, stiffness_ = same_places([M, C, K])
        pinned = (old == HELD)[:, None]
        pinned.setflags(write=False)
        return cls(
            mass=mass_,
            damping=damping_,
            stiffness=stiffness_,
            rail=RailNodes(nodes.x, first.astype(np.int32), linear=theta is None),
            pinned=pinned,
            given_row=np.where(old == HELD, HELD, kept[old]),
            given_count=count,
            held_count=int(held.sum()),
            apart_count=len(free) - len(kept),
            massless_count=int((M.diagonal() == 0.0).sum() - pinned.sum()),
            downward=downward,
        )

    def line(self, rail_EI: float | None) -> dict[str, Any]:
        """Return what a `Line` takes from the matrices.

        Args:
            rail_EI: bending stiffness of the rail [N m2]; None if the local rail compliance is to be left out.

        Raises:
            ValueError: If the rail has no rotations and yet a bending stiffness.
        """
        if rail_EI is not None and self.rail.linear:
            raise ValueError(
                f"track.rail_EI = {rail_EI!r}: the local rail compliance belongs to cubic shapes, which need "
                "rail_theta; without rotations rail_EI must be None"
            )
        return {
            "length": float(self.rail.x[-1] - self.rail.x[0]),
            "element_count": len(self.rail.x) - 1,
            "mass": self.mass,
            "damping": self.damping,
            "stiffness": self.stiffness,
            "pinned": self.pinned,
            "rail_EI": None if rail_EI is None else positive("track.rail_EI", rail_EI, "N m2"),
        }

    def describe_rows(self, rail_EI: float | None) -> list[tuple[str, str]]:
        """Return the import's facts as (label, text)."""
        gap = np.diff(self.rail.x)
        spacing = f"{gap.mean():g}" if np.ptp(gap) <= 1e-9 * gap.mean() else f"{gap.min():g} to {gap.max():g}"
        stepped = self.given_count - self.held_count - self.apart_count
        left = [
            f"{number} {what}"
            for number, what in (
                (self.held_count, "held"),
                (self.apart_count, "never moved by the rail"),
                (self.massless_count, "of the stepped ones without mass"),
            )
            if number
        ]
        shape = "straight lines between the nodes" if self.rail.linear else "cubic, with the rail's rotations"
        if not self.downward:
            shape += "; given as -dw/dx and turned round"
        supports = self.rail.x[self.pinned[self.rail.row, 0]]
        if supports.size:
            shape += f"; held at x = {', '.join(f'{x:g}' for x in supports)} m"
        return [
            ("track rail", f"{len(self.rail.x)} nodes, {spacing} m apart; {shape}"),
            ("track dofs", ", ".join([f"{self.given_count} given, {stepped} stepped", *left])),
        ]


def _unless(rows: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return rows with those that are held marked so."""
    return np.where(rows == HELD, HELD, np.where(held[rows], HELD, rows))


def _renumbered(rows: np.ndarray, new: np.ndarray) -> np.ndarray:
    return np.where(rows == HELD, HELD, new[rows])


def _upward(stiffness: csc_array, w: np.ndarray, theta: np.ndarray) -> bool:
    """Return whether the rail's rotations are -dw/dx, as those about the y axis are where w is along z.

    A beam element couples w of its first and theta of its second node by +6EI/l² if theta is dw/dx.
    """
    bent = turned = 0.0
    for first in range(len(w) - 1):
        for near, far, sign in ((w[first], theta[first + 1], 1.0), (w[first + 1], theta[first], -1.0)):
            if near != HELD and far != HELD:
                value = sign * float(stiffness[near, far])
                bent, turned = bent + value, turned + abs(value)
    return bent < -0.5 * turned


def _ordered(pattern: csc_array, w: np.ndarray, theta: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the old row behind each new one (HELD for none) and the first row of each rail node.

    The two rows of a rail node stand one after the other; held ones are made up.
    """
    count, nodes = pattern.shape[0], len(w)
    theta = np.full(nodes, HELD) if theta is None else theta
    node_of = np.full(count, HELD)
    for rows in (w, theta):
        moves = rows != HELD
        node_of[rows[moves]] = np.flatnonzero(moves)
    others = np.flatnonzero(node_of == HELD)
    # Groups: the rail nodes that move, then the other rows one by one.
    moving = np.unique(node_of[node_of != HELD])
    group = np.empty(count, int)
    group[node_of != HELD] = np.searchsorted(moving, node_of[node_of != HELD])
    group[others] = len(moving) + np.arange(len(others))
    order = elimination_order(pattern, group)
    old: list[int] = []
    first = np.zeros(nodes, int)
    still = np.setdiff1d(np.arange(nodes), moving)
    for entry in [*(int(node) - nodes for node in still), *order.tolist()]:
        node = int(moving[entry]) if 0 <= entry < len(moving) else entry + nodes if entry < 0 else HELD
        if node == HELD:
            old.append(int(others[entry - len(moving)]))
        else:
            first[node] = len(old)
            old += [int(w[node]), int(theta[node])]
    return np.array(old), first


def _spread(matrix: csc_array, old: np.ndarray) -> csc_array:
    """Return a matrix with its rows and columns in a new order, empty ones where there is no old row."""
    new = np.empty(matrix.shape[0], int)
    moves = np.flatnonzero(old != HELD)
    new[old[moves]] = moves
    entries = matrix.tocoo()
    rows, columns = entries.coords
    return csc_array((entries.data, (new[rows], new[columns])), shape=(len(old), len(old)))
