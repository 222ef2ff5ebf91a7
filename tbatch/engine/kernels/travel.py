"""The line of an endless track follows the vehicle, one period at a time.

The state u and v moves back by one period and zeros enter at the front; K̂ stays what it was. The forces f₀ move with
the elements they act on. The node that becomes the line's pinned end is put to rest, and the load of the next substep
has to be made anew: what the old neighbours of the ends put into it would be a blow there.
"""

import taichi as ti

from tbatch.engine.rows import ELEMENT, LANES, MARKS, PER_WHEEL


@ti.func
def move_lane(vector: ti.template(), b, lane, by, dofs):
    """Move one lane of a track vector back by `by` rows."""
    rows = vector.shape[1]
    for row in range(rows - by):
        vector[b, row][lane] = vector[b, row + by][lane]
    for row in range(rows - by, rows):
        vector[b, row][lane] = 0.0
    for row in range(dofs):
        vector[b, row][lane] = 0.0


@ti.func
def move_block(vector: ti.template(), b, by, dofs):
    """Move all lanes of a track vector back by `by` rows."""
    rows = vector.shape[1]
    for row in range(rows - by):
        vector[b, row] = vector[b, row + by]
    for row in range(rows - by, rows):
        vector[b, row] = vector[b, row] * 0.0
    for row in range(dofs):
        vector[b, row] = vector[b, row] * 0.0


@ti.func
def pass_period(at: ti.template(), memory: ti.template(), marks: ti.template(), b, lane, period_elements):
    """Count one period for one lane; its wheels stand on elements one period further back."""
    marks[b, MARKS.passed, lane] = marks[b, MARKS.passed, lane] + 1
    for j in range(at.wheels):
        mark = MARKS.wheels + PER_WHEEL * j + ELEMENT
        marks[b, mark, lane] = marks[b, mark, lane] - period_elements


@ti.func
def follow_vehicle(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), lockstep: ti.template(),
    b, n, step, period, period_elements, home, displacement: ti.template(), velocity: ti.template(),
):  # fmt: skip
    """Move the line of every lane whose wheel 1 has reached `home` after n steps; gives -1 if any was moved, else 0."""
    moved = 0
    by = period_elements * pattern.dofs
    for lane in range(LANES):
        if lockstep[b] == 0 or lane == 0:
            time = ti.min(ti.cast(n, ti.f64), memory[b, at.end][lane]) * step
            front = memory[b, at.start][lane] + memory[b, at.speed][lane] * time
            while front - ti.cast(marks[b, MARKS.passed, lane], ti.f64) * period >= home:
                moved = -1
                if lockstep[b] == 1:
                    move_block(displacement, b, by, pattern.dofs)
                    move_block(velocity, b, by, pattern.dofs)
                    for other in range(LANES):
                        pass_period(at, memory, marks, b, other, period_elements)
                else:
                    move_lane(displacement, b, lane, by, pattern.dofs)
                    move_lane(velocity, b, lane, by, pattern.dofs)
                    pass_period(at, memory, marks, b, lane, period_elements)
    return moved
