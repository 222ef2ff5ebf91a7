"""How a vehicle of any matrices stands on its wheels: its rigid lift, and what it does while they are held."""

import numpy as np
from scipy.linalg import eigh

from tbatch.physics.quantities import FloatArray


class OnWheels:
    """Masses and springs on wheels."""

    mass: FloatArray
    """M [kg, kg m2], shape (dof, dof)"""
    stiffness: FloatArray
    """K [N/m, N, N m], shape (dof, dof)"""
    wheel_dofs: tuple[int, ...]
    """vertical dof of each wheel"""
    dof_names: tuple[str, ...]

    @property
    def dof_count(self) -> int:
        """Number of dofs."""
        return self.mass.shape[0]

    @property
    def wheel_count(self) -> int:
        """Number of wheel dofs: wheelsets of a coach, the wheel of a column."""
        return len(self.wheel_dofs)

    def rigid_lift(self) -> FloatArray:
        """Return ι, shape (dof,): one at every wheel dof and K ι = 0, hence zero at the pitches.

        A plain vector of ones would load the pitches with J g.
        """
        wheels = np.array(self.wheel_dofs)
        others = np.setdiff1d(np.arange(self.dof_count), wheels)
        loose = self._loose_dofs()
        if loose:
            names = ", ".join(self.dof_names[dof] for dof in loose)
            raise ValueError(
                f"vehicle.stiffness leaves {names} free while the wheels are held, so that g M ι does not say what it "
                f"weighs: give vehicle.weight [N], shape ({self.dof_count},)"
            )
        lift = np.ones(self.dof_count)
        coupling = self.stiffness[np.ix_(others, wheels)].sum(axis=1)
        lift[others] = -self.held_flexibility() @ coupling
        # A dof that the lift does not move comes out as round-off: a pitch times its inertia would weigh something.
        lift[np.abs(lift) < 1e-12] = 0.0
        force = np.abs(self.stiffness @ lift)
        if (force > 1e-9 * np.abs(self.stiffness).sum(axis=1)).any():
            dof = int(np.argmax(force))
            raise ValueError(
                f"vehicle.stiffness holds the vehicle to something other than its wheels (dof {dof}, "
                f"{self.dof_names[dof]}): no rigid lift has K ι = 0, so give vehicle.weight [N], "
                f"shape ({self.dof_count},)"
            )
        return lift

    def held_flexibility(self) -> FloatArray:
        """Return the inverse of K of the dofs that are not wheels, the wheels being held, shape (other, other) [m/N].

        Where some of them are free it is the pseudo-inverse in mass-scaled coordinates: free motions stay zero.
        """
        scaled, scale = self._held_stiffness()
        return scale[:, None] * np.linalg.pinv(scaled, rcond=1e-12, hermitian=True) * scale

    def natural_frequencies(self) -> FloatArray:
        """Return the undamped natural frequencies on a rigid rail, wheels held, ascending [Hz]."""
        others = np.setdiff1d(np.arange(self.dof_count), self.wheel_dofs)
        if others.size == 0:
            return np.empty(0)
        held = np.ix_(others, others)
        squares = eigh(self.stiffness[held], self.mass[held], eigvals_only=True)
        return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)

    def _held_stiffness(self) -> tuple[FloatArray, FloatArray]:
        others = np.setdiff1d(np.arange(self.dof_count), self.wheel_dofs)
        scale = 1.0 / np.sqrt(np.diag(self.mass)[others])
        return scale[:, None] * self.stiffness[np.ix_(others, others)] * scale, scale

    def _loose_dofs(self) -> list[int]:
        """Return the dofs that can move without any spring force while the wheels are held."""
        others = np.setdiff1d(np.arange(self.dof_count), self.wheel_dofs)
        if others.size == 0:
            return []
        squares, shapes = np.linalg.eigh(self._held_stiffness()[0])
        free = shapes[:, squares <= 1e-12 * np.abs(squares).max()]
        return [int(dof) for dof in others[(np.abs(free) > 1e-6).any(axis=1)]]
