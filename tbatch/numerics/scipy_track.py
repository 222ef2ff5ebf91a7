"""A track's matrices and factors in SciPy's forms: banded Cholesky for K̂, sparse products."""

from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from tbatch.numerics.two_step import TwoStep, effective
from tbatch.physics.track import Track


class ScipyTrack:
    """A track's matrices and factors for one step length, in SciPy's forms.

    Args:
        track: The track; not a rigid one.
        scheme: The two-step scheme.
    """

    def __init__(self, track: Track, scheme: TwoStep) -> None:
        self.track, self.scheme = track, scheme
        self.stiffness, self.damping, self.mass = (
            part.to_csc().tocsr() for part in (track.stiffness, track.damping, track.mass)
        )
        matrices = [effective(track.stiffness, track.damping, track.mass, rate) for rate in scheme.rates]
        self.factors = [cholesky_banded(one.pinned(track.pinned, unit=1.0).banded(), lower=True) for one in matrices]
        self.free = (~track.pinned).ravel().astype(float)

    @cached_property
    def columns(self) -> list[np.ndarray]:
        """K̂⁻¹ at all rail dofs [m/N], one array a rate, shape (2 * node, node * dof)."""
        track = self.track
        rail = (np.arange(track.node_count)[:, None] * track.node_dofs + np.arange(2)).ravel()
        units = np.zeros((track.node_count * track.node_dofs, len(rail)))
        units[rail, np.arange(len(rail))] = self.free[rail]
        return [np.ascontiguousarray(cho_solve_banded((factor, True), units).T) for factor in self.factors]

    def solve(self, rate: int, load: np.ndarray) -> np.ndarray:
        """K̂⁻¹ load, zero at pinned dofs; shape (node * dof, ...)."""
        free = self.free.reshape(-1, *(1,) * (load.ndim - 1))
        return cho_solve_banded((self.factors[rate], True), load * free, check_finite=False)

    def advance(
        self, u: np.ndarray, velocity: np.ndarray, first: np.ndarray, second: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """One step under given loads.

        Args:
            u: Displacements u₀ [m, -], shape (node * dof,).
            velocity: Velocities v₀ [m/s, 1/s], same shape.
            first: f₀ + f₁ [N], same shape.
            second: f₂ [N], same shape.

        Returns:
            u₂ and v₂.
        """
        scheme = self.scheme
        c1, c2, c3, two_h = scheme.c1, scheme.c2, scheme.c3, 2.0 / scheme.first
        load = first + 2.0 * two_h * (self.mass @ velocity) - 2.0 * (self.stiffness @ u)
        u1 = u + self.solve(0, load)
        v1 = two_h * (u1 - u) - velocity
        w = c1 * u + c2 * u1
        load = second - self.damping @ w - self.mass @ (c1 * velocity + c2 * v1 + c3 * w)
        u2 = self.solve(len(self.factors) - 1, load)
        return u2, w + c3 * u2
