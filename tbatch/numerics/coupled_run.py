"""One run of the coupled system by any one-step method: what the methods share."""

from typing import Protocol

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from tbatch.numerics.contact_treatment import FrozenContact, Treatment
from tbatch.numerics.coupled import CoupledSystem, EffectiveMatrix, Wheels
from tbatch.numerics.initial import InitialState


class CoupledRun:
    """State of one run and the solve that every method calls at the end of its substeps.

    Args:
        system: The system.
        initial: Its initial state.
        treatment: How contact forces are found.
        refactor: Assemble and factorise the whole coupled matrix K̂ + LᵀSL anew at every solve, as the direct coupling
            is written in the literature, instead of the constant K̂ once. Same result to round-off, other cost; for
            a frozen contact only.

    Raises:
        ValueError: If `refactor` is asked of a contact that is not frozen.
    """

    def __init__(
        self, system: CoupledSystem, initial: InitialState, treatment: Treatment, *, refactor: bool = False
    ) -> None:
        if refactor and not isinstance(treatment, FrozenContact):
            raise ValueError("refactor: only a frozen contact has a coupled matrix; accepted here is refactor = False")
        self.system, self.treatment, self.refactor = system, treatment, refactor
        self.y, self.velocity = system.start(initial)
        self.force, self.overlap = initial.force.copy(), initial.overlap.copy()
        self.wheels = system.place(0.0)
        self.iterations = 0
        mass = EffectiveMatrix(system, 0.0, 0.0, 1.0)
        self.acceleration = mass.solve(self.unbalanced())

    def unbalanced(self) -> np.ndarray:
        """ΓᵀP₀ - LᵀF - C ẏ - K y [N], shape (dof,)."""
        load = self.system.load - self.system.C @ self.velocity - self.system.K @ self.y
        self.wheels.push(load, self.force)
        return load

    def couple(self, matrix: EffectiveMatrix, load: np.ndarray, base: np.ndarray | float, time: float) -> np.ndarray:
        """Solve K̂ (y - base) = load - LᵀF with the contact forces at a time, which are kept.

        Args:
            matrix: K̂.
            load: [N], shape (dof,).
            base: What y is an increment to [m, rad], shape (dof,) or 0.
            time: [s].

        Returns:
            y [m, rad], shape (dof,).

        Raises:
            FloatingPointError: If the contact forces were not found.
        """
        self.wheels = wheels = self.system.place(time)
        rest = self.system.inputs.rest.constants
        if self.refactor:
            return self._direct(matrix, load, base, wheels)
        y = base + matrix.solve(load)
        columns = matrix.columns(wheels)
        flexibility = np.einsum("iad,ad->ia", columns[:, wheels.rows], wheels.values)
        free = rest.approach + wheels.of(y) - wheels.level
        self.force, self.overlap, found = self.treatment.solve(free, flexibility, wheels.compliance, self.force)
        self.iterations += self.treatment.iterations
        if not found:
            raise FloatingPointError(f"the contact forces at t = {time:g} s were not found")
        return y - self.force @ columns

    def _direct(
        self, matrix: EffectiveMatrix, load: np.ndarray, base: np.ndarray | float, wheels: Wheels
    ) -> np.ndarray:
        """Solve (K̂ + LᵀSL) y = load + K̂ base - LᵀS (δ₀ - δ_sep - r)."""
        treatment, rest = self.treatment, self.system.inputs.rest.constants
        assert isinstance(treatment, FrozenContact)
        if isinstance(base, np.ndarray):
            load = load + matrix.assembled @ base
        coupled, right = matrix.assembled, load * self.system.moves
        held, springs = treatment.springs(wheels.compliance)
        gap = rest.approach - rest.separation - wheels.level
        if held.size:
            # Rail dofs that are pinned take no part.
            entries = wheels.values[held] * self.system.moves[wheels.rows[held]]
            place = np.repeat(np.arange(len(held)), entries.shape[1]), wheels.rows[held].ravel()
            rows = csc_array((entries.ravel(), place), shape=(len(held), self.system.dofs))
            coupled = coupled + rows.T @ csc_array(springs) @ rows
            right -= rows.T @ (springs @ gap[held])
        y = splu(csc_array(coupled), permc_spec="MMD_AT_PLUS_A").solve(right)
        self.force = np.zeros_like(wheels.level)
        reach = wheels.of(y)
        if held.size:
            self.force[held] = springs @ (gap + reach)[held]
        self.overlap = rest.approach + reach - wheels.level - wheels.compliance @ self.force
        self.iterations += 1
        if not np.isfinite(self.overlap).all():
            raise FloatingPointError("the coupled system has no finite solution")
        return y


class Method(Protocol):
    """A run that can be advanced step by step."""

    run: CoupledRun

    def advance(self, n: int) -> None:
        """One step from t_n; raises FloatingPointError if it cannot be done."""
        ...
