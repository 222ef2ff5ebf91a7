"""Sweeps and products of an imported track, in the kernels' order of operations."""

import numpy as np

from tbatch.numerics.sparse_factorization import BACKWARD, FORWARD, PRODUCTS, FactorisedSparse


def sparse_sweep(track: FactorisedSparse, rate: int, load: np.ndarray) -> np.ndarray:
    """K̂⁻¹ load, by the forward and backward sweep; shape (row, 1) as the load."""
    x = load.ravel().tolist()
    values, partner = track.rows[rate, 0].tolist(), track.partner.tolist()
    forward, backward = track.starts[FORWARD].tolist(), track.starts[BACKWARD].tolist()
    for row in range(len(x)):
        x[row] = x[row] + _entry_sum(values, partner, forward[row], forward[row + 1], x)
    for row in reversed(range(len(x))):
        x[row] = _entry_sum(values, partner, backward[row], backward[row + 1], x)
    return np.array(x)[:, None]


def sparse_products(track: FactorisedSparse, half: int, velocity: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """The next substep's load from what stands in the velocity's and the displacement's place; shape (row, 1)."""
    starts, (of_velocity, of_displacement) = track.starts[PRODUCTS], track.product[half]
    v, u = velocity.ravel(), displacement.ravel()
    count = np.diff(starts)
    sums = np.zeros((2, len(count)))
    for number in range(int(count.max(initial=0))):
        row = np.flatnonzero(count > number)
        entry = starts[row] + number
        partner = track.partner[entry]
        sums[number % 2, row] += of_velocity[entry] * v[partner] + of_displacement[entry] * u[partner]
    return (sums[0] + sums[1])[:, None]


def _entry_sum(values: list[float], partner: list[int], start: int, end: int, x: list[float]) -> float:
    """Sum of coefficient times partner, in two interleaved sums."""
    even = odd = 0.0
    for entry in range(start, end - 1, 2):
        even = even + values[entry] * x[partner[entry]]
        odd = odd + values[entry + 1] * x[partner[entry + 1]]
    if (end - start) % 2:
        even = even + values[end - 1] * x[partner[end - 1]]
    return even + odd
