"""Newmark's method and HHT-α for the coupled system.

    M a₁ + (1 + α)(C v₁ + K y₁ - f₁) - α (C v₀ + K y₀ - f₀) = 0        f = ΓᵀP₀ - LᵀF
    y₁ = y* + β Δt² a₁     y* = y₀ + Δt v₀ + (½ - β) Δt² a₀
    v₁ = v* + γ Δt a₁      v* = v₀ + (1 - γ) Δt a₀

α = 0, β = ¼, γ = ½ is Newmark's average acceleration. HHT-α takes α in [-⅓, 0], β = (1 - α)²/4, γ = ½ - α: second order
and damped at high frequencies (Hilber, Hughes and Taylor, *Earthq. Eng. Struct. Dyn.* 5 (1977) 283-292). Contact forces
enter as the stiffness forces do, weighted between the ends of the step.
"""

from dataclasses import dataclass

import numpy as np

from tbatch.numerics.coupled import EffectiveMatrix
from tbatch.numerics.coupled_run import CoupledRun


@dataclass(frozen=True)
class Newmark:
    """Coefficients for one step length.

    Args:
        step: Δt [s], positive.
        alpha: α of HHT [-], from -1/3 to 0; 0 is Newmark's average acceleration.

    Raises:
        ValueError: If the step is not positive and finite or α lies outside [-1/3, 0].
    """

    step: float
    alpha: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0.0):
            raise ValueError(f"step = {self.step!r}: a positive, finite time step in s is required")
        if not -1.0 / 3.0 <= self.alpha <= 0.0:
            raise ValueError(f"alpha = {self.alpha!r}: a number from -1/3 to 0 is required")

    @property
    def beta(self) -> float:
        """β [-]."""
        return 0.25 * (1.0 - self.alpha) ** 2

    @property
    def gamma(self) -> float:
        """γ [-]."""
        return 0.5 - self.alpha

    @property
    def weights(self) -> tuple[float, float, float]:
        """K̂/(1 + α) = k K + c C + m M: k [-], c [1/s], m [1/s²]."""
        return (
            1.0,
            self.gamma / (self.beta * self.step),
            1.0 / (self.beta * self.step**2 * (1.0 + self.alpha)),
        )

    def amplification(self, omega: float, damping_ratio: float = 0.0) -> np.ndarray:
        """Matrix that advances (u, v, a) of a free oscillator by one step.

        Args:
            omega: Natural angular frequency [rad/s].
            damping_ratio: Fraction of critical damping [-].

        Returns:
            Amplification matrix, shape (3, 3), acting on (u [m], v [m/s], a [m/s²]).
        """
        h, a, b, g = self.step, self.alpha, self.beta, self.gamma
        damping, stiffness = 2.0 * damping_ratio * omega, omega**2
        predict_u = np.array([1.0, h, (0.5 - b) * h * h])
        predict_v = np.array([0.0, 1.0, (1.0 - g) * h])
        resist = 1.0 + (1.0 + a) * (damping * g * h + stiffness * b * h * h)
        known = a * np.array([stiffness, damping, 0.0]) - (1.0 + a) * (damping * predict_v + stiffness * predict_u)
        acceleration = known / resist
        return np.stack([predict_u + b * h * h * acceleration, predict_v + g * h * acceleration, acceleration])


class NewmarkMethod:
    """One run by Newmark or HHT-α.

    Args:
        run: The run.
        scheme: The coefficients.
    """

    def __init__(self, run: CoupledRun, scheme: Newmark) -> None:
        self.run, self.scheme = run, scheme
        self.matrix = EffectiveMatrix(run.system, *scheme.weights)

    def advance(self, n: int) -> None:
        """One step from t_n to t_n+1."""
        run, system, scheme = self.run, self.run.system, self.scheme
        h, share = scheme.step, scheme.alpha / (1.0 + scheme.alpha)
        _, c, m = scheme.weights
        run.treatment.begin(run.overlap)
        predicted = run.y + h * run.velocity + (0.5 - scheme.beta) * h * h * run.acceleration
        velocity = run.velocity + (1.0 - scheme.gamma) * h * run.acceleration
        load = m * (system.M @ predicted) + system.C @ (c * predicted - velocity) + system.load
        if share:
            load = load - share * run.unbalanced()
        run.y = run.couple(self.matrix, load, 0.0, (n + 1.0) * h)
        run.acceleration = (run.y - predicted) / (scheme.beta * h * h)
        run.velocity = velocity + scheme.gamma * h * run.acceleration
