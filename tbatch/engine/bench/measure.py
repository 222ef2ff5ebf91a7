"""Measures everything that `tbatch bench` shows, in one go."""

import os
import platform
from collections.abc import Callable

from tbatch.engine.bench import scaling
from tbatch.engine.bench.baseline import TOGETHER, scipy_seconds, track_operations
from tbatch.engine.bench.cases import BAY, BAYS, START, STEP, seed_model, seed_runs
from tbatch.engine.bench.table import Table
from tbatch.engine.bench.timing import best_of, start_seconds
from tbatch.engine.footprint import footprint
from tbatch.engine.model import Model
from tbatch.numerics.pattern import RowPattern


def measure(
    *,
    runs: int = 256,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
    tables: bool = True,
) -> list[Table]:
    """Measure everything.

    Args:
        runs: Size of the batch.
        threads: Most worker threads to try; None for all processors available.
        progress: Called with a line before each part.
        tables: Measure how the time depends on lanes, threads, sizes, speeds and metres too.
    """
    say = progress or (lambda _: None)
    most = threads or len(os.sched_getaffinity(0))
    model = seed_model()
    found = [_machine(model, most), _one_model(model, runs, most, say)]
    if not tables:
        return found
    say("lanes, threads and sizes")
    found.append(scaling.lanes_threads_sizes(runs, sorted({1, most})))
    say("runs and dofs")
    found += [scaling.batch_sizes(model), scaling.model_sizes()]
    say("speeds, tracks and steps")
    found += [scaling.speeds(model, runs), scaling.tracks_and_steps(runs)]
    say("endless lines")
    found.append(scaling.lines())
    return found


def _machine(model: Model, threads: int) -> Table:
    """What is measured, and where."""
    table = Table("machine", ("", " "))
    table.add("processor", _processor())
    table.add("threads", threads)
    dofs = model.track.node_count * model.track.node_dofs
    vehicle = f"{model.vehicle.dof_count} vehicle dofs, {model.vehicle.wheel_count} Hertz wheelsets"
    table.add("model", f"{BAYS} bays, {dofs} track dofs, {vehicle}, step {STEP * 1e3:g} ms")
    return table


def _one_model(model: Model, runs: int, threads: int, say: Callable[[str], None]) -> Table:
    """The baseline and the engine on the seed paper's second model."""
    table = Table(f"seed model 2, {runs} runs", ("", " "))
    say("SciPy, one run at a time")
    baseline, alone, together = (min(rounds) for rounds in zip(*(scipy_seconds(model) for _ in range(3)), strict=True))
    say("compilation, with an empty cache and from the cache")
    compiled, cached = start_seconds()
    say(f"batch engine, {runs} runs")
    one = best_of(8, {"": (model, seed_runs(runs))})[""]
    pattern = model.factor.pattern
    assert isinstance(pattern, RowPattern)
    operations = track_operations(pattern, model.track.node_count)
    table.add("SciPy baseline, one run [us/run-step]", baseline * 1e6)
    table.add("SciPy baseline, its track solves and products alone [us/run-step]", alone * 1e6)
    table.add(f"SciPy, these for {TOGETHER} right-hand sides at once [us/run-step]", together * 1e6)
    table.add("batch engine, 1 thread [us/run-step]", one * 1e6)
    table.add("batch engine, 1 thread [run-steps/s/core]", 1.0 / one)
    table.add("ratio to the baseline, per core", baseline / one)
    table.add("ratio to the baseline's track part, per core", alone / one)
    table.add(f"ratio to the track part for {TOGETHER} right-hand sides, per core", together / one)
    table.add("track operations a run-step", operations)
    table.add("batch engine, 1 thread, track operations only [GFLOP/s]", operations / one / 1e9)
    if threads > 1:
        many = best_of(20, {"": (model, seed_runs(runs))}, threads)[""]
        table.add(f"batch engine, {threads} threads [us/run-step]", many * 1e6)
        table.add(f"gain of {threads} threads over 1", one / many)
    table.add("first compilation [s]", compiled)
    table.add("from the kernel cache [s]", cached)
    distance = BAYS * BAY - 15.0 - START
    table_runs = seed_runs(1)
    needs = footprint(model, table_runs, distance / table_runs.speed)
    table.add("track, vehicle and contact [kB/run of a batch]", needs.state / 1e3)
    table.add("statistics [kB/run of a batch]", needs.statistics / 1e3)
    table.add("irregularity, with the kernels' copy [kB/run of a batch]", needs.surface / 1e3)
    table.add("results until the end [kB/run]", (needs.collected + needs.tables) / 1e3)
    return table


def _processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        with open("/proc/cpuinfo") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
        return f"{names[0]} ({len(names)} processors)"
    except (OSError, IndexError):
        return platform.processor() or platform.machine()
