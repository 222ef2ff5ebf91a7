"""Solves with K̂ and the products of the right-hand sides, node by node, the lanes of a block side by side.

A node's rows are unrolled; `pattern` (`tbatch.numerics.pattern.RowPattern`) says at compile time which coefficients are
there, `rows[rate, class, place]` holds them. The node's own and its neighbour's values stay in registers.
"""

import taichi as ti


@ti.func
def row_product(rows: ti.template(), rate, kind, entries: ti.template(), x: ti.template()):
    """Sum of coefficient times x over one row's entries, in two interleaved sums that hide the latency."""
    total = x[0] * 0.0
    if ti.static(len(entries) == 1):
        total = rows[rate, kind, entries[0][0]] * x[entries[0][1]]
    elif ti.static(len(entries) > 1):
        even = rows[rate, kind, entries[0][0]] * x[entries[0][1]]
        odd = rows[rate, kind, entries[1][0]] * x[entries[1][1]]
        for place in ti.static(range(2, len(entries))):
            if ti.static(place % 2 == 0):
                even = even + rows[rate, kind, entries[place][0]] * x[entries[place][1]]
            else:
                odd = odd + rows[rate, kind, entries[place][0]] * x[entries[place][1]]
        total = even + odd
    return total


@ti.func
def forward_sweep(pattern: ti.template(), rows: ti.template(), node_class: ti.template(), rate, b, load: ti.template()):
    """t_i = D_i⁻¹ (b_i - K̂_i,i-1 t_i-1), in place of the load."""
    t = [load[b, 0] * 0.0 for _ in ti.static(range(pattern.dofs))]
    for node in range(node_class.shape[0]):
        kind = node_class[node]
        carried = [load[b, node * pattern.dofs + r] for r in ti.static(range(pattern.dofs))]
        for r in ti.static(range(pattern.dofs)):
            carried[r] = carried[r] + row_product(rows, rate, kind, pattern.lower[r], t)
        for r in ti.static(range(pattern.dofs)):
            t[r] = row_product(rows, rate, kind, pattern.pivot[r], carried)
        for r in ti.static(range(pattern.dofs)):
            load[b, node * pattern.dofs + r] = t[r]


@ti.func
def backward_sweep(
    pattern: ti.template(), rows: ti.template(), node_class: ti.template(), rate, half, b, scheme: ti.template(),
    displacement: ti.template(), velocity: ti.template(), load: ti.template(),
):  # fmt: skip
    """Solutions x_i = t_i - B_i x_i+1, and with them the load M p - C q of the next substep, in place of the old one.

    Substep 1 (half 0) gives x = u₁ + u₀:  v₁ = (2/h)(u₁ - u₀) - v₀;  q = c₁u₀ + c₂u₁, kept in place of u₀;
    p = -(c₁v₀ + c₂v₁ + c₃q). Substep 2 gives x = u₂:  v₂ = q + c₃u₂;  then p = (4/h)((2/h) u₂ + v₂), q = -(4/h) u₂.
    With half -1 nothing is solved: the load is made anew from u and v as they stand.
    """
    c1, c2, c3, two_h, four_h = scheme[0], scheme[1], scheme[2], scheme[3], scheme[4]
    nodes = node_class.shape[0]
    x = [load[b, 0] * 0.0 for _ in ti.static(range(pattern.dofs))]
    p = [load[b, 0] * 0.0 for _ in ti.static(range(pattern.dofs))]
    q = [load[b, 0] * 0.0 for _ in ti.static(range(pattern.dofs))]
    done = [load[b, 0] * 0.0 for _ in ti.static(range(pattern.dofs))]
    ahead = [load[b, 0] * 0.0 for _ in ti.static(range(pattern.dofs))]
    for back in range(nodes):
        node = nodes - 1 - back
        if half >= 0:
            take_back(pattern, rows, rate, node_class[node], b, node, load, x)
        if half == 0:
            for r in ti.static(range(pattern.dofs)):
                u0 = displacement[b, node * pattern.dofs + r]
                v0 = velocity[b, node * pattern.dofs + r]
                u1 = x[r] - u0
                v1 = two_h * (u1 - u0) - v0
                q[r] = c1 * u0 + c2 * u1
                p[r] = 0.0 - ((c1 * v0 + c2 * v1) + c3 * q[r])
                displacement[b, node * pattern.dofs + r] = q[r]
        else:
            for r in ti.static(range(pattern.dofs)):
                v2 = velocity[b, node * pattern.dofs + r]
                if half == 1:
                    v2 = displacement[b, node * pattern.dofs + r] + c3 * x[r]
                    displacement[b, node * pattern.dofs + r] = x[r]
                    velocity[b, node * pattern.dofs + r] = v2
                else:
                    x[r] = displacement[b, node * pattern.dofs + r]
                p[r] = four_h * (two_h * x[r] + v2)
                q[r] = 0.0 - four_h * x[r]
        carry_products(pattern, rows, node_class, rate, b, node, back, p, q, done, ahead, load)
    for r in ti.static(range(pattern.dofs)):
        load[b, r] = done[r]


@ti.func
def take_back(pattern: ti.template(), rows: ti.template(), rate, kind, b, node, load: ti.template(), x: ti.template()):
    """x_i = t_i - B_i x_i+1, in place of the following node's x."""
    t = [load[b, node * pattern.dofs + r] for r in ti.static(range(pattern.dofs))]
    for r in ti.static(range(pattern.dofs)):
        t[r] = t[r] + row_product(rows, rate, kind, pattern.back[r], x)
    for r in ti.static(range(pattern.dofs)):
        x[r] = t[r]


@ti.func
def carry_products(
    pattern: ti.template(), rows: ti.template(), node_class: ti.template(), rate, b, node, back,
    p: ti.template(), q: ti.template(), done: ti.template(), ahead: ti.template(), load: ti.template(),
):  # fmt: skip
    """M p - C q, complete for the following node, which is stored, and begun for this one and the one before it."""
    if back > 0:
        above = node_class[node + 1]
        for r in ti.static(range(pattern.dofs)):
            load[b, (node + 1) * pattern.dofs + r] = done[r] + (
                row_product(rows, rate, above, pattern.mass.previous[r], p)
                + row_product(rows, rate, above, pattern.damping.previous[r], q)
            )
    kind = node_class[node]
    below = node_class[ti.max(node - 1, 0)]
    for r in ti.static(range(pattern.dofs)):
        done[r] = ahead[r] + (
            row_product(rows, rate, kind, pattern.mass.own[r], p)
            + row_product(rows, rate, kind, pattern.damping.own[r], q)
        )
    for r in ti.static(range(pattern.dofs)):
        ahead[r] = row_product(rows, rate, below, pattern.mass.following[r], p) + row_product(
            rows, rate, below, pattern.damping.following[r], q
        )
