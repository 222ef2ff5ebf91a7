"""Scaling: how the time of a run-step depends on lanes, threads, runs, dofs, speeds, steps and metres."""

from collections.abc import Sequence

from tbatch.engine.bench.cases import BAY, BAYS, STEP, seed_model, seed_runs
from tbatch.engine.bench.table import Table
from tbatch.engine.bench.timing import best_of, grid_seconds, line_cost
from tbatch.engine.model import Model
from tbatch.engine.rows import LANES


def lanes_threads_sizes(
    runs: int, threads: Sequence[int], lanes: Sequence[int] = (8, 16, 32), bays: Sequence[int] = (84, BAYS, 334)
) -> Table:
    """Run-steps a second and core for each number of lanes, threads and bays."""
    table = Table("lanes, threads and sizes", ("lanes", "threads", "bays", "us/run-step", "run-steps/s/core"))
    for count in lanes:
        grid = grid_seconds(count, list(bays), list(threads), runs)
        for size, row in zip(bays, grid, strict=True):
            for number, seconds in zip(threads, row, strict=True):
                table.add(count, number, size, seconds * 1e6, 1.0 / seconds / number)
    return table


def batch_sizes(model: Model, counts: Sequence[int] = (LANES, 4 * LANES, 16 * LANES, 64 * LANES)) -> Table:
    """Cost of a run-step by the number of runs stepped together, on one thread."""
    table = Table("runs", ("runs", "us/run-step", "relative"))
    best = best_of(5, {count: (model, seed_runs(count)) for count in counts})
    for count, seconds in best.items():
        table.add(count, seconds * 1e6, seconds / min(best.values()))
    return table


def model_sizes(runs: int = 4 * LANES) -> Table:
    """Cost of a run-step and dof by the size of the track, on one thread."""
    table = Table("dofs", ("track", "dofs", "us/run-step", "ns/run-step/dof"))
    models = {
        "84 bays": seed_model(84 * BAY),
        f"{BAYS} bays": seed_model(),
        "334 bays": seed_model(334 * BAY),
        f"{BAYS} bays, 2 elements each": seed_model(elements_per_bay=2),
        "endless": seed_model("endless"),
    }
    for name, seconds in best_of(5, {name: (model, seed_runs(runs)) for name, model in models.items()}).items():
        dofs = models[name].track.node_count * models[name].track.node_dofs
        table.add(name, dofs, seconds * 1e6, seconds * 1e9 / dofs)
    return table


def speeds(model: Model, runs: int, counts: Sequence[int] = (1, 2, 4, 8, 10)) -> Table:
    """Cost of a run-step by the number of speeds in a batch, all running the same way, on one thread."""
    table = Table("speeds", ("speeds", "us/run-step", "relative"))
    best = best_of(5, {count: (model, seed_runs(runs, speeds=count)) for count in (*counts, runs)})
    for count, seconds in best.items():
        table.add(count, seconds * 1e6, seconds / best[counts[0]])
    return table


def tracks_and_steps(runs: int) -> Table:
    """Cost of a run-step where batches of several models take turns, against each model alone, on one thread."""
    table = Table("tracks and steps", ("model", "alone us/run-step", "in turns us/run-step", "relative"))
    models = {
        f"{BAYS} bays, 0.1 ms": seed_model(),
        f"{BAYS} bays, 0.05 ms": seed_model(step=0.5 * STEP),
        "84 bays, 0.1 ms": seed_model(84 * BAY),
    }
    cases = {name: (model, seed_runs(runs)) for name, model in models.items()}
    turns = best_of(5, cases)
    for name, case in cases.items():
        alone = best_of(5, {name: case})[name]
        table.add(name, alone * 1e6, turns[name] * 1e6, turns[name] / alone)
    return table


def lines(kilometres: Sequence[float] = (1.0, 10.0), runs: int = LANES) -> Table:
    """Cost of a metre and memory by the length of an endless line, on one thread; processor time, not wall time."""
    table = Table("endless line", ("km", "us/m/run", "relative", "memory MB", "relative memory"))
    costs = [line_cost(1000.0 * length, runs) for length in kilometres]
    for length, (seconds, memory) in zip(kilometres, costs, strict=True):
        table.add(length, seconds * 1e6, seconds / costs[0][0], memory / 1e6, memory / costs[0][1])
    return table
