"""The contact forces of one run: δ + H F(δ) = δ_free, solved by damped Newton steps.

The same algorithm, operation by operation, as the lanes of `tbatch.engine.kernels.contact`; kept here in its plainest
form. H is symmetric and positive semidefinite and the law monotone, so the solution is unique.
"""

import math

import numpy as np

from tbatch.physics.contact import ContactConstants

NEWTON_LIMIT = 200
"""Newton steps after which a contact solve has failed."""
ROUND_OFF = 4e-15
"""A Newton step below this fraction of the largest terms of δ ends the solve."""


def law(constants: ContactConstants, overlap: list[float]) -> tuple[list[float], list[float], float]:
    """Forces, their slopes dF/dδ and the work Σ ∫F dδ.

    Args:
        constants: The law's constants, shape (wheel,) each.
        overlap: δ [m] of each wheel.
    """
    forces, slopes, work = [], [], 0.0
    for j, delta in enumerate(overlap):
        k = float(constants.stiffness[j])
        m = max(delta - float(constants.separation[j]), 0.0)
        root = math.sqrt(m)
        if constants.exponent == 1.5:
            force, slope, share = (k * m) * root, 1.5 * (k * root), 0.4
        else:
            force, slope, share = k * m, k if m > 0.0 else 0.0, 0.5
        forces.append(force)
        slopes.append(slope)
        work = work + share * (force * m)
    return forces, slopes, work


def solve_contact(
    free: np.ndarray, flexibility: np.ndarray, constants: ContactConstants, guess: np.ndarray
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Solve for the contact forces.

    Newton's method for δ + H F(δ) = δ_free, kept in the form δ = δ_free - H λ, damped by halving so that the convex
    function ½ λᵀHλ + Σ ∫F dδ always falls.

    Args:
        free: δ_free [m], shape (wheel,).
        flexibility: H [m/N], shape (wheel, wheel).
        constants: The law's constants.
        guess: Forces to start from [N], shape (wheel,).

    Returns:
        Forces [N] and overlaps δ [m], shape (wheel,) each, and whether the solve succeeded.
    """
    w = len(free)
    fr, h, lam = free.tolist(), flexibility.tolist(), guess.tolist()
    hl = [_dot(h[j], lam) for j in range(w)]
    if not all(map(math.isfinite, [*fr, *hl])):
        return np.zeros(w), np.full(w, np.nan), False
    overlap = [fr[j] - hl[j] for j in range(w)]
    force, slope, merit = law(constants, overlap)
    for j in range(w):
        merit = merit + 0.5 * (lam[j] * hl[j])
    length, solved = 1.0, False
    for _ in range(NEWTON_LIMIT):
        gap = [force[j] - lam[j] for j in range(w)]
        root = [math.sqrt(slope[j]) for j in range(w)]
        g = [_dot(h[j], gap) for j in range(w)]
        y = _solve_scaled(h, root, [root[j] * g[j] for j in range(w)])
        p = [gap[j] - root[j] * y[j] for j in range(w)]
        descent = 0.0
        for j in range(w):
            descent = descent - g[j] * p[j]
        hp = [_dot(h[j], p) for j in range(w)]
        # Round-off of the largest terms of any wheel's δ: one wheel's reaches the others through H.
        size, pressed = 0.0, 0.0
        for j in range(w):
            own = float(constants.approach[j]) + abs(fr[j])
            for k in range(w):
                own = own + abs(h[j][k] * lam[k])
            size = own if own > size else size
            pressed = pressed + force[j]
        rough = 0
        for j in range(w):
            rough += not abs(hp[j]) <= ROUND_OFF * size
        solved = rough == 0
        if solved:
            break
        trial_overlap = [fr[j] - (hl[j] + length * hp[j]) for j in range(w)]
        trial_force, trial_slope, trial = law(constants, trial_overlap)
        for j in range(w):
            trial = trial + 0.5 * ((lam[j] + length * p[j]) * (hl[j] + length * hp[j]))
        # The work of the forces is known to round-off of δ.
        slack = 1e-13 * abs(merit) + ROUND_OFF * size * pressed
        if trial <= merit + 1e-4 * length * descent + slack:
            lam = [lam[j] + length * p[j] for j in range(w)]
            hl = [hl[j] + length * hp[j] for j in range(w)]
            overlap, force, slope, merit, length = trial_overlap, trial_force, trial_slope, trial, 1.0
        else:
            length = 0.5 * length
    return np.array(force) if solved else np.zeros(w), np.array(overlap), solved


def _dot(row: list[float], x: list[float]) -> float:
    total = 0.0
    for a, b in zip(row, x, strict=True):
        total = total + a * b
    return total


def _solve_scaled(h: list[list[float]], root: list[float], y: list[float]) -> list[float]:
    """Solve (I + d H d) x = y by Cholesky, d = diag(root)."""
    w = len(y)
    factor = [[0.0] * w for _ in range(w)]
    for i in range(w):
        for j in range(i + 1):
            entry = root[i] * h[i][j] * root[j]
            if i == j:
                entry = entry + 1.0
            for k in range(j):
                entry = entry - factor[i][k] * factor[j][k]
            factor[i][j] = math.sqrt(entry) if i == j else entry / factor[j][j]
    for i in range(w):
        for k in range(i):
            y[i] = y[i] - factor[i][k] * y[k]
        y[i] = y[i] / factor[i][i]
    for i in reversed(range(w)):
        for k in range(i + 1, w):
            y[i] = y[i] - factor[k][i] * y[k]
        y[i] = y[i] / factor[i][i]
    return y
