"""How long a step may be: what it must resolve, in how many steps, and the step that does.

The wheel on its contact spring is the fastest thing that a step must follow: its half-period π √(m_w/k) is how long a
landing lasts, k being the law's slope at the static load. With ten steps in it the restitution of a bounce is right to
0.2 %. A flat needs twenty steps for its shape, a wave ten. Peak forces need more: sampled at step ends, that of a
landing on a 150 mm flat at 117 km/h is up to 20 % off with 8 steps a half-period (23 over the flat), 6 % with 17, 1.3 %
with 34 (tests/proof/test_proof_wheel_flat.py).
"""

from dataclasses import dataclass

import numpy as np

from tbatch.physics.static import RigidRest
from tbatch.physics.vehicle import Vehicle

STEPS_PER_HALF_PERIOD = 10
STEPS_PER_FLAT = 20
STEPS_PER_WAVE = 10


@dataclass(frozen=True)
class Resolution:
    """One thing that a step must resolve."""

    what: str
    time: float
    """How long it lasts [s]."""
    needed: int
    """Steps it must take."""

    @property
    def longest_step(self) -> float:
        """The longest step that resolves it [s]."""
        return self.time / self.needed

    def steps(self, step: float) -> float:
        """Steps it takes: from Δt [s]."""
        return self.time / step

    def resolved(self, step: float) -> bool:
        """Whether a step [s] resolves it, to round-off."""
        return step <= self.longest_step * (1.0 + 1e-9)


def contact_half_period(vehicle: Vehicle, rest: RigidRest) -> float:
    """The shortest π √(m_w/k) of a vehicle's wheels on their contact springs [s].

    Args:
        vehicle: The vehicle.
        rest: Its rest on a rigid rail, for the static loads and the law's constants.
    """
    constants = rest.constants
    depth = np.maximum(constants.approach - constants.separation, 0.0)
    slope = constants.stiffness * constants.exponent * depth ** (constants.exponent - 1.0)
    mass = np.diag(vehicle.mass)[list(vehicle.wheel_dofs)]
    loaded = slope > 0.0
    return float((np.pi * np.sqrt(mass[loaded] / slope[loaded])).min(initial=np.inf))


def resolutions(
    vehicle: Vehicle, rest: RigidRest, speed: float, *, flats: tuple[float, ...] = (), waves: tuple[float, ...] = ()
) -> list[Resolution]:
    """What a step must resolve, the most demanding first.

    Args:
        vehicle: The vehicle.
        rest: Its rest on a rigid rail.
        speed: The highest speed [m/s].
        flats: Lengths of flats [m].
        waves: Shortest wavelengths [m].
    """
    found = [
        Resolution("half-period of the wheel on its contact spring", contact_half_period(vehicle, rest),
                   STEPS_PER_HALF_PERIOD)
    ]  # fmt: skip
    if flats:
        found.append(Resolution(f"flat of {min(flats) * 1e3:g} mm", min(flats) / speed, STEPS_PER_FLAT))
    if waves:
        found.append(Resolution(f"shortest wave, {min(waves):g} m", min(waves) / speed, STEPS_PER_WAVE))
    return sorted((one for one in found if np.isfinite(one.time)), key=lambda one: one.longest_step)


def advice_table(step: float, found: list[Resolution]) -> str:
    """The table: what, how long, steps it takes, steps it needs, longest step; a line each.

    Args:
        step: Δt [s].
        found: What must be resolved.
    """
    width = max(len(one.what) for one in found)
    lines = [f"{'to resolve':<{width}}  lasts, ms  steps taken  needed  longest step, ms"]
    for one in found:
        taken = f"{one.steps(step):.1f}" + ("" if one.resolved(step) else " !")
        lines.append(
            f"{one.what:<{width}}  {one.time * 1e3:9.3g}  {taken:>11}  {one.needed:6d}  {one.longest_step * 1e3:16.3g}"
        )
    return "\n".join(lines)
