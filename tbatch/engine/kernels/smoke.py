"""A small kernel with everything that lane vectors need; run in a process of its own, as failure aborts it."""

import numpy as np
import taichi as ti

from tbatch.engine.aligned import aligned_zeros
from tbatch.engine.kernels.wheels import Four
from tbatch.engine.rows import LANES

Lanes = ti.types.vector(LANES, ti.f64)


@ti.kernel
def probe(x: ti.types.ndarray(Lanes, 2), table: ti.types.ndarray(Four, 1)):
    """Touch every kind of operation that the real kernels use."""
    ti.loop_config(block_dim=1)
    for b in range(x.shape[0]):
        held = [x[b, r] for r in ti.static(range(2))]
        held[0] = ti.select(held[0] < held[1], ti.sqrt(held[1]) / 2.0, 0.0 - held[0])
        for lane in range(LANES):
            gathered = Four(0.0)
            for place in range(2):
                gathered = gathered + table[place] * x[b, place][lane]
            x[b, 2][lane] = gathered[0] + gathered[3]
        x[b, 3] = ti.max(held[0], 0.0 - held[0]) + held[0].sum()


def smoke() -> bool:
    """Whether the kernel gives the right numbers."""
    x, table = aligned_zeros((2, 4, LANES)), aligned_zeros((2, 4))
    x[:, 0], x[:, 1] = 1.0, np.arange(LANES) ** 2
    table[:] = [[1.0, 0.0, 0.0, 2.0], [3.0, 0.0, 0.0, 4.0]]
    probe(x, table)
    root = np.where(np.arange(LANES) > 1, np.arange(LANES) / 2.0, -1.0)
    return bool(
        np.array_equal(x[1, 2], 3.0 + 7.0 * np.arange(LANES) ** 2)
        and np.array_equal(x[1, 3], np.abs(root) + root.sum())
    )
