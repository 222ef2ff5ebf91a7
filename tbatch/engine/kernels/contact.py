"""Contact forces of one substep: exact, local, without iterating over the big systems.

With both subsystems solved for everything but the new contact forces, these obey

    δ = δ_free - H F,   F = k max(δ - δ_sep, 0)^(1 or 3/2),   H = Γ K̂_v⁻¹ Γᵀ + N K̂_t⁻¹ Nᵀ + local rail compliance

The track's share of δ_free is gathered from its load through the columns of K̂_t⁻¹, before the sweeps. So the sweeps
run once, with the right forces in their load.
"""

import taichi as ti

from tbatch.engine.rows import ELEMENT, MARKS, PER_WHEEL, PROFILE_COUNT, PROFILE_FIRST

Four = ti.types.vector(4, ti.f64)

NEWTON_LIMIT = 60
"""Newton steps after which a contact solve has failed; about 4 are usual."""
ROUND_OFF = 4e-15
"""A Newton step below this fraction of the terms of δ ends the solve."""


@ti.func
def profile_value(
    segment_real: ti.template(), segment_whole: ti.template(), coefficients: ti.template(), first, count, x
):
    """Value at x of a piecewise-uniform cubic B-spline (`tbatch.physics.profile.Profile`)."""
    low = first
    high = first + count
    while high - low > 1:
        middle = (low + high) // 2
        if segment_real[middle, 0] <= x:
            low = middle
        else:
            high = middle
    t = (x - segment_real[low, 0]) * segment_real[low, 1]
    i = ti.min(ti.max(int(ti.floor(t)), 0), segment_whole[low, 1] - 1)
    w = ti.min(ti.max(t - i, 0.0), 1.0)
    o = 1.0 - w
    c = segment_whole[low, 0] + i
    b0 = o * o * o / 6.0
    b1 = (3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0
    b2 = (3.0 * o * o * o - 6.0 * o * o + 4.0) / 6.0
    b3 = w * w * w / 6.0
    return (
        coefficients[c] * b0 + coefficients[c + 1] * b1 + coefficients[c + 2] * b2 + coefficients[c + 3] * b3
    )


@ti.func
def place_wheels(
    at: ti.template(), memory: ti.template(), marks: ti.template(), b, lane, time, element_length, elements,
    segment_real: ti.template(), segment_whole: ti.template(), coefficients: ti.template(),
):  # fmt: skip
    """Element, Hermite values and level r under each wheel of one run."""
    rolled = memory[b, at.speed][lane] * time
    front = memory[b, at.start][lane] + rolled
    for j in range(at.wheels):
        mark = MARKS.wheels + PER_WHEEL * j
        x = front - memory[b, at.offset + j][lane]
        scaled = x / element_length
        element = ti.min(ti.max(int(ti.floor(scaled)), 0), elements - 1)
        s = scaled - element
        marks[b, mark + ELEMENT, lane] = element
        memory[b, at.local + j][lane] = s
        memory[b, at.shape + 4 * j][lane] = 1.0 - s * s * (3.0 - 2.0 * s)
        memory[b, at.shape + 4 * j + 1][lane] = element_length * (s * (1.0 - s) * (1.0 - s))
        memory[b, at.shape + 4 * j + 2][lane] = s * s * (3.0 - 2.0 * s)
        memory[b, at.shape + 4 * j + 3][lane] = element_length * (s * s * (s - 1.0))
        r = profile_value(
            segment_real, segment_whole, coefficients,
            marks[b, MARKS.profile, lane], marks[b, MARKS.profile + 1, lane], x,
        )  # fmt: skip
        if marks[b, mark + PROFILE_COUNT, lane] > 0:
            turns = ti.floor(rolled / memory[b, at.circumference][lane])
            r = r + profile_value(
                segment_real, segment_whole, coefficients,
                marks[b, mark + PROFILE_FIRST, lane], marks[b, mark + PROFILE_COUNT, lane],
                rolled - turns * memory[b, at.circumference][lane],
            )  # fmt: skip
        memory[b, at.level + j][lane] = r


@ti.func
def rail_value(at: ti.template(), dofs, memory: ti.template(), marks: ti.template(), vector: ti.template(), b, lane, j):
    """N times the rail dofs of `vector` under wheel j of one run."""
    row = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane] * dofs
    n = at.shape + 4 * j
    return (memory[b, n][lane] * vector[b, row][lane] + memory[b, n + 1][lane] * vector[b, row + 1][lane]) + (
        memory[b, n + 2][lane] * vector[b, row + dofs][lane] + memory[b, n + 3][lane] * vector[b, row + dofs + 1][lane]
    )


@ti.func
def push_rail(at: ti.template(), dofs, memory: ti.template(), marks: ti.template(), load: ti.template(), b, lane):
    """Add Nᵀ F to the track's load of one run."""
    for j in range(at.wheels):
        row = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane] * dofs
        n = at.shape + 4 * j
        force = memory[b, at.force + j][lane]
        load[b, row][lane] = load[b, row][lane] + memory[b, n][lane] * force
        load[b, row + 1][lane] = load[b, row + 1][lane] + memory[b, n + 1][lane] * force
        load[b, row + dofs][lane] = load[b, row + dofs][lane] + memory[b, n + 2][lane] * force
        load[b, row + dofs + 1][lane] = load[b, row + dofs + 1][lane] + memory[b, n + 3][lane] * force


@ti.func
def gather_rail(
    at: ti.template(), pattern: ti.template(), memory: ti.template(), marks: ti.template(), columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), load: ti.template(), rate, b, lane, j,
):  # fmt: skip
    """N K̂⁻¹ load under wheel j of one run: where the rail would be without the new contact forces."""
    element = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]
    kind = element_class[element]
    first = window_start[element]
    sums = [Four(0.0) for _ in ti.static(range(pattern.dofs // 2))]
    for node in range(columns.shape[2] // pattern.dofs):
        for r in ti.static(range(pattern.dofs)):
            sums[r % (pattern.dofs // 2)] = (
                sums[r % (pattern.dofs // 2)]
                + columns[rate, kind, node * pattern.dofs + r] * load[b, first + node * pattern.dofs + r][lane]
            )
    y = sums[0]
    for chain in ti.static(range(1, pattern.dofs // 2)):
        y = y + sums[chain]
    n = at.shape + 4 * j
    return (memory[b, n][lane] * y[0] + memory[b, n + 1][lane] * y[1]) + (
        memory[b, n + 2][lane] * y[2] + memory[b, n + 3][lane] * y[3]
    )


@ti.func
def rail_flexibility(
    at: ti.template(), dofs, memory: ti.template(), marks: ti.template(), columns: ti.template(),
    element_class: ti.template(), window_start: ti.template(), rate, b, lane, i, j,
):  # fmt: skip
    """N_i K̂⁻¹ N_jᵀ of one run; zero where wheel j stands outside the window of wheel i's element."""
    element = marks[b, MARKS.wheels + PER_WHEEL * i + ELEMENT, lane]
    other = marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane] * dofs - window_start[element]
    kind = element_class[element]
    total = 0.0
    if other >= 0 and other + dofs + 1 < columns.shape[2]:
        n = at.shape + 4 * i
        for part in range(4):
            g = columns[rate, kind, other + (part // 2) * dofs + part % 2]
            total = total + memory[b, at.shape + 4 * j + part][lane] * (
                (memory[b, n][lane] * g[0] + memory[b, n + 1][lane] * g[1])
                + (memory[b, n + 2][lane] * g[2] + memory[b, n + 3][lane] * g[3])
            )
    return total


@ti.func
def local_compliance(
    at: ti.template(), memory: ti.template(), marks: ti.template(), b, lane, element_length, compliance, i, j
):
    """Deflection at wheel i by a unit force at wheel j of the fixed-fixed element both stand on, else zero [m/N].

    b²x²(3aℓ - x(3a + b))/(6EIℓ³) for x <= a, b = ℓ - a; `compliance` is 1/(6EIℓ³).
    """
    total = 0.0
    if (
        marks[b, MARKS.wheels + PER_WHEEL * i + ELEMENT, lane]
        == marks[b, MARKS.wheels + PER_WHEEL * j + ELEMENT, lane]
    ):
        si = memory[b, at.local + i][lane]
        sj = memory[b, at.local + j][lane]
        x = element_length * ti.min(si, sj)
        a = element_length * ti.max(si, sj)
        c = element_length - a
        total = compliance * (c * c * x * x * (3.0 * a * element_length - x * (3.0 * a + c)))
    return total


@ti.func
def law(at: ti.template(), memory: ti.template(), b, overlap, force, slope):
    """F and dF/dδ of every wheel from its δ; returns the work Σ ∫F dδ. The arguments after b are rows."""
    work = memory[b, at.active] * 0.0
    for j in range(at.wheels):
        k = memory[b, at.contact_stiffness + j]
        m = ti.max(memory[b, overlap + j] - memory[b, at.separation + j], 0.0)
        root = ti.sqrt(m)
        hertz = memory[b, at.hertz] > 0.5
        f = ti.select(hertz, (k * m) * root, k * m)
        memory[b, force + j] = f
        memory[b, slope + j] = ti.select(hertz, 1.5 * (k * root), ti.select(m > 0.0, k, 0.0 * k))
        work = work + ti.select(hertz, 0.4 * (f * m), 0.5 * (f * m))
    return work


@ti.func
def flexibility_product(at: ti.template(), memory: ti.template(), b, vector, i):
    """Row i of H times a vector in memory."""
    total = memory[b, vector] * 0.0
    for j in range(at.wheels):
        total = total + memory[b, at.flexibility + i * at.wheels + j] * memory[b, vector + j]
    return total


@ti.func
def solve_contact(at: ti.template(), memory: ti.template(), b):
    """Forces and overlaps from δ_free (in the overlap rows) and H; returns 1 for lanes that were solved, else 0.

    Newton's method for δ + H F(δ) = δ_free, kept in the form δ = δ_free - H λ, damped by halving so that the convex
    function ½ λᵀHλ + Σ ∫F dδ always falls. A lane that has converged is left as it is.
    """
    w = at.wheels
    force, lam, free = at.force, at.newton, at.newton + w
    slope, gap, p, hp = at.newton + 2 * w, at.newton + 3 * w, at.newton + 4 * w, at.newton + 5 * w
    root, y, hl = at.newton + 6 * w, at.newton + 7 * w, at.newton + 8 * w
    trial_overlap, trial_force, trial_slope = at.newton + 9 * w, at.newton + 10 * w, at.newton + 11 * w
    factor = at.newton + 12 * w

    none = memory[b, at.active] * 0.0
    odd = none
    for j in range(w):
        memory[b, free + j] = memory[b, at.overlap + j]
        memory[b, lam + j] = memory[b, force + j]
        odd = odd + (memory[b, free + j] - memory[b, free + j])
    for j in range(w):
        memory[b, hl + j] = flexibility_product(at, memory, b, lam, j)
        odd = odd + (memory[b, hl + j] - memory[b, hl + j])
        memory[b, at.overlap + j] = memory[b, free + j] - memory[b, hl + j]
    merit = law(at, memory, b, at.overlap, force, slope)
    for j in range(w):
        merit = merit + 0.5 * (memory[b, lam + j] * memory[b, hl + j])
    solved = ti.select(odd == 0.0, 1.0 - memory[b, at.active], none)
    waiting = ti.select(odd == 0.0, memory[b, at.active], none)
    length = none + 1.0
    count = 0
    while waiting.sum() > 0.5 and count < NEWTON_LIMIT:
        count = count + 1
        # Newton direction p in λ: (I + d H d) y = d g, p = (F - λ) - d y, with g = H (F - λ) and d² = dF/dδ.
        for j in range(w):
            memory[b, gap + j] = memory[b, force + j] - memory[b, lam + j]
            memory[b, root + j] = ti.sqrt(memory[b, slope + j])
        for j in range(w):
            memory[b, p + j] = flexibility_product(at, memory, b, gap, j)
            memory[b, y + j] = memory[b, root + j] * memory[b, p + j]
        for i in range(w):
            for j in range(i + 1):
                entry = memory[b, root + i] * memory[b, at.flexibility + i * w + j] * memory[b, root + j]
                if i == j:
                    entry = entry + 1.0
                for k in range(j):
                    entry = entry - memory[b, factor + i * w + k] * memory[b, factor + j * w + k]
                if i == j:
                    memory[b, factor + i * w + i] = ti.sqrt(entry)
                else:
                    memory[b, factor + i * w + j] = entry / memory[b, factor + j * w + j]
        for i in range(w):
            value = memory[b, y + i]
            for k in range(i):
                value = value - memory[b, factor + i * w + k] * memory[b, y + k]
            memory[b, y + i] = value / memory[b, factor + i * w + i]
        for back in range(w):
            i = w - 1 - back
            value = memory[b, y + i]
            for k in range(i + 1, w):
                value = value - memory[b, factor + k * w + i] * memory[b, y + k]
            memory[b, y + i] = value / memory[b, factor + i * w + i]
        descent = none
        for j in range(w):
            g = memory[b, p + j]
            memory[b, p + j] = memory[b, gap + j] - memory[b, root + j] * memory[b, y + j]
            descent = descent - g * memory[b, p + j]
        # Converged where the step in δ is round-off of its own terms.
        rough = none
        for j in range(w):
            step = flexibility_product(at, memory, b, p, j)
            memory[b, hp + j] = step
            size = ti.max(memory[b, free + j], 0.0 - memory[b, free + j])
            for k in range(w):
                part = memory[b, at.flexibility + j * w + k] * memory[b, lam + k]
                size = size + ti.max(part, 0.0 - part)
            rough = ti.select(ti.max(step, 0.0 - step) <= ROUND_OFF * size, rough, rough + 1.0)
        converged = ti.select(rough < 0.5, waiting, none)
        solved = solved + converged
        waiting = waiting - converged
        # Trial step, taken where the merit function falls.
        for j in range(w):
            memory[b, trial_overlap + j] = memory[b, free + j] - (memory[b, hl + j] + length * memory[b, hp + j])
        trial = law(at, memory, b, trial_overlap, trial_force, trial_slope)
        for j in range(w):
            trial = trial + 0.5 * (
                (memory[b, lam + j] + length * memory[b, p + j]) * (memory[b, hl + j] + length * memory[b, hp + j])
            )
        slack = 1e-13 * ti.max(merit, 0.0 - merit)
        falls = ti.select(trial <= merit + 1e-4 * length * descent + slack, waiting, none)
        for j in range(w):
            taken = falls > 0.5
            memory[b, lam + j] = ti.select(taken, memory[b, lam + j] + length * memory[b, p + j], memory[b, lam + j])
            memory[b, hl + j] = ti.select(taken, memory[b, hl + j] + length * memory[b, hp + j], memory[b, hl + j])
            memory[b, at.overlap + j] = ti.select(taken, memory[b, trial_overlap + j], memory[b, at.overlap + j])
            memory[b, force + j] = ti.select(taken, memory[b, trial_force + j], memory[b, force + j])
            memory[b, slope + j] = ti.select(taken, memory[b, trial_slope + j], memory[b, slope + j])
        merit = ti.select(falls > 0.5, trial, merit)
        length = ti.select(falls > 0.5, none + 1.0, 0.5 * length)
    for j in range(w):
        memory[b, force + j] = ti.select(solved > 0.5, memory[b, force + j], none)
    return solved
