"""Timing: how long a run-step, a start and a kilometre take; what needs a process of its own gets one."""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from typing import Any

from tbatch.engine.bench.cases import BAY, SPEED, STEP, endless_runs, seed_model, seed_runs
from tbatch.engine.model import Model
from tbatch.engine.rows import LANES_VARIABLE
from tbatch.engine.runs import Runs
from tbatch.engine.simulate import simulate

STEPS = 300
"""steps of a run that is timed"""


def run_step_seconds(model: Model, runs: Runs, threads: int, steps: int = STEPS) -> float:
    """Time of a run-step of the batch kernels, everything on [s].

    Args:
        model: The model.
        runs: The runs; they last as long as 300 km/h takes for `steps` steps of 0.1 ms, the faster ones less.
        threads: Worker threads.
        steps: Length of the runs.
    """
    result = simulate(model, runs, SPEED * steps * STEP / runs.speed, threads=threads)
    return 1.0 / result.run_steps_per_second


def best_of(
    rounds: int, cases: dict[Any, tuple[Model, Runs]], threads: int = 1, steps: int = STEPS
) -> dict[Any, float]:
    """Time of a run-step of several cases [s]: the least of some rounds, in each of which all have their turn."""
    best = dict.fromkeys(cases, float("inf"))
    for _ in range(rounds):
        for name, (model, runs) in cases.items():
            best[name] = min(best[name], run_step_seconds(model, runs, threads, steps))
    return best


def grid_seconds(lanes: int, bays: list[int], threads: list[int], runs: int) -> list[list[float]]:
    """Time of a run-step for each number of bays and threads [s], with so many lanes, in a process of its own."""
    code = (
        "from tbatch.engine.bench.timing import *\n"
        f"models = {{bays: (seed_model(bays * BAY), seed_runs({runs})) for bays in {bays}}}\n"
        f"rows = [best_of(5, models, threads) for threads in {threads}]\n"
        f"print(json.dumps([[row[bays] for row in rows] for bays in {bays}]))\n"
    )
    return _in_a_process(code, **{LANES_VARIABLE: str(lanes)})


def start_seconds() -> tuple[float, float]:
    """Time to the first launch done: with an empty kernel cache, then from the cache [s]."""
    code = (
        "from tbatch.engine.bench.timing import *\n"
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


def line_cost(metres: float, runs: int) -> tuple[float, float]:
    """What an endless line costs: processor time a run and metre [s], largest memory of the process [bytes]."""
    code = f"from tbatch.engine.bench.timing import *\nprint(json.dumps(line_cost_here({metres}, {runs})))\n"
    seconds, memory = _in_a_process(code)
    return seconds, memory


def line_cost_here(metres: float, runs: int) -> tuple[float, float]:
    """As `line_cost`, in this process."""
    model, table = seed_model("endless"), endless_runs(runs)
    simulate(model, table, 10 * STEP, threads=1)
    began = time.process_time()
    simulate(model, table, metres / SPEED, threads=1)
    seconds = (time.process_time() - began) / (metres * runs)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return seconds, float(peak) * (1.0 if sys.platform == "darwin" else 1024.0)


def _in_a_process(code: str, **environment: str) -> Any:
    child = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return json.loads(child.stdout.splitlines()[-1])


__all__ = ["BAY", "STEP", "best_of", "json", "line_cost_here", "seed_model", "seed_runs", "simulate", "time"]
