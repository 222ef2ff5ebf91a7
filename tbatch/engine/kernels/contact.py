"""Contact forces of one substep: exact, local, without iterating over the big systems.

With both subsystems solved for everything but the new contact forces, these obey

    δ = δ_free - H F,   F = k max(δ - δ_sep, 0)^(1 or 3/2),   H = Γ K̂_v⁻¹ Γᵀ + N K̂_t⁻¹ Nᵀ + local rail compliance

`tbatch.engine.kernels.wheels` gives δ_free and H; the same algorithm in plain form is `tbatch.numerics.contact_solve`.
"""

import taichi as ti

NEWTON_LIMIT = 200
"""Newton steps after which a contact solve has failed; about 4 are usual."""
ROUND_OFF = 4e-15
"""A Newton step below this fraction of the largest terms of δ ends the solve."""


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
        # Converged where the step in δ is round-off of the largest terms of any wheel's δ, which H spreads to all.
        size = none
        pressed = none
        for j in range(w):
            memory[b, hp + j] = flexibility_product(at, memory, b, p, j)
            own = memory[b, at.approach + j] + ti.max(memory[b, free + j], 0.0 - memory[b, free + j])
            for k in range(w):
                part = memory[b, at.flexibility + j * w + k] * memory[b, lam + k]
                own = own + ti.max(part, 0.0 - part)
            size = ti.select(own > size, own, size)
            pressed = pressed + memory[b, force + j]
        rough = none
        for j in range(w):
            step = memory[b, hp + j]
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
        # The work of the forces is known to round-off of δ.
        slack = 1e-13 * ti.max(merit, 0.0 - merit) + ROUND_OFF * size * pressed
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
