"""The batch step: the two-step scheme with contact, a chunk of steps of every block in one launch."""

import taichi as ti

from tbatch.engine.kernels.contact import solve_contact
from tbatch.engine.kernels.interface import free_overlaps, push_contact_forces
from tbatch.engine.kernels.record import end_diverged, end_finished, follow_separations, take_statistics
from tbatch.engine.kernels.samples import begin_probes, middle_probes, write_sample, write_under_wheels
from tbatch.engine.kernels.sparse_sweeps import sparse_backward, sparse_forward, sparse_products, sparse_update
from tbatch.engine.kernels.sweeps import backward_sweep, forward_sweep
from tbatch.engine.kernels.travel import follow_vehicle
from tbatch.engine.kernels.vehicle import pull_wheels, vehicle_first, vehicle_load_first, vehicle_second
from tbatch.engine.kernels.wheels import Four
from tbatch.engine.rows import LANES

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
    period: ti.f64,
    period_elements: ti.i32,
    home: ti.f64,
    rows: ti.types.ndarray(ti.f64, 3),
    node_class: ti.types.ndarray(ti.i32, 1),
    columns: ti.types.ndarray(Four, 3),
    element_class: ti.types.ndarray(ti.i32, 1),
    window_start: ti.types.ndarray(ti.i32, 1),
    # constant model: an imported track's rail and entry lists (`tbatch.numerics.sparse_factorization`)
    rail_x: ti.types.ndarray(ti.f64, 1),
    rail_rows: ti.types.ndarray(ti.i32, 1),
    near: ti.types.ndarray(ti.i32, 2),
    rail_places: ti.i32,
    starts: ti.types.ndarray(ti.i32, 2),
    partner: ti.types.ndarray(ti.i32, 1),
    product: ti.types.ndarray(ti.f64, 3),
    # constant model: the vehicle and the probes
    wheel_dofs: ti.types.ndarray(ti.i32, 1),
    probe_rows: ti.types.ndarray(ti.i32, 2),
    probe_shape: ti.types.ndarray(ti.f64, 2),
    # constant runs: blocks whose lanes keep the same course; irregularities and wheel profiles
    lockstep: ti.types.ndarray(ti.i32, 1),
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
    """Advance every block by `step_count` steps from `first_step`: the scheme of `tbatch.numerics.two_step`."""
    ti.loop_config(block_dim=1)
    for b in range(memory.shape[0]):
        for n in range(first_step, first_step + step_count):
            if memory[b, at.active].sum() > 0.5:
                # Blocks beyond the buffer hold no run whose history is asked for.
                sampled = every > 0 and b < samples.shape[0] and (n + 1) % ti.max(every, 1) == 0
                if sampled:
                    begin_probes(memory, probe_rows, probe_shape, displacement, velocity, b, probe_memory)
                good = memory[b, at.active]

                # On an endless track the line has to follow the vehicle; its load is then made anew (half -1).
                first_half = 0
                if ti.static(pattern.dofs > 0 and not pattern.sparse):
                    if period_elements > 0:
                        first_half = follow_vehicle(
                            at, pattern, memory, marks, lockstep, b, n, step, period, period_elements, home,
                            displacement, velocity,
                        )  # fmt: skip
                vehicle_load_first(at, memory, wheel_dofs, b, scheme)

                for half in range(first_half, 2):
                    rate = ti.max(half, 0) * (rows.shape[0] - 1)
                    when = ti.cast(n, ti.f64) + ti.select(half == 0, scheme[5], 1.0)
                    if half == 0:
                        # f₀; the other terms of the track's load stand there already.
                        push_contact_forces(at, pattern, memory, marks, lockstep, rail_rows, load, b)
                    if half >= 0:
                        # The contact forces at the substep's end, exactly; then the loads with them.
                        free_overlaps(
                            at, pattern, memory, marks, wheel_dofs, lockstep, b, rate, half, when, step,
                            element_length, elements, period, compliance, columns, element_class, window_start, rail_x,
                            rail_rows, near, rail_places, segment_real, segment_whole, coefficients, displacement, load,
                        )  # fmt: skip
                        solved = solve_contact(at, memory, b)
                        good = ti.select(solved > 0.5, good, 0.0 * solved)
                        pull_wheels(at, memory, wheel_dofs, b)
                        push_contact_forces(at, pattern, memory, marks, lockstep, rail_rows, load, b)
                    # Both subsystems with these forces, and their loads for the next substep.
                    if ti.static(pattern.sparse):
                        sparse_forward(starts, partner, rows, rate, b, load)
                        sparse_backward(starts, partner, rows, rate, b, load)
                        sparse_update(half, b, scheme, displacement, velocity, load)
                        sparse_products(starts, partner, product, half, b, displacement, velocity, load)
                    elif ti.static(pattern.dofs > 0):
                        if half >= 0:
                            forward_sweep(pattern, rows, node_class, rate, b, load)
                        backward_sweep(pattern, rows, node_class, rate, half, b, scheme, displacement, velocity, load)
                    if half == 0:
                        vehicle_first(at, memory, wheel_dofs, b, rate, scheme)
                        if sampled:
                            middle_probes(memory, probe_rows, probe_shape, displacement, b, probe_memory, scheme)
                    elif half == 1:
                        vehicle_second(at, memory, b, rate, scheme)

                # What is kept of the step, and which runs it ends.
                time = (ti.cast(n, ti.f64) + 1.0) * step
                end_diverged(at, memory, marks, events, b, good, n)
                take_statistics(at, accumulators, memory, marks, statistic_rows, b, time, rows_per_wheel, counters)
                follow_separations(at, memory, marks, events, b, n + 1, watch, time)
                if sampled:
                    slot = (n + 1) // every - first_sample
                    write_sample(
                        at, memory, sample_rows, samples, probe_rows, probe_shape, displacement, velocity,
                        b, slot, probe_memory, scheme,
                    )  # fmt: skip
                    if ti.static(pattern.dofs > 0):
                        write_under_wheels(
                            at, pattern, memory, marks, lockstep, rail_rows, sample_rows, samples, displacement, b, slot
                        )
                end_finished(at, memory, marks, events, b, n + 1)
