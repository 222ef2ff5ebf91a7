"""The batch step: the two-step scheme with contact, a chunk of steps of every block in one launch."""


import taichi as ti

from tbatch.engine.kernels.contact import (
    Four,
    gather_rail,
    local_compliance,
    place_wheels,
    push_rail,
    rail_flexibility,
    rail_value,
    solve_contact,
)
from tbatch.engine.kernels.record import end_run, follow_separations, take_statistics
from tbatch.engine.kernels.samples import begin_probes, middle_probes, write_sample
from tbatch.engine.kernels.sweeps import backward_sweep_first, backward_sweep_second, forward_sweep
from tbatch.engine.kernels.vehicle import free_wheel, pull_wheels, vehicle_first, vehicle_load_first, vehicle_second
from tbatch.engine.rows import LANES, MARKS

Lanes = ti.types.vector(LANES, ti.f64)


@ti.kernel
def advance(
    # what is compiled in
    pattern: ti.template(),
    at: ti.template(),
    accumulators: ti.template(),
    # steps
    first_step: ti.i32,
    step_count: ti.i32,
    step: ti.f64,
    scheme: ti.types.ndarray(ti.f64, 1),  # c₁, c₂, c₃, 2/h, 4/h, γ
    # constant model: the track
    elements: ti.i32,
    element_length: ti.f64,
    compliance: ti.f64,
    rows: ti.types.ndarray(ti.f64, 3),
    node_class: ti.types.ndarray(ti.i32, 1),
    columns: ti.types.ndarray(Four, 3),
    element_class: ti.types.ndarray(ti.i32, 1),
    window_start: ti.types.ndarray(ti.i32, 1),
    # constant model: the vehicle and the probes
    wheel_dofs: ti.types.ndarray(ti.i32, 1),
    probe_rows: ti.types.ndarray(ti.i32, 2),
    probe_shape: ti.types.ndarray(ti.f64, 2),
    # constant runs: irregularities and wheel profiles
    segment_real: ti.types.ndarray(ti.f64, 2),
    segment_whole: ti.types.ndarray(ti.i32, 2),
    coefficients: ti.types.ndarray(ti.f64, 1),
    # state
    displacement: ti.types.ndarray(Lanes, 2),
    velocity: ti.types.ndarray(Lanes, 2),
    load: ti.types.ndarray(Lanes, 2),
    memory: ti.types.ndarray(Lanes, 2),
    marks: ti.types.ndarray(ti.i32, 3),
    # what is kept
    statistic_rows: ti.types.ndarray(ti.i32, 2),
    rows_per_wheel: ti.i32,
    counters: ti.i32,
    watch: ti.i32,
    events: ti.types.ndarray(ti.f64, 5),
    every: ti.i32,
    first_sample: ti.i32,
    probe_memory: ti.i32,
    sample_rows: ti.types.ndarray(ti.i32, 1),
    samples: ti.types.ndarray(Lanes, 3),
):
    ti.loop_config(block_dim=1)
    for b in range(memory.shape[0]):
        for n in range(first_step, first_step + step_count):
            if memory[b, at.active].sum() > 0.5:
                sampled = every > 0 and (n + 1) % ti.max(every, 1) == 0
                if sampled:
                    begin_probes(at, memory, probe_rows, probe_shape, displacement, velocity, b, probe_memory)
                vehicle_load_first(at, memory, wheel_dofs, b, scheme)
                if ti.static(pattern.dofs > 0):
                    for lane in range(LANES):
                        push_rail(at, pattern.dofs, memory, marks, load, b, lane)
                good = memory[b, at.active]
                for half in range(2):
                    rate = half * (rows.shape[0] - 1)
                    part = ti.select(half == 0, scheme[5], 1.0)

                    # Where the wheels are, and where the rail would be without them.
                    for lane in range(LANES):
                        time = ti.min(ti.cast(n, ti.f64) + part, memory[b, at.end][lane]) * step
                        place_wheels(
                            at, memory, marks, b, lane, time, element_length, elements,
                            segment_real, segment_whole, coefficients,
                        )  # fmt: skip
                        for i in range(at.wheels):
                            rail = 0.0
                            if ti.static(pattern.dofs > 0):
                                rail = gather_rail(
                                    at, pattern, memory, marks, columns, element_class, window_start,
                                    load, rate, b, lane, i,
                                )  # fmt: skip
                                if half == 0:
                                    rail = rail + rail_value(
                                        at, pattern.dofs, memory, marks, displacement, b, lane, i
                                    )
                            memory[b, at.rail + i][lane] = rail
                            for j in range(i + 1):
                                flexibility = local_compliance(
                                    at, memory, marks, b, lane, element_length, compliance, i, j
                                )
                                if ti.static(pattern.dofs > 0):
                                    flexibility = flexibility + rail_flexibility(
                                        at, pattern.dofs, memory, marks, columns, element_class, window_start,
                                        rate, b, lane, i, j,
                                    )  # fmt: skip
                                memory[b, at.flexibility + i * at.wheels + j][lane] = flexibility
                    for i in range(at.wheels):
                        for j in range(i + 1):
                            flexibility = (
                                memory[b, at.flexibility + i * at.wheels + j]
                                + memory[
                                    b,
                                    at.inverse
                                    + (rate * at.dofs + wheel_dofs[i]) * at.dofs
                                    + wheel_dofs[j],
                                ]
                            )
                            memory[b, at.flexibility + i * at.wheels + j] = flexibility
                            memory[b, at.flexibility + j * at.wheels + i] = flexibility
                        memory[b, at.overlap + i] = (
                            (memory[b, at.approach + i] + free_wheel(at, memory, b, rate, half, wheel_dofs[i]))
                            - memory[b, at.rail + i]
                        ) - memory[b, at.level + i]

                    # The contact forces, then both subsystems with them.
                    solved = solve_contact(at, memory, b)
                    good = ti.select(solved > 0.5, good, 0.0 * solved)
                    pull_wheels(at, memory, wheel_dofs, b)
                    if ti.static(pattern.dofs > 0):
                        for lane in range(LANES):
                            push_rail(at, pattern.dofs, memory, marks, load, b, lane)
                        forward_sweep(pattern, rows, node_class, rate, b, load)
                    if half == 0:
                        if ti.static(pattern.dofs > 0):
                            backward_sweep_first(
                                pattern, rows, node_class, rate, b, scheme, displacement, velocity, load
                            )
                        vehicle_first(at, memory, wheel_dofs, b, rate, scheme)
                        if sampled:
                            middle_probes(
                                at, memory, probe_rows, probe_shape, displacement, b, probe_memory, scheme
                            )
                    else:
                        if ti.static(pattern.dofs > 0):
                            backward_sweep_second(
                                pattern, rows, node_class, rate, b, scheme, displacement, velocity, load
                            )
                        vehicle_second(at, memory, b, rate, scheme)

                # The step's end: what is kept of it, and which runs it ends.
                for lane in range(LANES):
                    if memory[b, at.active][lane] > good[lane]:
                        marks[b, MARKS.status, lane] = 1
                        end_run(at, memory, marks, events, b, lane, n)
                time = (ti.cast(n, ti.f64) + 1.0) * step
                take_statistics(
                    at, accumulators, memory, marks, statistic_rows, b, time, rows_per_wheel, counters
                )
                follow_separations(at, memory, marks, events, b, n + 1, watch, time)
                if sampled:
                    if ti.static(pattern.dofs > 0):
                        for lane in range(LANES):
                            for j in range(at.wheels):
                                memory[b, at.rail + j][lane] = rail_value(
                                    at, pattern.dofs, memory, marks, displacement, b, lane, j
                                )
                    write_sample(
                        at, memory, sample_rows, samples, probe_rows, probe_shape, displacement, velocity,
                        b, (n + 1) // every - first_sample, probe_memory, scheme,
                    )  # fmt: skip
                for lane in range(LANES):
                    if memory[b, at.active][lane] > 0.5 and memory[b, at.end][lane] < ti.cast(n, ti.f64) + 1.5:
                        end_run(at, memory, marks, events, b, lane, n + 1)
