"""Rows of the track's tables times vectors, and shape values, in the kernels' order of operations."""

from typing import Any

import numpy as np

from tbatch.numerics.factorization import FactorisedTrack
from tbatch.numerics.pattern import Row
from tbatch.numerics.sparse_factorization import FactorisedSparse
from tbatch.numerics.sparse_rows import sparse_products
from tbatch.numerics.two_step import TwoStep
from tbatch.physics.line import Line


def shape_at(track: Line, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Element, local coordinate and shape values of a track at x, in the kernels' order of operations.

    Args:
        track: The track.
        x: Positions [m], shape (point,).

    Returns:
        Element, shape (point,); local coordinate [-], shape (point,); values of (w1, theta1, w2, theta2), (point, 4).
    """
    if track.imported is not None:
        return track.imported.rail.place(x)
    return hermite_at(x, track.element_length, track.element_count)


def hermite_at(x: np.ndarray, element_length: float, element_count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Element, local coordinate and Hermite values at x, in the kernels' order of operations.

    Args:
        x: Positions [m], shape (point,).
        element_length: [m].
        element_count: Number of elements.

    Returns:
        Element, shape (point,); local coordinate [-], shape (point,); Hermite values, shape (point, 4).
    """
    scaled = x / element_length
    element = np.clip(np.floor(scaled).astype(int), 0, element_count - 1)
    s = scaled - element
    shape = [
        1.0 - s * s * (3.0 - 2.0 * s),
        element_length * (s * (1.0 - s) * (1.0 - s)),
        s * s * (3.0 - 2.0 * s),
        element_length * (s * s * (s - 1.0)),
    ]
    return element, s, np.stack(shape, axis=1)


def first_load(
    track: FactorisedTrack | FactorisedSparse, scheme: TwoStep, u: np.ndarray, velocity: np.ndarray
) -> np.ndarray:
    """Load of substep 1 without contact forces, (4/h) [M ((2/h) u₀ + v₀) + C u₀].

    Args:
        track: The factorised track.
        scheme: The two-step scheme.
        u: Displacements u₀ [m, -], shape (node, dof).
        velocity: Velocities v₀ [m/s, 1/s], shape (node, dof).
    """
    if isinstance(track, FactorisedSparse):
        return sparse_products(track, 1, velocity, u)
    two_h, four_h = 2.0 / scheme.first, 4.0 / scheme.first
    return products(track, len(track.rows) - 1, four_h * (two_h * u + velocity), 0.0 - four_h * u)


def products(track: FactorisedTrack | FactorisedSparse, rate: int, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """M p - C q of the track, shape (node, dof) as p and q."""
    if isinstance(track, FactorisedSparse):
        return sparse_products(track, 0, p, q)
    if not track.node_dofs:
        return np.zeros_like(p)
    table, mass, damping = track.rows[rate][track.node_class].T, track.pattern.mass, track.pattern.damping
    following_p, previous_p = _shifted(p)
    following_q, previous_q = _shifted(q)
    result = np.empty_like(p)
    for r in range(p.shape[1]):
        ahead = row_product(table, mass.following[r], following_p.T) + row_product(
            table, damping.following[r], following_q.T
        )
        own = row_product(table, mass.own[r], p.T) + row_product(table, damping.own[r], q.T)
        behind = row_product(table, mass.previous[r], previous_p.T) + row_product(
            table, damping.previous[r], previous_q.T
        )
        # The first node has no node before it, and adding a zero could turn -0 into 0.
        result[:, r] = ahead + own
        result[1:, r] = result[1:, r] + behind[1:]
    return result


def _shifted(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The following and the previous node's values, zero beyond the ends."""
    following, previous = np.zeros_like(x), np.zeros_like(x)
    following[:-1], previous[1:] = x[1:], x[:-1]
    return following, previous


def row_product(values: Any, entries: Row, x: Any) -> Any:
    """Sum of coefficient times x over one row's entries, in two interleaved sums; numbers or arrays."""
    if not entries:
        return x[0] * 0.0
    sums = [values[place] * x[column] for place, column in entries[:2]]
    for number, (place, column) in enumerate(entries[2:]):
        sums[number % 2] = sums[number % 2] + values[place] * x[column]
    return sums[0] + sums[1] if len(sums) == 2 else sums[0]
