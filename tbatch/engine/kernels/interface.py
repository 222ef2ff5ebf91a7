"""Where vehicle and track meet: δ_free and H of every wheel, and the contact forces put on the rail.

The track's share of δ_free is gathered from its load through the columns of K̂_t⁻¹, before the sweeps. So the contact
forces are known when the sweeps begin, and these run once. Blocks whose lanes keep the same course take the short way
of `lockstep`; the others go lane by lane. Both give the same bits.
"""

import taichi as ti

from tbatch.engine.kernels.lockstep import (
    flexibilities_lockstep,
    gather_rail_lockstep,
    push_rail_lockstep,
    rail_value_lockstep,
)
from tbatch.engine.kernels.vehicle import free_wheel
from tbatch.engine.kernels.wheels import (
    find_levels,
    gather_rail,
    local_compliance,
    place_wheels,
    push_rail,
    rail_flexibility,
    rail_value,
)
from tbatch.engine.rows import LANES


@ti.func
def free_overlaps(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), wheel_dofs: ti.template(),
    lockstep: ti.template(), b, rate, half, when, step, element_length, elements, period, compliance,
    columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), rail_x: ti.template(), rail_rows: ti.template(),
    near: ti.template(), rail_places, segment_real: ti.template(),
    segment_whole: ti.template(), coefficients: ti.template(), displacement: ti.template(), load: ti.template(),
):  # fmt: skip
    """Place the wheels at `when` steps; δ_free goes into the overlap rows, H into the flexibility rows.

    δ_free = δ₀ + Γ y_v - N y_t - r, with y what either subsystem does without the new contact forces. In substep 1 the
    track's solve gives u₁ + u₀ and the vehicle's q₁ - q₀.
    """
    if lockstep[b] == 1:
        time = ti.min(when, memory[b, at.end][0]) * step
        place_wheels(at, pattern, memory, marks, b, 0, time, element_length, elements, period, rail_x)
        for lane in range(LANES):
            find_levels(at, memory, marks, b, lane, time, segment_real, segment_whole, coefficients)
        if ti.static(pattern.dofs > 0):
            for j in range(at.wheels):
                rail = gather_rail_lockstep(
                    at, pattern, memory, marks, columns, element_class, window_start, near, load, rate, b, j
                )
                if half == 0:
                    rail = rail - rail_value_lockstep(at, pattern, memory, marks, rail_rows, displacement, b, j, 0)
                memory[b, at.rail + j] = rail
        flexibilities_lockstep(
            at,
            pattern,
            memory,
            marks,
            columns,
            element_class,
            window_start,
            rail_x,
            rail_places,
            rate,
            b,
            element_length,
            compliance,
        )
    else:
        for lane in range(LANES):
            time = ti.min(when, memory[b, at.end][lane]) * step
            place_wheels(at, pattern, memory, marks, b, lane, time, element_length, elements, period, rail_x)
            find_levels(at, memory, marks, b, lane, time, segment_real, segment_whole, coefficients)
            for i in range(at.wheels):
                if ti.static(pattern.dofs > 0):
                    rail = gather_rail(
                        at, pattern, memory, marks, columns, element_class, window_start, near, load, rate, b, lane, i
                    )
                    if half == 0:
                        rail = rail - rail_value(at, pattern, memory, marks, rail_rows, displacement, b, lane, i, 0)
                    memory[b, at.rail + i][lane] = rail
                for j in range(i + 1):
                    flexibility = local_compliance(
                        at, pattern, memory, marks, rail_x, b, lane, element_length, compliance, i, j
                    )
                    if ti.static(pattern.dofs > 0):
                        flexibility = flexibility + rail_flexibility(
                            at,
                            pattern,
                            memory,
                            marks,
                            columns,
                            element_class,
                            window_start,
                            rail_places,
                            rate,
                            b,
                            lane,
                            i,
                            j,
                        )
                    memory[b, at.flexibility + i * at.wheels + j][lane] = flexibility
    for i in range(at.wheels):
        for j in range(i + 1):
            flexibility = (
                memory[b, at.flexibility + i * at.wheels + j]
                + memory[b, at.inverse + (rate * at.dofs + wheel_dofs[i]) * at.dofs + wheel_dofs[j]]
            )
            memory[b, at.flexibility + i * at.wheels + j] = flexibility
            memory[b, at.flexibility + j * at.wheels + i] = flexibility
        wheel = free_wheel(at, memory, b, rate, half, wheel_dofs[i])
        memory[b, at.overlap + i] = ((memory[b, at.approach + i] + wheel) - memory[b, at.rail + i]) - memory[
            b, at.level + i
        ]


@ti.func
def push_contact_forces(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), lockstep: ti.template(),
    rail_rows: ti.template(), load: ti.template(), b,
):  # fmt: skip
    """Add Nᵀ F to the track's load of every lane."""
    if ti.static(pattern.dofs > 0):
        if lockstep[b] == 1:
            push_rail_lockstep(at, pattern, memory, marks, rail_rows, load, b)
        else:
            for lane in range(LANES):
                push_rail(at, pattern, memory, marks, rail_rows, load, b, lane)
