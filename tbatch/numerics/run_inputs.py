"""One run's constants, in the form that a step needs: what the kernels and the reference both read."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, inv

from tbatch.numerics.two_step import TwoStep, effective
from tbatch.numerics.window import Window
from tbatch.physics.long_profile import LongProfile
from tbatch.physics.profile import Profile
from tbatch.physics.static import RigidRest
from tbatch.physics.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class VehicleTables:
    """A vehicle's matrices as the step multiplies them."""

    stiffness: np.ndarray
    """-2 K [N/m], shape (dof, dof)."""
    mass: np.ndarray
    """M [kg], shape (dof, dof)."""
    damping: np.ndarray
    """-C [N s/m], shape (dof, dof)."""
    inverse: np.ndarray
    """K̂⁻¹ [m/N], shape (rate, dof, dof)."""

    @classmethod
    def of(cls, vehicle: Vehicle, scheme: TwoStep) -> "VehicleTables":
        """Invert the vehicle's effective matrix for each rate of the scheme.

        Raises:
            ValueError: If an effective matrix is singular.
        """
        inverses = []
        for rate in scheme.rates:
            try:
                inverse = inv(effective(vehicle.stiffness, vehicle.damping, vehicle.mass, rate))
            except LinAlgError:
                raise ValueError(f"vehicle {vehicle.name!r}: K + cC + c²M is singular for c = {rate:g} 1/s") from None
            inverses.append(0.5 * (inverse + inverse.T))
        return cls(-2.0 * vehicle.stiffness, vehicle.mass, -vehicle.damping, np.stack(inverses))


@dataclass(frozen=True, eq=False)
class RunInputs:
    """Everything constant during one run but the track."""

    vehicle: Vehicle
    tables: VehicleTables
    rest: RigidRest
    """Static loads and the contact law's constants."""
    speed: float
    """[m/s]."""
    start: float
    """x of wheel 1 at t = 0 [m]."""
    evaluate_from: float
    """Position beyond which a wheel's statistics count [m]."""
    steps: int
    """Length of the run in steps."""
    profile: Profile | LongProfile
    """r(x) of the rail over all that the wheels visit; on an endless track piece by piece."""
    wheel_profiles: tuple[Profile | None, ...]
    """ρ_j over one turn of each wheel; None for a round wheel."""
    circumference: float
    """Length of a turn [m]; 1 where all wheels are round."""
    window: Window
    """How the stepped line follows the vehicle."""
    passed: int
    """Periods that the stepped line has moved by at t = 0."""

    def positions(self, time: float) -> np.ndarray:
        """x_j [m] at a time [s], shape (wheel,)."""
        return (self.start + self.speed * time) - self.vehicle.wheel_offsets

    def local_positions(self, time: float, passed: float) -> np.ndarray:
        """Positions on the stepped line after it has moved by `passed` periods [m], shape (wheel,)."""
        return self.positions(time) - passed * self.window.period

    def visited(self, first: int, last: int, step: float) -> tuple[float, float]:
        """Smallest and largest x under any wheel from step `first` to step `last` of length `step` [s]."""
        low, high = (self.start + self.speed * min(n, self.steps) * step for n in (first, last))
        return low - float(self.vehicle.wheel_offsets.max()), high

    def levels(self, time: float) -> np.ndarray:
        """r_j [m], irregularity and wheel profile under each wheel at a time [s], shape (wheel,)."""
        levels = self.profile(self.positions(time))
        rolled = self.speed * time
        for wheel, own in enumerate(self.wheel_profiles):
            if own is not None:
                turns = np.floor(rolled / self.circumference)
                levels[wheel] = levels[wheel] + own(rolled - turns * self.circumference)
        return levels
