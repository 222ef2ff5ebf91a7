"""Footprint: the memory that a simulation takes, counted from its sizes before it starts."""

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from tbatch.engine.batch import event_capacity
from tbatch.engine.histories import channel_widths, every_steps
from tbatch.engine.rows import EVENT_COLUMNS, LANES, MarkRows, MemoryRows

if TYPE_CHECKING:
    from tbatch.engine.model import Model
    from tbatch.engine.runs import Runs, SaveAt
    from tbatch.numerics.run_inputs import RunInputs

RUN_STEPS_A_CHUNK = 40_000
"""Upper bound of a launch's work a thread, about 0.1 s; it bounds the event log and the sample buffer."""

_OBJECTS = 4000.0  # bytes of Python objects of a run while its batch is made
_MAKING = 80.0  # times a run's surface: transforms, and what is kept of them, for the pieces of endless surfaces
_TABLE_COLUMNS = 20  # numbers of a wheel's row in the summary beside its statistics


@dataclass(frozen=True)
class Footprint:
    """Memory of a simulation by what it is for [bytes a run], that of the model and the process left out."""

    state: float
    """Track, vehicle and contact, of a run of a batch."""
    statistics: float
    """Accumulators, of a run of a batch."""
    surface: float
    """Irregularity, of a run of a batch: its spline and the kernels' copy of it; on an endless track two pieces."""
    histories: float
    """Saved channels, of every run of the simulation."""
    collected: float
    """Statistics until the end, of every run of the simulation."""
    tables: float
    """What is made of them at the end, when nothing is stepped any more, of every run of the simulation."""
    once: float
    """Event log and sample buffer of a launch, work space [bytes], whatever the number of runs."""

    @classmethod
    def of(
        cls,
        model: "Model",
        *,
        save: "SaveAt | None" = None,
        steps: int = 0,
        surface: float = 0.0,
        batch: int = LANES,
        threads: int | None = None,
    ) -> "Footprint":
        """Count.

        Args:
            model: The model.
            save: Histories to keep.
            steps: Length of the longest run.
            surface: Bytes of a run's irregularity; 0 for a shared one.
            batch: Runs that are stepped together.
            threads: Worker threads; None for all processors available.
        """
        from tbatch.engine.statistics import Statistics

        statistics, wheels = Statistics(), model.vehicle.wheel_count
        at = MemoryRows.of(model.vehicle.dof_count, wheels, len(model.tables.inverse))
        whole = MarkRows.total(wheels, statistics.counters)
        own = 8.0 * wheels * statistics.rows + 4.0 * wheels * statistics.counters
        width = every = points = 0
        if save is not None:
            width, every = sum(channel_widths(model, save).values()), every_steps(save.every, model.step)
            points = len(save.rail_at) * len(save.channels)
        rows = at.outputs + 2 * points + 3 * model.track.node_count * model.track.node_dofs
        launch = longest_chunk(steps, batch, threads)
        samples = launch // every + 1 if every else 0
        events = wheels * EVENT_COLUMNS * event_capacity(launch)
        return cls(
            state=8.0 * rows + 4.0 * (whole - wheels * statistics.counters) + _OBJECTS,
            statistics=own,
            surface=surface,
            histories=8.0 * width * (steps // every + 1) if every else 0.0,
            collected=own,
            tables=own + 8.0 * wheels * _TABLE_COLUMNS,
            once=8.0 * (events + width * samples) * _lanes(batch) + (_MAKING * surface if model.window.period else 0.0),
        )

    @property
    def stepped(self) -> float:
        """What a run takes while its batch is stepped [bytes]."""
        return self.state + self.statistics + self.surface

    @property
    def kept(self) -> float:
        """What a run takes from the beginning of the simulation to its end [bytes]."""
        return self.histories + self.collected + self.tables

    def peak(self, runs: int, batch: int) -> float:
        """Most memory that the simulation takes [bytes].

        Args:
            runs: All its runs.
            batch: Runs that are stepped together.
        """
        last = max(_lanes(min(runs, batch)) * self.stepped + self.once, runs * self.tables)
        return runs * (self.histories + self.collected) + last


def footprint(
    model: "Model",
    runs: "Runs",
    duration: ArrayLike,
    *,
    save: "SaveAt | None" = None,
    batch: int | None = None,
    threads: int | None = None,
) -> Footprint:
    """Footprint of a simulation whose runs are all like the first of them.

    Args:
        model: What the runs share.
        runs: The runs.
        duration: [s], scalar or one entry a run.
        save: Histories to keep.
        batch: Runs that are stepped together; None for all.
        threads: Worker threads; None for all processors available.
    """
    from tbatch.engine.prepare import Preparation, step_counts

    steps = step_counts(model, runs, duration)
    first = Preparation(model, runs, steps, "static").inputs(0)
    return Footprint.of(
        model, save=save, steps=int(steps.max()), surface=surface_bytes(first, set()), batch=batch or len(runs),
        threads=threads,
    )  # fmt: skip


def surface_bytes(inputs: "RunInputs", counted: set[int]) -> float:
    """Memory of a run's irregularity in its batch [bytes]; nothing where another run of the batch has counted it.

    Args:
        inputs: The run.
        counted: Surfaces of the batch so far; takes this one.
    """
    from tbatch.physics.profile import Profile

    if id(inputs.profile) in counted:
        return 0.0
    counted.add(id(inputs.profile))
    return inputs.profile.nbytes * (2.0 if isinstance(inputs.profile, Profile) else 1.0)


def longest_chunk(steps: int, batch: int, threads: int | None = None) -> int:
    """Most steps of a launch.

    Args:
        steps: Length of the longest run.
        batch: Runs that are stepped together.
        threads: Worker threads; None for all processors available.
    """
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    lanes = _lanes(batch)
    busy = max(1, min(threads, lanes // LANES))
    return max(1, min(steps, busy * RUN_STEPS_A_CHUNK // lanes))


def _lanes(runs: int) -> int:
    """Lanes of the blocks that so many runs fill."""
    return -(-runs // LANES) * LANES


def bytes_per_run(model: "Model", profile_bytes: float = 0.0) -> float:
    """Memory that one run takes in a batch [bytes], its irregularity included.

    Args:
        model: The model.
        profile_bytes: Size of the run's irregularity; 0 for a shared one.
    """
    return Footprint.of(model, surface=profile_bytes).stepped
