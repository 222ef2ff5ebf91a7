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
def backward_sweep_first(
    pattern: ti.template(), rows: ti.template(), node_class: ti.template(), rate, b, scheme: ti.template(),
    displacement: ti.template(), velocity: ti.template(), load: ti.template(),
):  # fmt: skip
    """Substep 1: increments d = u₁ - u₀ from node to node, and with them the load of substep 2.

    v₁ = (2/h) d - v₀;  w = c₁u₀ + c₂u₁ replaces u₀;  p = -(c₁v₀ + c₂v₁ + c₃w);  load becomes M p - C w.
    """
    c1, c2, c3, two_h = scheme[0], scheme[1], scheme[2], scheme[3]
    nodes = node_class.shape[0]
    zero = load[b, 0] * 0.0
    d_next = [zero for _ in ti.static(range(pattern.dofs))]
    p_next = [zero for _ in ti.static(range(pattern.dofs))]
    w_next = [zero for _ in ti.static(range(pattern.dofs))]
    half_done = [zero for _ in ti.static(range(pattern.dofs))]
    for back in range(nodes):
        node = nodes - 1 - back
        kind = node_class[node]
        d = [load[b, node * pattern.dofs + r] for r in ti.static(range(pattern.dofs))]
        p = [zero for _ in ti.static(range(pattern.dofs))]
        w = [zero for _ in ti.static(range(pattern.dofs))]
        for r in ti.static(range(pattern.dofs)):
            d[r] = d[r] + row_product(rows, rate, kind, pattern.back[r], d_next)
        for r in ti.static(range(pattern.dofs)):
            u0 = displacement[b, node * pattern.dofs + r]
            v0 = velocity[b, node * pattern.dofs + r]
            u1 = u0 + d[r]
            v1 = two_h * d[r] - v0
            w[r] = c1 * u0 + c2 * u1
            p[r] = 0.0 - ((c1 * v0 + c2 * v1) + c3 * w[r])
            displacement[b, node * pattern.dofs + r] = w[r]
        if back > 0:
            above = node_class[node + 1]
            for r in ti.static(range(pattern.dofs)):
                load[b, (node + 1) * pattern.dofs + r] = half_done[r] + (
                    row_product(rows, rate, above, pattern.mass.previous[r], p)
                    + row_product(rows, rate, above, pattern.damping.previous[r], w)
                )
        for r in ti.static(range(pattern.dofs)):
            half_done[r] = (
                row_product(rows, rate, kind, pattern.mass.own[r], p)
                + row_product(rows, rate, kind, pattern.mass.following[r], p_next)
            ) + (
                row_product(rows, rate, kind, pattern.damping.own[r], w)
                + row_product(rows, rate, kind, pattern.damping.following[r], w_next)
            )
        for r in ti.static(range(pattern.dofs)):
            d_next[r] = d[r]
            p_next[r] = p[r]
            w_next[r] = w[r]
    for r in ti.static(range(pattern.dofs)):
        load[b, r] = half_done[r]


@ti.func
def backward_sweep_second(
    pattern: ti.template(), rows: ti.template(), node_class: ti.template(), rate, b, scheme: ti.template(),
    displacement: ti.template(), velocity: ti.template(), load: ti.template(),
):  # fmt: skip
    """Substep 2: u₂ from node to node, v₂ = w + c₃u₂, and the next load, (4/h) M v₂ - 2 K u₂."""
    c3, four_h = scheme[2], scheme[4]
    nodes = node_class.shape[0]
    zero = load[b, 0] * 0.0
    u_next = [zero for _ in ti.static(range(pattern.dofs))]
    v_next = [zero for _ in ti.static(range(pattern.dofs))]
    half_done = [zero for _ in ti.static(range(pattern.dofs))]
    for back in range(nodes):
        node = nodes - 1 - back
        kind = node_class[node]
        u = [load[b, node * pattern.dofs + r] for r in ti.static(range(pattern.dofs))]
        v = [zero for _ in ti.static(range(pattern.dofs))]
        for r in ti.static(range(pattern.dofs)):
            u[r] = u[r] + row_product(rows, rate, kind, pattern.back[r], u_next)
        for r in ti.static(range(pattern.dofs)):
            v2 = displacement[b, node * pattern.dofs + r] + c3 * u[r]
            displacement[b, node * pattern.dofs + r] = u[r]
            velocity[b, node * pattern.dofs + r] = v2
            v[r] = four_h * v2
        if back > 0:
            above = node_class[node + 1]
            for r in ti.static(range(pattern.dofs)):
                load[b, (node + 1) * pattern.dofs + r] = half_done[r] + (
                    row_product(rows, rate, above, pattern.mass.previous[r], v)
                    + row_product(rows, rate, above, pattern.stiffness.previous[r], u)
                )
        for r in ti.static(range(pattern.dofs)):
            half_done[r] = (
                row_product(rows, rate, kind, pattern.mass.own[r], v)
                + row_product(rows, rate, kind, pattern.mass.following[r], v_next)
            ) + (
                row_product(rows, rate, kind, pattern.stiffness.own[r], u)
                + row_product(rows, rate, kind, pattern.stiffness.following[r], u_next)
            )
        for r in ti.static(range(pattern.dofs)):
            u_next[r] = u[r]
            v_next[r] = v[r]
    for r in ti.static(range(pattern.dofs)):
        load[b, r] = half_done[r]
