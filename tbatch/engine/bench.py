"""Speed of the batch engine on this machine, beside one run at a time in SciPy, measured in one go.

The model is the seed paper's second: 167 bays, 168 nodes, 1008 dofs before the ends are pinned, a ten-dof coach with
four Hertz wheelsets on a rough rail, all statistics on. The baseline is the same run, one at a time, in SciPy
(`tbatch.numerics.scipy_run`), without statistics; its track part alone, two banded Cholesky solves and four sparse
products, is timed beside it.
"""

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation
from tbatch.engine.runs import Runs
from tbatch.engine.simulate import bytes_per_run, simulate
from tbatch.numerics.scipy_run import ScipyRun
from tbatch.numerics.scipy_track import ScipyTrack
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

BAYS, BAY = 167, 0.65
STEP, SPEED, START = 1e-4, 300.0 / 3.6, 25.0
BASELINE_STEPS, ENGINE_STEPS = 400, 300


def seed_model() -> Model:
    """The seed paper's second model on 167 bays, one element each."""
    vehicle = Vehicle.coach("seed-multiwheel")
    track = Track.slab("seed-slab", length=BAYS * BAY)
    return Model.build(vehicle, track, Contact.hertz(wheel_radius=0.4575), step=STEP)


def seed_runs(count: int) -> Runs:
    """Runs of one speed on different samples of a rough line."""
    rough = [
        Irregularity.spectrum(
            "china-trunk-line", wavelengths=(0.3, 50.0), tail=3, seed=1, sample=sample, period=200.0
        ).taper(START, 5.0)
        for sample in range(count)
    ]
    return Runs(np.full(count, SPEED), rough, START)


def baseline_seconds(model: Model, steps: int = BASELINE_STEPS) -> tuple[float, float]:
    """Time of one step of one run in SciPy [s]: all of it, and the solves and products of the track alone."""
    preparation = Preparation(model, seed_runs(1), np.array([steps]), "static")
    inputs = preparation.inputs(0)
    track = ScipyTrack(model.track, model.scheme)
    run = ScipyRun(track, model.ground, inputs, preparation.start(0, inputs))
    began = time.perf_counter()
    for n in range(steps):
        run.advance(n)
    whole = (time.perf_counter() - began) / steps
    u, v = run.u, run.u_velocity
    began = time.perf_counter()
    for _ in range(steps):
        u = track.solve(0, track.mass @ v - track.stiffness @ u)
        v = track.solve(0, track.damping @ u + track.mass @ v)
    return whole, (time.perf_counter() - began) / steps


def engine_seconds(model: Model, count: int, threads: int, steps: int = ENGINE_STEPS) -> float:
    """Time of a run-step of the batch kernels, everything on [s]; of the better of two rounds."""
    runs = seed_runs(count)
    rates = [simulate(model, runs, steps * STEP, threads=threads).run_steps_per_second for _ in range(2)]
    return 1.0 / max(rates)


def start_seconds() -> tuple[float, float]:
    """Time from a fresh process to the first launch done: with an empty kernel cache, then from the cache [s]."""
    code = (
        "import time; began = time.perf_counter()\n"
        "from tbatch.engine.bench import seed_model, seed_runs, STEP\n"
        "from tbatch.engine.simulate import simulate\n"
        "from tbatch.engine import runtime\n"
        "model, runs = seed_model(), seed_runs(8)\n"
        "runtime.start(1)\n"
        "began = time.perf_counter()\n"
        "simulate(model, runs, STEP, threads=1)\n"
        "print(time.perf_counter() - began)\n"
    )
    with tempfile.TemporaryDirectory(prefix="tbatch-bench-") as cache:
        environment = os.environ | {"TBATCH_CACHE": cache}
        seconds = []
        for _ in range(2):
            child = subprocess.run(
                [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
            )
            seconds.append(float(child.stdout.split()[-1]))
    return seconds[0], seconds[1]


def measure(
    *, runs: int = 256, threads: int | None = None, progress: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """Measure everything.

    Args:
        runs: Size of the batch.
        threads: Most worker threads to try; None for all processors available.
        progress: Called with a line before each part.

    Returns:
        Facts of the machine and the figures, by name with their units.
    """
    say = progress or (lambda _: None)
    most = threads or len(os.sched_getaffinity(0))
    model = seed_model()
    say("SciPy, one run at a time")
    baseline, track_alone = baseline_seconds(model)
    say("compilation, with an empty cache and from the cache")
    compiled, cached = start_seconds()
    say(f"batch engine, {runs} runs, 1 thread")
    one = engine_seconds(model, runs, 1)
    figures: dict[str, Any] = {
        "machine": _processor(),
        "threads available": most,
        "model": f"{BAYS} bays, {model.track.node_count * model.track.node_dofs} track dofs, "
        f"{model.vehicle.dof_count} vehicle dofs, {model.vehicle.wheel_count} Hertz wheelsets, step 0.1 ms",
        "runs": runs,
        "SciPy baseline, one run [us/run-step]": baseline * 1e6,
        "SciPy baseline, its track solves and products alone [us/run-step]": track_alone * 1e6,
        "batch engine, 1 thread [us/run-step]": one * 1e6,
        "batch engine, 1 thread [run-steps/s/core]": 1.0 / one,
        "ratio to the baseline, per core": baseline / one,
        "ratio to the baseline's track part, per core": track_alone / one,
    }
    if most > 1:
        say(f"batch engine, {runs} runs, {most} threads")
        all_threads = engine_seconds(model, runs, most)
        figures[f"batch engine, {most} threads [us/run-step]"] = all_threads * 1e6
        figures[f"gain of {most} threads over 1"] = one / all_threads
    figures |= {
        "first compilation [s]": compiled,
        "from the kernel cache [s]": cached,
        "state and statistics [kB/run]": bytes_per_run(model) / 1e3,
        "irregularity [kB/run]": 8e-3 * len(seed_runs(1).irregularity[0].profile(0.0, BAYS * BAY).coefficient),
    }
    return figures


def _processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        with open("/proc/cpuinfo") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
        return f"{names[0]} ({len(names)} processors)"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()
