"""The wheels on the rail where all lanes of a block keep the same course: same speed, start, wheel offsets and length.

Then every lane has its wheels on the same elements, one lane's geometry serves all, and what `wheels` does lane by lane
is done for all lanes at once: the same operations in the same order, hence the same bits.
"""

import taichi as ti

from tbatch.engine.kernels.wheels import local_compliance, rail_flexibility, rail_row
from tbatch.engine.rows import ELEMENT, MARKS, PER_WHEEL


@ti.func
def rail_value_lockstep(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), rail_rows: ti.template(),
    vector: ti.template(), b, j, below,
):  # fmt: skip
    """N times the dofs of `vector` under wheel j, all lanes: the rail's, or those `below` rows after them."""
    element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, 0]
    row = rail_row(pattern, rail_rows, element) + below
    far = rail_row(pattern, rail_rows, element + 1) + below
    n = at.shape + 4 * j
    return (memory[b, n][0] * vector[b, row] + memory[b, n + 1][0] * vector[b, row + 1]) + (
        memory[b, n + 2][0] * vector[b, far] + memory[b, n + 3][0] * vector[b, far + 1]
    )


@ti.func
def push_rail_lockstep(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), rail_rows: ti.template(),
    load: ti.template(), b,
):  # fmt: skip
    """Add Nᵀ F to the track's load, all lanes."""
    for j in range(at.wheels):
        element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, 0]
        row = rail_row(pattern, rail_rows, element)
        far = rail_row(pattern, rail_rows, element + 1)
        n = at.shape + 4 * j
        force = memory[b, at.force + j]
        load[b, row] = load[b, row] + memory[b, n][0] * force
        load[b, row + 1] = load[b, row + 1] + memory[b, n + 1][0] * force
        load[b, far] = load[b, far] + memory[b, n + 2][0] * force
        load[b, far + 1] = load[b, far + 1] + memory[b, n + 3][0] * force


@ti.func
def gather_rail_lockstep(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), near: ti.template(), load: ti.template(), rate, b, j,
):  # fmt: skip
    """N K̂⁻¹ load under wheel j, all lanes; four columns times as many interleaved sums as `gather_rail` has."""
    element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, 0]
    kind = element_class[element]
    first = window_start[element]
    chains = ti.static(2 if pattern.sparse else pattern.dofs // 2)
    zero = load[b, 0] * 0.0
    sums = [zero for _ in ti.static(range(4 * chains))]
    if ti.static(pattern.sparse):
        for pair in range(columns.shape[2] // 2):
            for half in ti.static(range(2)):
                value = load[b, near[element, 2 * pair + half]]
                for k in ti.static(range(4)):
                    sums[4 * half + k] = sums[4 * half + k] + columns[rate, kind, 2 * pair + half][k] * value
    else:
        for node in range(columns.shape[2] // pattern.dofs):
            for r in ti.static(range(pattern.dofs)):
                value = load[b, first + node * pattern.dofs + r]
                for k in ti.static(range(4)):
                    sums[4 * (r % chains) + k] = (
                        sums[4 * (r % chains) + k] + columns[rate, kind, node * pattern.dofs + r][k] * value
                    )
    y = [sums[k] for k in ti.static(range(4))]
    for chain in ti.static(range(1, chains)):
        for k in ti.static(range(4)):
            y[k] = y[k] + sums[4 * chain + k]
    n = at.shape + 4 * j
    return (memory[b, n][0] * y[0] + memory[b, n + 1][0] * y[1]) + (
        memory[b, n + 2][0] * y[2] + memory[b, n + 3][0] * y[3]
    )


@ti.func
def flexibilities_lockstep(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), rail_x: ti.template(), rail_places, rate, b,
    element_length, compliance,
):  # fmt: skip
    """The track's share of H with the local rail compliance, on and below the diagonal, all lanes."""
    for i in range(at.wheels):
        for j in range(i + 1):
            flexibility = local_compliance(at, pattern, memory, marks, rail_x, b, 0, element_length, compliance, i, j)
            if ti.static(pattern.dofs > 0):
                flexibility = flexibility + rail_flexibility(
                    at, pattern, memory, marks, columns, element_class, window_start, rail_places, rate, b, 0, i, j
                )
            row = at.flexibility + i * at.wheels + j
            memory[b, row] = memory[b, at.active] * 0.0 + flexibility
