"""How a method finds the contact forces at the end of a (sub)step: exactly, with a frozen state, or by iteration.

Without the new contact forces F the overlaps would be δ_free; with them they are δ = δ_free - (H + A) F, where
H = L K̂⁻¹ Lᵀ is the flexibility of vehicle and track under the wheels and A the local rail compliance. The treatments
differ in what they take for F(δ).
"""

from typing import Protocol

import numpy as np

from tbatch.numerics.contact_solve import solve_contact
from tbatch.physics.contact import ContactConstants

ITERATION_LIMIT = 200
"""Passes between the two subsystems after which the iteration has failed."""
FORCE_TOLERANCE = 1e-6
"""Change in force, as a fraction of the largest static load, that ends the iteration."""


class Treatment(Protocol):
    """Finds contact forces."""

    iterations: int
    """Passes between the two subsystems in the last call of `solve`."""

    def begin(self, overlap: np.ndarray) -> None:
        """Take note of the overlaps δ at the start of a step [m], shape (wheel,)."""
        ...

    def solve(
        self, free: np.ndarray, flexibility: np.ndarray, compliance: np.ndarray, guess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, bool]:
        """Contact forces.

        Args:
            free: δ_free [m], shape (wheel,).
            flexibility: H [m/N], shape (wheel, wheel).
            compliance: A [m/N], shape (wheel, wheel).
            guess: Forces at the start of the substep [N], shape (wheel,).

        Returns:
            F [N] and δ [m], shape (wheel,) each, and whether they were found.
        """
        ...


class ExactContact:
    """δ + (H + A) F(δ) = δ_free, to round-off: as the batch engine does it. It decides separation within the substep.

    Args:
        constants: The law's constants.
    """

    def __init__(self, constants: ContactConstants) -> None:
        self.constants, self.iterations = constants, 1

    def begin(self, overlap: np.ndarray) -> None:
        """Nothing is frozen."""

    def solve(
        self, free: np.ndarray, flexibility: np.ndarray, compliance: np.ndarray, guess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, bool]:
        """The exact forces."""
        return solve_contact(free, flexibility + compliance, self.constants, guess)


class FrozenContact:
    """Springs whose state is that of the start of the step: k = F(δ_n)/(δ_n - δ_sep) for a wheel in contact, else none.

    For the linear laws k is k_c, and what is frozen is which wheels are in contact; for Hertz k is the secant K_H √δ_n.
    There is no iteration. A wheel that leaves the rail within the step is still held, F < 0, and one that lands goes
    through the rail until the next step: the lag that makes these methods go wrong at a flat.

    Args:
        constants: The law's constants.
    """

    def __init__(self, constants: ContactConstants) -> None:
        self.constants, self.iterations = constants, 1
        self.stiffness = np.zeros_like(constants.stiffness)

    def begin(self, overlap: np.ndarray) -> None:
        """Freeze the springs."""
        depth = np.maximum(overlap - self.constants.separation, 0.0)
        powered = depth ** (self.constants.exponent - 1.0)
        self.stiffness = np.where(depth > 0.0, self.constants.stiffness * powered, 0.0)

    def springs(self, compliance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Wheels in contact, shape (held,), and S: F = S (δ + A F - δ_sep) for them [N/m], shape (held, held)."""
        held = np.flatnonzero(self.stiffness)
        give = np.diag(1.0 / self.stiffness[held]) + compliance[np.ix_(held, held)]
        return held, np.linalg.inv(give)

    def solve(
        self, free: np.ndarray, flexibility: np.ndarray, compliance: np.ndarray, guess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, bool]:
        """The forces of the frozen springs; some may pull."""
        total = flexibility + compliance
        held = np.flatnonzero(self.stiffness)
        force = np.zeros_like(free)
        if held.size:
            give = np.diag(1.0 / self.stiffness[held]) + total[np.ix_(held, held)]
            force[held] = np.linalg.solve(give, (free - self.constants.separation)[held])
        overlap = free - total @ force
        return force, overlap, bool(np.isfinite(overlap).all())


class IteratedContact:
    """Fixed-point iteration between the two subsystems: forces move wheels and rail, whose overlaps give forces.

    A pass takes the overlaps that the last forces lead to and the law's forces at these, local compliance included,
    until no force changes by `FORCE_TOLERANCE` of the static load. Both subsystems are linear, so a pass needs only
    their flexibility H under the wheels, not their whole solution: the same iterates for less work.

    The plain iteration converges where the law's slope times H is below one, which fails for long steps. With `relaxed`
    each change is scaled by Aitken's factor, at most one, so that it converges to the same forces there too (Irons and
    Tuck, *Int. J. Numer. Methods Eng.* 1 (1969) 275-277).

    Args:
        constants: The law's constants.
        load: Static loads P₀ [N], shape (wheel,).
        relaxed: Whether to relax.
    """

    def __init__(self, constants: ContactConstants, load: np.ndarray, *, relaxed: bool = True) -> None:
        self.constants, self.relaxed, self.iterations = constants, relaxed, 0
        self.tolerance = FORCE_TOLERANCE * float(load.max())

    def begin(self, overlap: np.ndarray) -> None:
        """Nothing is frozen."""

    def solve(
        self, free: np.ndarray, flexibility: np.ndarray, compliance: np.ndarray, guess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, bool]:
        """The forces after the last pass; not found if `ITERATION_LIMIT` passes did not suffice."""
        force, factor, before = guess, 1.0, None
        for count in range(1, ITERATION_LIMIT + 1):
            self.iterations = count
            implied, overlap, found = self._law(free - flexibility @ force, compliance, force)
            change = implied - force
            if not found or not np.isfinite(change).all():
                return force, overlap, False
            if np.abs(change).max() < self.tolerance:
                return implied, overlap, True
            if self.relaxed and before is not None:
                turn = change - before
                length = float(turn @ turn)
                factor = min(max(-factor * float(before @ turn) / length, 1e-3), 1.0) if length else 1.0
            force, before = force + factor * change, change
        return force, overlap, False

    def _law(self, gap: np.ndarray, compliance: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """Forces that obey the law in series with the local compliance."""
        if compliance.any():
            return solve_contact(gap, compliance, self.constants, guess)
        return self.constants.force(gap), gap, True
