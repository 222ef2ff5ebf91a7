"""The baseline: one run at a time in SciPy, without statistics, and the operations that a step needs at least.

Its track part alone, two banded Cholesky solves and four sparse products, is timed beside it, for one right-hand side
and for 64 at once: the lower bound of any such code.
"""

import time

import numpy as np

from tbatch.engine.bench.cases import seed_runs
from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation
from tbatch.numerics.pattern import RowPattern
from tbatch.numerics.scipy_run import ScipyRun
from tbatch.numerics.scipy_track import ScipyTrack

TOGETHER = 64
"""right-hand sides solved at once"""


def scipy_seconds(model: Model, steps: int = 400) -> tuple[float, float, float]:
    """Time of a run-step in SciPy [s]: all of it; the track's solves and products alone; these for 64 runs at once."""
    preparation = Preparation(model, seed_runs(1), np.array([steps]), "static")
    inputs = preparation.inputs(0)
    track = ScipyTrack(model.track, model.scheme)
    run = ScipyRun(track, model.ground, inputs, preparation.start(0, inputs))
    began = time.perf_counter()
    for n in range(steps):
        run.advance(n)
    whole = (time.perf_counter() - began) / steps
    alone = []
    for u, v, rounds in (
        (run.u, run.u_velocity, steps),
        (np.tile(run.u[:, None], TOGETHER), np.tile(run.u_velocity[:, None], TOGETHER), max(steps // 20, 1)),
    ):
        x, y = u, v
        began = time.perf_counter()
        for _ in range(rounds):
            x = track.solve(0, track.mass @ y - track.stiffness @ x)
            y = track.solve(0, track.damping @ x + track.mass @ y)
        alone.append((time.perf_counter() - began) / rounds)
    return whole, alone[0], alone[1] / TOGETHER


def track_operations(pattern: RowPattern, nodes: int) -> int:
    """Multiplications and additions of the track's part of a step, counted from the structure."""
    solves = sum(len(row) for rows in (pattern.lower, pattern.pivot, pattern.back) for row in rows)
    products = sum(
        len(row)
        for stencil in (pattern.mass, pattern.damping)
        for rows in (stencil.own, stencil.previous, stencil.following)
        for row in rows
    )
    return 2 * 2 * nodes * (solves + products)
