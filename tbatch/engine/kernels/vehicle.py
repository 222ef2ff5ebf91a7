"""The vehicle's half of each substep: dense products with the run's own matrices, all lanes at once.

q is measured from rest on a rigid rail, so that the weight has gone: M q̈ + C q̇ + K q = Γᵀ (P₀ - F).
"""

import taichi as ti


@ti.func
def dense_product(n, memory: ti.template(), b, matrix, vector, r):
    """Row r of a matrix in memory times a vector in memory."""
    total = memory[b, vector] * 0.0
    for c in range(n):
        total = total + memory[b, matrix + r * n + c] * memory[b, vector + c]
    return total


@ti.func
def free_wheel(at: ti.template(), memory: ti.template(), b, rate, half, dof):
    """Displacement of a wheel dof at the end of the substep, were there no contact force to come."""
    z = dense_product(at.dofs, memory, b, at.inverse + rate * at.dofs * at.dofs, at.vehicle_load, dof)
    if half == 0:
        z = memory[b, at.displacement + dof] + z
    return z


@ti.func
def vehicle_load_first(at: ti.template(), memory: ti.template(), wheel_dofs: ti.template(), b, scheme: ti.template()):
    """Load of substep 1: (4/h) M v₀ - 2 K q₀ + f₀ and the weight's share 2 P₀ of f₀ + f₁."""
    for r in range(at.dofs):
        memory[b, at.acceleration + r] = scheme[4] * memory[b, at.velocity + r]
    for r in range(at.dofs):
        memory[b, at.vehicle_load + r] = dense_product(
            at.dofs, memory, b, at.stiffness, at.displacement, r
        ) + dense_product(at.dofs, memory, b, at.mass, at.acceleration, r)
    for j in range(at.wheels):
        row = at.vehicle_load + wheel_dofs[j]
        memory[b, row] = memory[b, row] + (2.0 * memory[b, at.load + j] - memory[b, at.force + j])


@ti.func
def pull_wheels(at: ti.template(), memory: ti.template(), wheel_dofs: ti.template(), b):
    """Add the contact forces of this substep to the vehicle's load."""
    for j in range(at.wheels):
        row = at.vehicle_load + wheel_dofs[j]
        memory[b, row] = memory[b, row] - memory[b, at.force + j]


@ti.func
def vehicle_first(at: ti.template(), memory: ti.template(), wheel_dofs: ti.template(), b, rate, scheme: ti.template()):
    """End substep 1: d = K̂⁻¹ load, w = c₁q₀ + c₂q₁ in place of q₀, and the load of substep 2."""
    c1, c2, c3, two_h = scheme[0], scheme[1], scheme[2], scheme[3]
    for r in range(at.dofs):
        d = dense_product(at.dofs, memory, b, at.inverse + rate * at.dofs * at.dofs, at.vehicle_load, r)
        q0 = memory[b, at.displacement + r]
        v0 = memory[b, at.velocity + r]
        w = c1 * q0 + c2 * (q0 + d)
        memory[b, at.displacement + r] = w
        memory[b, at.acceleration + r] = 0.0 - ((c1 * v0 + c2 * (two_h * d - v0)) + c3 * w)
    for r in range(at.dofs):
        memory[b, at.vehicle_load + r] = dense_product(at.dofs, memory, b, at.mass, at.acceleration, r) + dense_product(
            at.dofs, memory, b, at.damping, at.displacement, r
        )
    for j in range(at.wheels):
        row = at.vehicle_load + wheel_dofs[j]
        memory[b, row] = memory[b, row] + memory[b, at.load + j]


@ti.func
def vehicle_second(at: ti.template(), memory: ti.template(), b, rate, scheme: ti.template()):
    """End substep 2: q₂ = K̂⁻¹ load, v₂ = w + c₃q₂, and a₂ = c₁v₀ + c₂v₁ + c₃v₂ in the acceleration rows."""
    c3 = scheme[2]
    for r in range(at.dofs):
        q = dense_product(at.dofs, memory, b, at.inverse + rate * at.dofs * at.dofs, at.vehicle_load, r)
        memory[b, at.velocity + r] = memory[b, at.displacement + r] + c3 * q
        memory[b, at.acceleration + r] = (c3 * c3) * q - memory[b, at.acceleration + r]
        memory[b, at.displacement + r] = q
