"""Speed of the batch engine on this machine, beside one run at a time in SciPy, measured in one go.

The model is the seed paper's second: 167 bays, 168 nodes, 1008 dofs before the ends are pinned, a ten-dof coach with
four Hertz wheelsets on a rough rail, all statistics on. The baseline is the same run, one at a time, in SciPy
(`tbatch.numerics.scipy_run`), without statistics; its track part alone, two banded Cholesky solves and four sparse
products, is timed beside it, for one right-hand side and for 64 at once.
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

from tbatch.engine.footprint import bytes_per_run
from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation
from tbatch.engine.rows import LANES, LANES_VARIABLE
from tbatch.engine.runs import Runs
from tbatch.engine.simulate import simulate
from tbatch.numerics.pattern import RowPattern
from tbatch.numerics.scipy_run import ScipyRun
from tbatch.numerics.scipy_track import ScipyTrack
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

BAYS, BAY = 167, 0.65
STEP, SPEED, START = 1e-4, 300.0 / 3.6, 25.0
BASELINE_STEPS, ENGINE_STEPS, TOGETHER = 400, 300, 64


def seed_model(length: float | str = BAYS * BAY, elements_per_bay: int = 1) -> Model:
    """The seed paper's second model, by default on 167 bays with one element each."""
    vehicle = Vehicle.coach("seed-multiwheel")
    track = Track.slab("seed-slab", length=length, elements_per_bay=elements_per_bay)
    return Model.build(vehicle, track, Contact.hertz(wheel_radius=0.4575), step=STEP)


def seed_runs(count: int, period: float = 200.0) -> Runs:
    """Runs of one speed on different samples of a rough line, each longer than `period` [m] repeating itself."""
    rough = [
        Irregularity.spectrum(
            "china-trunk-line", wavelengths=(0.3, 50.0), tail=3, seed=1, sample=sample, period=period
        ).taper(START, 5.0)
        for sample in range(count)
    ]
    return Runs(np.full(count, SPEED), rough, START)


def scipy_seconds(model: Model, steps: int = BASELINE_STEPS) -> tuple[float, float, float]:
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


def engine_seconds(model: Model, count: int, threads: int, steps: int = ENGINE_STEPS) -> float:
    """Time of a run-step of the batch kernels, everything on [s]; of the better of two rounds."""
    runs = seed_runs(count)
    rates = [simulate(model, runs, steps * STEP, threads=threads).run_steps_per_second for _ in range(2)]
    return 1.0 / max(rates)


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


def start_seconds() -> tuple[float, float]:
    """Time to the first launch done: with an empty kernel cache, then from the cache [s]."""
    code = (
        "import time\n"
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
        first, second = (_in_a_process(code, TBATCH_CACHE=cache) for _ in range(2))
    return first, second


def lane_seconds(lanes: int, count: int) -> float:
    """Time of a run-step on one thread with another number of lanes [s], in a process of its own."""
    code = f"from tbatch.engine.bench import *\nprint(engine_seconds(seed_model(), {count}, 1))\n"
    return _in_a_process(code, **{LANES_VARIABLE: str(lanes)})


def _in_a_process(code: str, **environment: str) -> float:
    child = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return float(child.stdout.split()[-1])


def measure(
    *,
    runs: int = 256,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
    scaling: bool = True,
) -> dict[str, Any]:
    """Measure everything.

    Args:
        runs: Size of the batch.
        threads: Most worker threads to try; None for all processors available.
        progress: Called with a line before each part.
        scaling: Measure other numbers of lanes, runs, dofs and metres too.

    Returns:
        Facts of the machine and the figures, by name with their units.
    """
    say = progress or (lambda _: None)
    most = threads or len(os.sched_getaffinity(0))
    model = seed_model()
    say("SciPy, one run at a time")
    baseline, alone, together = scipy_seconds(model)
    say("compilation, with an empty cache and from the cache")
    compiled, cached = start_seconds()
    say(f"batch engine, {runs} runs, 1 thread")
    one = engine_seconds(model, runs, 1)
    operations = track_operations(model.factor.pattern, model.track.node_count)
    figures: dict[str, Any] = {
        "machine": _processor(),
        "threads available": most,
        "model": f"{BAYS} bays, {model.track.node_count * model.track.node_dofs} track dofs, "
        f"{model.vehicle.dof_count} vehicle dofs, {model.vehicle.wheel_count} Hertz wheelsets, step 0.1 ms",
        "runs": runs,
        "SciPy baseline, one run [us/run-step]": baseline * 1e6,
        "SciPy baseline, its track solves and products alone [us/run-step]": alone * 1e6,
        f"SciPy, these for {TOGETHER} right-hand sides at once [us/run-step]": together * 1e6,
        "batch engine, 1 thread [us/run-step]": one * 1e6,
        "batch engine, 1 thread [run-steps/s/core]": 1.0 / one,
        "ratio to the baseline, per core": baseline / one,
        "ratio to the baseline's track part, per core": alone / one,
        "track operations a run-step": operations,
        "batch engine, 1 thread, track operations only [GFLOP/s]": operations / one / 1e9,
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
        "irregularity [kB/run]": 1e-3 * seed_runs(1).irregularity[0].profile(0.0, BAYS * BAY).nbytes,
    }
    return figures | (_scaling(runs, one, say) if scaling else {})


def _scaling(runs: int, one: float, say: Callable[[str], None]) -> dict[str, Any]:
    """How the time of a run-step on one thread depends on lanes, runs, dofs and metres [us/run-step]."""
    figures: dict[str, Any] = {}
    for lanes in (8, 16, 32):
        say(f"{lanes} lanes")
        seconds = one if lanes == LANES else lane_seconds(lanes, runs)
        figures[f"{lanes} lanes [us/run-step]"] = seconds * 1e6
    for count in (LANES, 4 * LANES, 64 * LANES):
        say(f"{count} runs")
        figures[f"{count} runs [us/run-step]"] = engine_seconds(seed_model(), count, 1) * 1e6
    for name, model in (
        ("84 bays", seed_model(84 * BAY)),
        ("334 bays", seed_model(334 * BAY)),
        ("167 bays, 2 elements each", seed_model(elements_per_bay=2)),
        ("endless", seed_model("endless")),
    ):
        say(name)
        dofs = model.track.node_count * model.track.node_dofs
        seconds = engine_seconds(model, 4 * LANES, 1)
        figures[f"{name}, {dofs} dofs [us/run-step]"] = seconds * 1e6
        figures[f"{name}, {dofs} dofs [ns/run-step/dof]"] = seconds * 1e9 / dofs
    return figures


def _processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        with open("/proc/cpuinfo") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
        return f"{names[0]} ({len(names)} processors)"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()
