"""What a campaign will take, ``tbatch run --dry-run``: time, memory and disk, from a short trial of its first batch.

Nothing is written: the trial steps the first batch for about a second with the campaign's own model and kernels.
"""

import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.durable import table_bytes
from tbatch.campaign.executor import Local
from tbatch.campaign.manifest import Manifest
from tbatch.campaign.part import Part
from tbatch.campaign.preparation import refuse_if_changed
from tbatch.campaign.recordings import RECORDED_TOGETHER
from tbatch.campaign.records import BatchResult, tables_of
from tbatch.campaign.shards import Shard, missing_shards, take_batch
from tbatch.campaign.stopping import StopRule
from tbatch.campaign.store import RESOLVED_NAME, Store

if TYPE_CHECKING:
    from tbatch.scenario import Scenario

TRIAL_RUN_STEPS = 400_000  # about a second on one core
VIEWER_LIBRARY = 120e6  # resident bytes of the recording library (rerun 0.41)


@dataclass(frozen=True)
class Forecast:
    """What is to be done and what it takes."""

    runs_planned: int
    runs: int
    """Runs still to be simulated; with a rule to stop, up to its next look."""
    shards: int
    run_steps: int
    threads: int
    batch: int
    """Most runs simulated together."""
    run_steps_per_second: float
    seconds: float
    """Time until all is stored [s]."""
    memory: float
    """Largest resident memory [bytes]."""
    disk: float
    """Size of the tables [bytes]."""
    most: "Most | None" = None
    """With a rule to stop, what it may come to."""


@dataclass(frozen=True)
class Most:
    """What a campaign takes whose rule to stop is met by its ``max_runs`` alone."""

    runs: int
    """Runs still to be simulated."""
    run_steps: int
    seconds: float
    """[s]"""
    disk: float
    """[bytes]"""


def forecast(scenario: "Scenario", folder: Path, *, threads: int | None = None, part: Part | None = None) -> Forecast:
    """Estimates what is missing of a campaign.

    Args:
        scenario: The scenario.
        folder: Its folder, which need not exist.
        threads: Threads to use; default: the cores that this process may use.
        part: The part that is to be run; default: all.

    Raises:
        ScenarioChanged: The folder holds another campaign.
    """
    resolved = scenario.resolved()
    store = Store(folder, resolved, Manifest(scenario.hash))
    if (folder / RESOLVED_NAME).exists():
        store = Store.open(folder)
        refuse_if_changed(folder, store.resolved, resolved)
        store.resolved = resolved
    campaign = Campaign(store, scenario)
    missing = campaign.missing(part)
    executor = Local(scenario, threads=threads)
    steps = executor.steps_per_run()
    run_steps = sum(len(shard) * steps[shard.case] for shard in missing)
    runs = sum(map(len, missing))
    if not missing:
        return Forecast(campaign.runs_total, 0, 0, 0, executor.threads, 0, 0.0, 0.0, 0.0, 0.0)
    began = time.perf_counter()
    trial = _trial(executor, missing, run_steps / runs)
    start = time.perf_counter() - began - trial.seconds
    batch = min(executor.batch_limit(trial.rate, run_steps / runs), runs)
    per_run = _bytes_per_run(executor, steps[0])
    memory = _peak() + max(0, batch - trial.runs) * per_run
    if scenario.keep.worst or scenario.keep.runs:
        memory += VIEWER_LIBRARY + RECORDED_TOGETHER * _history_bytes(executor, max(steps))
    rule = StopRule.of(resolved)
    most = None
    if rule is not None and part is None:  # parts end at the first look
        shards = missing_shards(len(steps), rule.maximum, store.shards)
        most_steps, most_runs = sum(len(shard) * steps[shard.case] for shard in shards), sum(map(len, shards))
        seconds = start + most_steps / trial.rate + most_runs * trial.preparation
        most = Most(most_runs, most_steps, seconds, most_runs * trial.disk)
    return Forecast(
        runs_planned=campaign.runs_total,
        runs=runs,
        shards=len(missing),
        run_steps=run_steps,
        threads=executor.threads,
        batch=batch,
        run_steps_per_second=trial.rate,
        seconds=start + run_steps / trial.rate + runs * trial.preparation,
        memory=memory,
        disk=runs * trial.disk,
        most=most,
    )


def forecast_text(found: Forecast, folder: Path) -> str:
    """An estimate for people."""
    if not found.runs:
        return f"nothing to do: all {found.runs_planned} runs are stored in {folder}"
    most = found.most
    doing = f"{found.runs} of {found.runs_planned} runs to do, in {found.shards} shards; {found.run_steps:,} run-steps"
    time_needed, disk = _duration(found.seconds), f"{found.disk / 1e6:,.1f}"
    if most is not None:
        doing = (
            f"{found.runs} to {most.runs} runs to do, by campaign.stop: until its next look, or until max_runs at every"
            f" speed; {found.run_steps:,} to {most.run_steps:,} run-steps"
        )
        time_needed += f" to {_duration(most.seconds)}"
        disk += f" to {most.disk / 1e6:,.1f}"
    lines = [
        doing,
        f"time    about {time_needed} on {found.threads} threads of this machine, at "
        f"{found.run_steps_per_second:,.0f} run-steps/s, without recordings",
        f"memory  about {found.memory / 1e6:,.0f} MB, {found.batch} runs together",
        f"disk    about {disk} MB of tables in {folder}",
        "nothing was written (--dry-run)",
    ]
    return "\n".join(lines)


@dataclass(frozen=True)
class _Trial:
    runs: int
    rate: float
    """Run-steps per second of the kernels."""
    preparation: float
    """Time a run beside the kernels [s]."""
    seconds: float
    disk: float
    """Bytes a run."""


def _trial(executor: Local, missing: Sequence[Shard], steps_a_run: float) -> _Trial:
    """Steps the first batch for a while."""
    from tbatch.engine.simulate import simulate

    scenario, model = executor.scenario, executor.model
    batch = take_batch(missing, executor.batch_limit(None, steps_a_run))
    pairs = [pair for shard in batch for pair in shard.pairs]
    step = scenario.document.integration.step

    def timed(steps: int) -> tuple[BatchResult, float, float]:
        began = time.perf_counter()
        runs, duration = scenario.runs(pairs)
        result = simulate(model, runs, np.minimum(duration, steps * step), threads=executor.threads)
        return result, time.perf_counter() - began, float(np.sum(result.steps))

    timed(1)  # compiles
    _, few_seconds, few_steps = timed(8)
    result, seconds, steps = timed(8 + max(8, TRIAL_RUN_STEPS * executor.threads // len(pairs)))
    rate = result.run_steps_per_second
    if steps - few_steps >= TRIAL_RUN_STEPS / 2 or not rate > 0.0:  # else the runs are too short to time a difference
        rate = max(steps - few_steps, 1.0) / max(seconds - few_seconds, 1e-6)
    tables = tables_of(scenario, batch, result)
    size = sum(len(table_bytes(table)) for of_kind in tables.values() for table in of_kind.values())
    return _Trial(len(pairs), rate, max(0.0, few_seconds - few_steps / rate) / len(pairs), seconds, size / len(pairs))


def _bytes_per_run(executor: Local, steps: int) -> float:
    """What each run of a batch adds to the memory of the trial, the run table with its waves included."""
    from tbatch.engine.footprint import Footprint, surface_bytes
    from tbatch.engine.prepare import Preparation

    scenario, model = executor.scenario, executor.model
    runs, _ = scenario.runs([(0, 0)])
    first = Preparation(model, runs, np.array([steps]), "static").inputs(0)
    needs = Footprint.of(model, steps=steps, surface=surface_bytes(first, set()))
    return needs.stepped + needs.kept


def _history_bytes(executor: Local, steps: int) -> float:
    """Histories of a kept run [bytes], roughly: a row a sample, the rail and the bodies."""
    model = executor.model
    every = float(executor.scenario.keep.every or model.step)
    width = 4 * model.vehicle.wheel_count + 2 * model.vehicle.dof_count
    return 8.0 * width * steps * model.step / every


def _peak() -> float:
    """Largest resident memory of this process so far [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak) * (1.0 if sys.platform == "darwin" else 1024.0)


def _duration(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
