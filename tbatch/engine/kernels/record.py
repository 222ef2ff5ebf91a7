"""What is kept at each step end: statistics, the log of separations, samples of the histories."""

import taichi as ti

from tbatch.engine.rows import (
    CENSORED,
    CLOSED,
    EVALUATED,
    EVENT_CENSORED,
    EVENT_END,
    EVENT_GAP,
    EVENT_LANDING,
    EVENT_POSITION,
    EVENT_START,
    EVENTS,
    LANES,
    MARKS,
    OPENED,
    PER_WHEEL,
    SEPARATED,
)


@ti.func
def write_event(at: ti.template(), memory: ti.template(), marks: ti.template(), events: ti.template(), b, lane, j, end):
    """Append the separation in hand of one wheel to the log and forget it."""
    mark = MARKS.wheels + PER_WHEEL * j
    place = marks[b, mark + EVENTS, lane]
    events[b, j, place, EVENT_START, lane] = ti.cast(marks[b, mark + OPENED, lane], ti.f64)
    events[b, j, place, EVENT_END, lane] = ti.cast(end, ti.f64)
    events[b, j, place, EVENT_POSITION, lane] = memory[b, at.position + j][lane]
    events[b, j, place, EVENT_GAP, lane] = memory[b, at.gap + j][lane]
    events[b, j, place, EVENT_LANDING, lane] = memory[b, at.landing + j][lane]
    events[b, j, place, EVENT_CENSORED, lane] = ti.cast(marks[b, mark + CENSORED, lane], ti.f64)
    marks[b, mark + EVENTS, lane] = place + 1
    marks[b, mark + OPENED, lane] = -1
    marks[b, mark + CLOSED, lane] = -1
    marks[b, mark + CENSORED, lane] = 0


@ti.func
def follow_separation(
    at: ti.template(), memory: ti.template(), marks: ti.template(), events: ti.template(), b, lane, j, step, watch, x
):
    """Separation log of one wheel at the end of `step`; `watch` is the number of steps of landing force."""
    mark = MARKS.wheels + PER_WHEEL * j
    force = memory[b, at.force + j][lane]
    separated = force <= 0.0
    if x > memory[b, at.evaluate_from][lane]:
        if separated:
            gap = memory[b, at.separation + j][lane] - memory[b, at.overlap + j][lane]
            if marks[b, mark + OPENED, lane] >= 0 and marks[b, mark + CLOSED, lane] >= 0:
                write_event(at, memory, marks, events, b, lane, j, marks[b, mark + CLOSED, lane])
            if marks[b, mark + OPENED, lane] < 0:
                marks[b, mark + OPENED, lane] = step
                memory[b, at.position + j][lane] = x
                memory[b, at.gap + j][lane] = 0.0
                memory[b, at.landing + j][lane] = 0.0
                if marks[b, mark + EVALUATED, lane] == 0 and marks[b, mark + SEPARATED, lane] == 1:
                    marks[b, mark + CENSORED, lane] = 1
            memory[b, at.gap + j][lane] = ti.max(memory[b, at.gap + j][lane], gap)
        elif marks[b, mark + OPENED, lane] >= 0:
            if marks[b, mark + CLOSED, lane] < 0:
                marks[b, mark + CLOSED, lane] = step
            if step - marks[b, mark + CLOSED, lane] <= watch:
                memory[b, at.landing + j][lane] = ti.max(memory[b, at.landing + j][lane], force)
            else:
                write_event(at, memory, marks, events, b, lane, j, marks[b, mark + CLOSED, lane])
        marks[b, mark + EVALUATED, lane] = 1
    marks[b, mark + SEPARATED, lane] = int(separated)


@ti.func
def end_run(at: ti.template(), memory: ti.template(), marks: ti.template(), events: ti.template(), b, lane, step):
    """Stop one run after `step` steps: an open separation is written as censored, a watched landing as it stands."""
    memory[b, at.active][lane] = 0.0
    marks[b, MARKS.steps, lane] = step
    for j in range(at.wheels):
        mark = MARKS.wheels + PER_WHEEL * j
        if marks[b, mark + OPENED, lane] >= 0:
            if marks[b, mark + CLOSED, lane] >= 0:
                write_event(at, memory, marks, events, b, lane, j, marks[b, mark + CLOSED, lane])
            else:
                marks[b, mark + CENSORED, lane] = 1
                write_event(at, memory, marks, events, b, lane, j, step)


@ti.func
def take_statistics(
    at: ti.template(), accumulators: ti.template(), memory: ti.template(), marks: ti.template(),
    statistic_rows: ti.template(), b, time, rows_per_wheel, counters,
):  # fmt: skip
    """Every accumulator of every wheel; a wheel counts while it is beyond its run's `evaluate_from`."""
    front = memory[b, at.start] + memory[b, at.speed] * time
    for j in range(at.wheels):
        x = front - memory[b, at.offset + j]
        on = ti.select(x > memory[b, at.evaluate_from], memory[b, at.active], 0.0 * x)
        force = memory[b, at.force + j]
        load = memory[b, at.load + j]
        for number in ti.static(range(len(accumulators))):
            accumulators[number].update(
                memory, marks, b,
                at.outputs + j * rows_per_wheel + statistic_rows[number, 0],
                MARKS.wheels + at.wheels * PER_WHEEL + j * counters + statistic_rows[number, 1],
                force, load, on,
            )  # fmt: skip


@ti.func
def follow_separations(
    at: ti.template(), memory: ti.template(), marks: ti.template(), events: ti.template(), b, step, watch, time
):
    """Separation log of every wheel of every running lane."""
    for lane in range(LANES):
        if memory[b, at.active][lane] > 0.5:
            front = memory[b, at.start][lane] + memory[b, at.speed][lane] * time
            for j in range(at.wheels):
                x = front - memory[b, at.offset + j][lane]
                follow_separation(at, memory, marks, events, b, lane, j, step, watch, x)


@ti.func
def end_diverged(at: ti.template(), memory: ti.template(), marks: ti.template(), events: ti.template(), b, good, step):
    """Stop the running lanes whose contact solve failed in the step after `step`."""
    for lane in range(LANES):
        if memory[b, at.active][lane] > good[lane]:
            marks[b, MARKS.status, lane] = 1
            end_run(at, memory, marks, events, b, lane, step)


@ti.func
def end_finished(at: ti.template(), memory: ti.template(), marks: ti.template(), events: ti.template(), b, step):
    """Stop the running lanes whose last step was `step`."""
    for lane in range(LANES):
        if memory[b, at.active][lane] > 0.5 and memory[b, at.end][lane] < ti.cast(step, ti.f64) + 0.5:
            end_run(at, memory, marks, events, b, lane, step)
