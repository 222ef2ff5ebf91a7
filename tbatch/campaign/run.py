"""Runs what is missing of a scenario in a folder.

All of it in a new folder, the rest after an interruption, the additional samples after an extension, nothing when it
is complete.
"""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.cluster import Cluster
from tbatch.campaign.durable import make_folder
from tbatch.campaign.executor import Executor
from tbatch.campaign.observer import Observer
from tbatch.campaign.part import Part, holding
from tbatch.campaign.preparation import tidy
from tbatch.campaign.progress import Progress, Report
from tbatch.campaign.quarantine import write_quarantine
from tbatch.campaign.recordings import Recorder, write_missing_recordings
from tbatch.campaign.records import tables_of
from tbatch.campaign.shards import Shard, take_batch
from tbatch.campaign.store import Message, Store

if TYPE_CHECKING:
    from tbatch.scenario import Scenario


def run(
    scenario: "Scenario",
    *,
    out: Path | str | None = None,
    threads: int | None = None,
    progress: Report | None = None,
    message: Message | None = None,
    recorder: Recorder | None = None,
    executor: Executor | None = None,
    cluster: Cluster | None = None,
    part: Part | None = None,
    observer: Observer | None = None,
) -> Campaign:
    """Runs what is missing of a scenario in a folder and gives the campaign.

    Whatever ends it early, the shards stored so far stay, and calling it again goes on from there.

    Args:
        scenario: The scenario.
        out: The campaign folder; default ``results/<campaign.name>``.
        threads: Threads to use; default: the cores that this process may use.
        progress: Called with a Progress after every chunk of steps and between batches; may raise to stop.
        message: Called with a line for people where something was found or repaired.
        recorder: Writes the recordings of the kept runs; default: none are written.
        executor: Where to simulate; default: in this process.
        cluster: Workers that simulate and store shards for this process; default: the executor simulates all.
        part: The part of the campaign that is to be run; default: all of it. Parts write no recordings.
        observer: Watches while runs are simulated; default: nobody does.
    """
    folder = Path(out) if out is not None else Path("results") / scenario.name
    tell = message or (lambda text: None)
    make_folder(folder)
    with holding(folder, part, tell):
        store = Store.prepare(folder, scenario.source_text, scenario.resolved(), message=tell, part=part)
        campaign = Campaign(store, scenario, executor, threads=threads)
        report = progress or (lambda state: None)
        if observer is not None:
            observer.begin(campaign)
        missing = campaign.missing(part)
        if missing:
            while missing:  # a rule to stop may ask for more at each of its looks
                if cluster is not None:
                    cluster.simulate(campaign, missing, report, tell)
                else:
                    _simulate(campaign, report, missing, observer)
                missing = campaign.missing(part)
            if cluster is not None and part is None:
                tidy(folder)  # of workers that were killed
        elif part is not None:
            tell(f"complete already: all runs of part {part} are stored in {folder}")
        else:
            tell(f"complete already: all {campaign.runs_total} runs are stored in {folder}")
        if part is None:
            write_quarantine(campaign, report, tell)
        if recorder is not None and part is None:
            write_missing_recordings(campaign, recorder, report)
    return campaign


def _simulate(campaign: Campaign, report: Report, missing: list[Shard], observer: Observer | None) -> None:
    """Simulates and stores what is missing, batch by batch."""
    executor = campaign.executor
    report(Progress("building", 0, sum(map(len, missing)), 0, 0, 0))
    total_runs = sum(len(shard) for shard in missing)
    steps_per_run = executor.steps_per_run()
    total_steps = sum(len(shard) * steps_per_run[shard.case] for shard in missing)
    runs_done = steps_done = separations = 0
    rate: float | None = None

    def tell(phase: str, steps: int = 0, found: int = 0) -> None:
        report(Progress(phase, runs_done, total_runs, steps_done + steps, total_steps, separations + found))

    while missing:
        batch = take_batch(missing, executor.batch_limit(rate, total_steps / total_runs))
        pairs = [pair for shard in batch for pair in shard.pairs]
        tell("running")
        began = perf_counter()
        followed = None if observer is None else observer.follow(pairs)
        result = executor.simulate(
            pairs,
            progress=lambda engine: tell("running", engine.run_steps_done, engine.separations),
            **({} if followed is None else {"save": followed.save, "follow": followed.take}),
        )
        seconds = perf_counter() - began
        steps = int(np.sum(result.steps))
        kernel = result.run_steps_per_second
        kernel_seconds = steps / kernel if kernel > 0.0 else seconds  # NaN for a batch of a single launch
        tables = tables_of(campaign.scenario, batch, result)
        campaign.store.commit(tables, run_steps=steps, seconds=seconds, kernel_seconds=kernel_seconds)
        rate = steps / max(kernel_seconds, 1e-9)
        missing = missing[len(batch) :]
        runs_done += len(pairs)
        steps_done += steps
        separations += result.separations.num_rows
    tell("running")
