"""Rest of a vehicle on a rigid, level rail: static loads and the contact law's constants."""

from dataclasses import dataclass

import numpy as np

from tbatch.physics.contact import Contact, ContactConstants
from tbatch.physics.quantities import FloatArray
from tbatch.physics.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class RigidRest:
    """The vehicle at rest with r = 0 on a rail that does not give."""

    displacement: FloatArray
    """z_s, from the unloaded position [m or rad], shape (dof,); at a wheel dof it is the contact's approach"""
    load: FloatArray
    """static wheel loads P0 [N], shape (wheel,)"""
    constants: ContactConstants
    """the contact law at these loads"""


def rest_on_rigid_rail(vehicle: Vehicle, contact: Contact, rails: int) -> RigidRest:
    """Return the static equilibrium K z + Γᵀ F(z_w) = w of the vehicle.

    The other dofs are eliminated first. What is left, S d + F(d) = b with the wheels' overlaps d, is a convex problem
    also where the loads depend on the contact's own stiffness, as those of a coach with uneven weight do.

    Raises:
        ValueError: where the weight cannot be carried or would lift a wheel.
    """
    wheels = np.array(vehicle.wheel_dofs)
    others = np.setdiff1d(np.arange(vehicle.dof_count), wheels)
    K, w = vehicle.stiffness, vehicle.weight
    flexibility = vehicle.held_flexibility()
    unbalanced = w[others] - K[np.ix_(others, others)] @ (flexibility @ w[others])
    if np.abs(unbalanced).max(initial=0.0) > 1e-6 * np.abs(w).max(initial=0.0):
        dof = int(others[np.argmax(np.abs(unbalanced))])
        raise ValueError(
            f"weight of dof {dof} ({vehicle.dof_names[dof]}) = {w[dof]:.6g} N: no spring carries it, must be 0 there"
        )
    coupling = K[np.ix_(wheels, others)]
    b = w[wheels] - coupling @ (flexibility @ w[others])
    S = K[np.ix_(wheels, wheels)] - coupling @ flexibility @ coupling.T
    coefficient, exponent = contact.static_law(rails, vehicle.wheel_radius)
    overlap = _solve(S, b, coefficient, exponent)
    load = b - S @ overlap
    negligible = 1e-9 * np.abs(b).max(initial=0.0)
    if (load < -negligible).any():
        wheel = int(np.argmin(load))
        raise ValueError(
            f"static load of wheel {wheel + 1} = {load[wheel]:.6g} N: the weight would lift it; must be 0 or more [N]"
        )
    load = np.where(load <= negligible, 0.0, load)
    constants = contact.resolve(load, rails, wheel_radius=vehicle.wheel_radius)
    displacement = np.zeros(vehicle.dof_count)
    displacement[wheels] = constants.approach
    displacement[others] = flexibility @ (w[others] - coupling.T @ constants.approach)
    return RigidRest(displacement, load, constants)


def _solve(S: FloatArray, b: FloatArray, coefficient: float, exponent: float) -> FloatArray:
    """Return d with S d + coefficient |d|^exponent sign(d) = b, by Newton's method damped on its energy.

    The law is continued as an odd function, so that a solution exists for every b: a wheel that would have to be held
    down shows as a negative d.
    """
    scale = (np.abs(b).max(initial=0.0) / coefficient) ** (1.0 / exponent)
    if scale == 0.0:
        return np.zeros_like(b)

    def energy(d: FloatArray) -> float:
        stored = coefficient * np.abs(d) ** (exponent + 1.0) / (exponent + 1.0)
        return float(stored.sum() + 0.5 * d @ S @ d - b @ d)

    d = np.sign(b) * (np.abs(b) / coefficient) ** (1.0 / exponent)
    for _ in range(200):
        residual = S @ d + coefficient * np.sign(d) * np.abs(d) ** exponent - b
        # Hertz has no stiffness at d = 0: a floor there keeps the matrix regular, and only slows the last digits.
        tangent = exponent * coefficient * np.maximum(np.abs(d), 1e-9 * scale) ** (exponent - 1.0)
        step = -np.linalg.solve(S + np.diag(tangent), residual)
        if np.abs(step).max() <= 1e-15 * scale:
            break
        length, before, slope = 1.0, energy(d), float(residual @ step)
        while length > 1e-6 and energy(d + length * step) > before + 1e-4 * length * slope + 1e-14 * abs(before):
            length *= 0.5
        d = d + length * step
    return d
