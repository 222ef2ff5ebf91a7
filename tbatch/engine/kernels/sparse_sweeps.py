"""Solves and products of an imported track: every row has a list of entries, the lanes of a block side by side.

`starts[list, row]` says where a row's entries begin in each list, `partner` which row an entry multiplies
(`tbatch.numerics.sparse_factorization`). Two interleaved sums a row hide the latency.
"""

import taichi as ti

from tbatch.numerics.sparse_factorization import BACKWARD, FORWARD, PRODUCTS


@ti.func
def entry_sum(partner: ti.template(), rows: ti.template(), rate, start, end, b, x: ti.template()):
    """Sum of coefficient times partner over the entries from `start` to `end`."""
    even = x[b, 0] * 0.0
    odd = x[b, 0] * 0.0
    for pair in range((end - start) // 2):
        entry = start + 2 * pair
        even = even + rows[rate, 0, entry] * x[b, partner[entry]]
        odd = odd + rows[rate, 0, entry + 1] * x[b, partner[entry + 1]]
    if (end - start) % 2 == 1:
        even = even + rows[rate, 0, end - 1] * x[b, partner[end - 1]]
    return even + odd


@ti.func
def sparse_forward(starts: ti.template(), partner: ti.template(), rows: ti.template(), rate, b, load: ti.template()):
    """t_i = b_i - Σ_j<i L_ij t_j, in place of the load."""
    for row in range(starts.shape[1] - 1):
        start = starts[FORWARD, row]
        end = starts[FORWARD, row + 1]
        load[b, row] = load[b, row] + entry_sum(partner, rows, rate, start, end, b, load)


@ti.func
def sparse_backward(starts: ti.template(), partner: ti.template(), rows: ti.template(), rate, b, load: ti.template()):
    """x_i = D_i⁻¹ t_i - Σ_k>i L_ki x_k, in place of t."""
    count = starts.shape[1] - 1
    for back in range(count):
        row = count - 1 - back
        load[b, row] = entry_sum(partner, rows, rate, starts[BACKWARD, row], starts[BACKWARD, row + 1], b, load)


@ti.func
def sparse_update(
    half, b, scheme: ti.template(), displacement: ti.template(), velocity: ti.template(), load: ti.template()
):
    """From the solution in the load's place: p and w of substep 1, v₂ and u₂ of substep 2 (see `sweeps`).

    They stand in the velocity's and the displacement's place; v₀ is not needed after p.
    """
    c1, c2, c3, two_h = scheme[0], scheme[1], scheme[2], scheme[3]
    for row in range(displacement.shape[1]):
        x = load[b, row]
        if half == 0:
            u0 = displacement[b, row]
            v0 = velocity[b, row]
            u1 = x - u0
            v1 = two_h * (u1 - u0) - v0
            w = c1 * u0 + c2 * u1
            velocity[b, row] = 0.0 - ((c1 * v0 + c2 * v1) + c3 * w)
            displacement[b, row] = w
        else:
            velocity[b, row] = displacement[b, row] + c3 * x
            displacement[b, row] = x


@ti.func
def sparse_products(
    starts: ti.template(), partner: ti.template(), product: ti.template(), half, b, displacement: ti.template(),
    velocity: ti.template(), load: ti.template(),
):  # fmt: skip
    """The load of the next substep, without contact forces."""
    for row in range(starts.shape[1] - 1):
        start = starts[PRODUCTS, row]
        end = starts[PRODUCTS, row + 1]
        even = load[b, row] * 0.0
        odd = load[b, row] * 0.0
        for pair in range((end - start) // 2):
            entry = start + 2 * pair
            near = partner[entry]
            far = partner[entry + 1]
            even = even + (
                product[half, 0, entry] * velocity[b, near] + product[half, 1, entry] * displacement[b, near]
            )
            odd = odd + (
                product[half, 0, entry + 1] * velocity[b, far] + product[half, 1, entry + 1] * displacement[b, far]
            )
        if (end - start) % 2 == 1:
            last = partner[end - 1]
            even = even + (
                product[half, 0, end - 1] * velocity[b, last] + product[half, 1, end - 1] * displacement[b, last]
            )
        load[b, row] = even + odd
