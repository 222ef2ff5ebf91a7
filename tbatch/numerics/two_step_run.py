"""The two-step composite scheme for the coupled system, with any treatment of contact.

With the exact contact it is what the batch engine does, in other algebra; with a frozen one it is the seed paper's own
variant, which takes the state of contact from t_n for both substeps.
"""

from tbatch.numerics.coupled import EffectiveMatrix
from tbatch.numerics.coupled_run import CoupledRun
from tbatch.numerics.two_step import TwoStep


class TwoStepMethod:
    """One run by the two-step scheme; see `tbatch.numerics.two_step` for its algebra.

    Args:
        run: The run.
        scheme: The coefficients.
    """

    def __init__(self, run: CoupledRun, scheme: TwoStep) -> None:
        self.run, self.scheme = run, scheme
        self.matrices = [EffectiveMatrix(run.system, 1.0, rate, rate * rate) for rate in scheme.rates]

    def advance(self, n: int) -> None:
        """One step from t_n to t_n+1."""
        run, system, scheme = self.run, self.run.system, self.scheme
        c1, c2, c3, two_h = scheme.c1, scheme.c2, scheme.c3, 2.0 / scheme.first
        run.treatment.begin(run.overlap)

        # Substep 1: K̂₁ (y₁ - y₀) = f₀ + f₁ - 2 K y₀ + (4/h) M v₀.
        y0, v0 = run.y, run.velocity
        load = 2.0 * two_h * (system.M @ v0) - 2.0 * (system.K @ y0) + 2.0 * system.load
        run.wheels.push(load, run.force)
        y1 = run.couple(self.matrices[0], load, y0, (n + scheme.splitting) * scheme.step)
        v1 = two_h * (y1 - y0) - v0

        # Substep 2: K̂₂ y₂ = f₂ - C w - M (c₁v₀ + c₂v₁ + c₃w) with w = c₁y₀ + c₂y₁.
        w = c1 * y0 + c2 * y1
        known = c1 * v0 + c2 * v1
        load = system.load - system.C @ w - system.M @ (known + c3 * w)
        run.y = run.couple(self.matrices[-1], load, 0.0, (n + 1.0) * scheme.step)
        run.velocity = w + c3 * run.y
        run.acceleration = known + c3 * run.velocity
