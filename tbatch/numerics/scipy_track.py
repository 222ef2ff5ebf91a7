"""A track's matrices and factors in SciPy's forms: sparse products; banded Cholesky for K̂.

K̂ of an imported track is not banded: SuperLU factorises it, in an order of its own.
"""

from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse.linalg import splu

from tbatch.numerics.two_step import TwoStep, effective
from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.line import Line, TrackMatrix


class ScipyFactor:
    """One matrix of a track, factorised by SciPy; solutions vanish at pinned dofs whatever the load.

    Args:
        matrix: The matrix.
        pinned: True where a dof is held, shape (node, dof).
    """

    def __init__(self, matrix: TrackMatrix, pinned: np.ndarray) -> None:
        regular = matrix.pinned(pinned, unit=1.0)
        self.free = (~pinned).ravel().astype(float)
        self._band = self._solver = None
        if isinstance(regular, BlockTridiagonal):
            self._band = cholesky_banded(regular.banded(), lower=True)
        else:
            self._solver = splu(regular.to_csc())

    def solve(self, load: np.ndarray) -> np.ndarray:
        """The matrix's inverse times a load, shape (node * dof, ...)."""
        moving = load * self.free.reshape(-1, *(1,) * (load.ndim - 1))
        if self._band is not None:
            return cho_solve_banded((self._band, True), moving, check_finite=False)
        assert self._solver is not None
        return self._solver.solve(moving)


class ScipyTrack:
    """A track's matrices and factors for one step length, in SciPy's forms.

    Args:
        track: The track; not a rigid one.
        scheme: The two-step scheme.
    """

    def __init__(self, track: Line, scheme: TwoStep) -> None:
        self.track, self.scheme = track, scheme
        self.stiffness, self.damping, self.mass = (
            part.to_csc().tocsr() for part in (track.stiffness, track.damping, track.mass)
        )
        K, C, M = track.stiffness, track.damping, track.mass
        self.factors = [ScipyFactor(effective(K, C, M, rate), track.pinned) for rate in scheme.rates]

    @cached_property
    def columns(self) -> list[np.ndarray]:
        """K̂⁻¹ at all rail dofs [m/N], one array a rate, shape (2 * rail node, node * dof)."""
        track = self.track
        rows = track.layer_rows(np.arange(track.element_count))
        rail = np.append(rows[:, :2].ravel(), rows[-1, 2:])
        units = np.zeros((track.node_count * track.node_dofs, len(rail)))
        units[rail, np.arange(len(rail))] = 1.0
        return [np.ascontiguousarray(factor.solve(units).T) for factor in self.factors]

    def solve(self, rate: int, load: np.ndarray) -> np.ndarray:
        """K̂⁻¹ load, zero at pinned dofs; shape (node * dof, ...)."""
        return self.factors[rate].solve(load)

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
