"""A factorised track as the kernel takes it: tables for every kind of track, empty ones for what a kind has not."""

from typing import Any

import numpy as np

from tbatch.engine.aligned import aligned, aligned_zeros
from tbatch.engine.model import Model
from tbatch.numerics.sparse_factorization import FactorisedSparse


def kernel_tables(model: Model) -> tuple[np.ndarray, ...]:
    """The factorised track's tables for the kernel; a rigid track's are never read, but cannot be empty."""
    factor = model.factor
    if not factor.node_dofs:
        none = np.zeros(1, np.int32)
        return factor.rows, none, aligned_zeros((1, 1, 1, 4)), none, none
    if isinstance(factor, FactorisedSparse):
        # Every element is a class of its own; its window begins with two places for each rail node.
        none, elements = np.zeros(1, np.int32), np.arange(len(factor.near.rows), dtype=np.int32)
        return factor.rows, none, aligned(factor.near.columns), elements, 2 * factor.near.first
    return factor.rows, factor.node_class, aligned(factor.columns), factor.element_class, factor.window_start


def imported_tables(model: Model) -> tuple[Any, ...]:
    """What the kernel asks of an imported track beside; never read for other tracks, but it cannot be empty."""
    factor = model.factor
    if not isinstance(factor, FactorisedSparse):
        none, square = np.zeros(1, np.int32), np.zeros((1, 1), np.int32)
        return np.zeros(1), none, square, 0, square, none, np.zeros((1, 1, 1))
    rail, near = factor.rail, factor.near
    return rail.x, rail.row, near.rows, near.rail_places, factor.starts, factor.partner, factor.product
