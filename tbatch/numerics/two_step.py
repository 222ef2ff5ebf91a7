"""Coefficients of the two-step composite scheme: trapezoidal rule, then three-point backward difference.

A step of length Δt is split at γΔt. With h = γΔt, u₀ at t_n, u₁ at t_n + γΔt and u₂ at t_n + Δt:

    substep 1   v₁ = 2 (u₁ - u₀)/h - v₀        a₁ = 4 (u₁ - u₀)/h² - 4 v₀/h - a₀      K̂₁ = K + (2/h) C + (4/h²) M
    substep 2   v₂ = c₁u₀ + c₂u₁ + c₃u₂        a₂ = c₁v₀ + c₂v₁ + c₃v₂                K̂₂ = K + c₃ C + c₃² M

With equilibrium at t_n, substep 1 solves in the increment, without acceleration or damping product:

    K̂₁ (u₁ - u₀) = f₀ + f₁ - 2 K u₀ + (4/h) M v₀

or, K being K̂₁ - (2/h) C - (4/h²) M, in the sum, which needs the same two products as substep 2 and none with K:

    K̂₁ (u₁ + u₀) = f₀ + f₁ + (4/h) [M ((2/h) u₀ + v₀) + C u₀]
    K̂₂ u₂ = f₂ - M (c₁v₀ + c₂v₁ + c₃w) - C w,   w = c₁u₀ + c₂u₁

Source: Bathe and Baig, *Computers & Structures* 83 (2005) 2513-2524, for the scheme with γ = 1/2; the splitting
γ = 2 - √2, for which K̂₁ = K̂₂, is Bank et al., *IEEE Trans. Electron Devices* 32 (1985) 1992-2007 (TR-BDF2).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

EQUAL_SPLITTING = 2.0 - 2.0**0.5
"""The splitting γ = 2 - √2, for which both substeps have one effective matrix."""


@dataclass(frozen=True)
class TwoStep:
    """The scheme for one step length.

    Args:
        step: Δt [s], positive.
        splitting: γ [-], inside (0, 1).

    Raises:
        ValueError: If the step is not positive and finite or the splitting lies outside (0, 1).
    """

    step: float
    splitting: float = EQUAL_SPLITTING

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0.0):
            raise ValueError(f"step = {self.step!r}: a positive, finite time step in s is required")
        if not 0.0 < self.splitting < 1.0:
            raise ValueError(f"splitting = {self.splitting!r}: a number between 0 and 1 (exclusive) is required")

    @property
    def first(self) -> float:
        """Length h = γΔt of the first substep [s]."""
        return self.splitting * self.step

    @property
    def c1(self) -> float:
        """Weight of t_n in the backward difference [1/s]."""
        return (1.0 - self.splitting) / (self.splitting * self.step)

    @property
    def c2(self) -> float:
        """Weight of t_n + γΔt in the backward difference [1/s]."""
        return -1.0 / ((1.0 - self.splitting) * self.splitting * self.step)

    @property
    def c3(self) -> float:
        """Weight of t_n + Δt in the backward difference [1/s]."""
        return (2.0 - self.splitting) / ((1.0 - self.splitting) * self.step)

    @property
    def shared(self) -> bool:
        """Whether both substeps have the same effective matrix, to round-off."""
        return abs(2.0 / self.first - self.c3) <= 1e-12 * self.c3

    @property
    def rates(self) -> tuple[float, ...]:
        """The factor c of each distinct effective matrix K + c C + c² M [1/s]: one entry if shared, else two."""
        return (self.c3,) if self.shared else (2.0 / self.first, self.c3)

    def amplification(self, omega: float, damping_ratio: float = 0.0) -> np.ndarray:
        """Matrix that advances (u, v) of a free oscillator by one step.

        Args:
            omega: Natural angular frequency [rad/s].
            damping_ratio: Fraction of critical damping [-].

        Returns:
            Amplification matrix, shape (2, 2), acting on (u [m], v [m/s]).
        """
        damping, stiffness = 2.0 * damping_ratio * omega, omega**2
        advanced = np.empty((2, 2))
        for column, (u0, v0) in enumerate(((1.0, 0.0), (0.0, 1.0))):
            rate = 2.0 / self.first
            u1 = u0 + (2.0 * rate * v0 - 2.0 * stiffness * u0) / (stiffness + rate * damping + rate**2)
            v1 = rate * (u1 - u0) - v0
            known = self.c1 * u0 + self.c2 * u1
            load = -damping * known - (self.c1 * v0 + self.c2 * v1 + self.c3 * known)
            u2 = load / (stiffness + self.c3 * damping + self.c3**2)
            advanced[:, column] = u2, known + self.c3 * u2
        return advanced


def effective(stiffness: Any, damping: Any, mass: Any, rate: float) -> Any:
    """Effective matrix K + c C + c² M for any kind of array that adds and scales.

    Args:
        stiffness: K [N/m].
        damping: C [N s/m].
        mass: M [kg].
        rate: c [1/s], one of `TwoStep.rates`.
    """
    return stiffness + rate * damping + rate * rate * mass
