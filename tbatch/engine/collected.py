"""What the batches of one simulation leave behind: statistics, separations, how far it is."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tbatch.engine.batch import Batch
from tbatch.engine.histories import Histories
from tbatch.engine.model import Model
from tbatch.engine.result import Result, separation_table, summary_table
from tbatch.engine.rows import EVENT_COLUMNS, MARKS, PER_WHEEL
from tbatch.engine.runs import Runs


@dataclass(frozen=True)
class Progress:
    """How far a simulation is; given to the caller after each chunk."""

    run_steps_done: int
    run_steps_total: int
    separations: int


class Collected:
    """The results of all runs, filled batch by batch."""

    def __init__(self, model: Model, count: int, run_steps: int, progress: Callable[[Progress], None] | None) -> None:
        from tbatch.engine.statistics import Statistics

        self.model, self.statistics = model, Statistics()
        self._progress, self._total = progress, run_steps
        self._done = self._done_before = self._separations = 0
        self._events = [np.empty((0, 2 + EVENT_COLUMNS))]
        wheels = model.vehicle.wheel_count
        self._status = np.zeros(count, np.int32)
        self._steps = np.zeros(count, np.int64)
        self._load = np.zeros((count, wheels))
        self._rows = np.zeros((count, wheels, self.statistics.rows))
        self._counts = np.zeros((count, wheels, self.statistics.counters), np.int32)
        self._seconds, self._timed = 0.0, 0

    def chunk(self, batch: Batch, members: list[int], first: int, count: int, seconds: float) -> None:
        """After a launch: empty the event log, tell the progress."""
        events = batch.take_events()
        events[:, 0] = np.asarray(members, float)[events[:, 0].astype(int)]
        self._events.append(events)
        self._separations += len(events)
        ended = batch.lanes(batch.memory[:, batch.at.end : batch.at.end + 1])[:, 0]
        alive = batch.lanes(batch.memory[:, batch.at.active : batch.at.active + 1])[:, 0] > 0.5
        done = int(np.where(alive, first + count, np.minimum(batch.steps, ended)).sum())
        if first:
            # The first launch may hold a compilation.
            self._seconds += seconds
            self._timed += self._done_before + done - self._done
        self._done = self._done_before + done
        if self._progress is not None:
            self._progress(Progress(self._done, self._total, self._separations))

    def finish(self, batch: Batch, members: list[int]) -> None:
        """After a batch's last launch: keep its statistics."""
        at, statistics = batch.at, self.statistics
        wheels = at.wheels
        self._done_before = self._done
        self._status[members], self._steps[members] = batch.status, batch.steps
        self._load[members] = batch.lanes(batch.memory[:, at.load : at.load + wheels])
        rows = batch.lanes(batch.memory[:, at.outputs : at.outputs + wheels * statistics.rows])
        self._rows[members] = rows.reshape(len(members), wheels, statistics.rows)
        first = MARKS.wheels + PER_WHEEL * wheels
        counts = batch.lanes(batch.marks[:, first : first + wheels * statistics.counters])
        self._counts[members] = counts.reshape(len(members), wheels, statistics.counters)

    def result(self, runs: Runs, histories: Histories) -> Result:
        """Everything, in the order of the runs."""
        step, wheels = self.model.step, self.model.vehicle.wheel_count
        load = self._load.ravel()
        rows = self._rows.reshape(len(load), -1).T
        columns = self.statistics.columns(step, load, rows, self._counts.reshape(len(load), -1).T)
        events = np.concatenate(self._events)
        return Result(
            time=histories.time,
            status=self._status,
            steps=self._steps,
            separations=separation_table(events, step),
            summary=summary_table(events, wheels, columns, load, runs.speed, step),
            run_steps_per_second=self._timed / self._seconds if self._seconds else float("nan"),
            channels=histories.channels,
        )
