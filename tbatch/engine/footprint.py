"""Footprint: the memory that a simulation takes, counted from its sizes before it starts."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from tbatch.engine.histories import channel_widths, every_steps
from tbatch.engine.rows import EVENT_COLUMNS, LANES, MarkRows, MemoryRows

if TYPE_CHECKING:
    from tbatch.engine.model import Model
    from tbatch.engine.runs import Runs, SaveAt
    from tbatch.numerics.run_inputs import RunInputs

RUN_STEPS_A_CHUNK = 100_000
"""Upper bound of a launch's work, which bounds the event log and the sample buffer."""

_EVENTS_TOUCHED = 8  # of a wheel and chunk: the log has room for more, which takes memory once it is written
_OBJECTS = 4000.0  # bytes of Python objects of a run while its batch is made
_MAKING = 10e6  # bytes, whatever the number of runs: transforms of which the pieces of endless surfaces are made
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
    events: float
    """Log of separations, as far as a launch fills it, of a run of a batch."""
    histories: float
    """Saved channels, of every run of the simulation."""
    results: float
    """Statistics until the end and the tables made of them, of every run of the simulation."""
    once: float
    """Sample buffer of a launch and work space, whatever the number of runs [bytes]."""

    @classmethod
    def of(
        cls, model: "Model", *, save: "SaveAt | None" = None, steps: int = 0, surface: float = 0.0, batch: int = LANES
    ) -> "Footprint":
        """Count.

        Args:
            model: The model.
            save: Histories to keep.
            steps: Length of the longest run.
            surface: Bytes of a run's irregularity; 0 for a shared one.
            batch: Runs that are stepped together.
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
        samples = longest_chunk(steps, batch) // every + 1 if every else 0
        return cls(
            state=8.0 * rows + 4.0 * (whole - wheels * statistics.counters) + _OBJECTS,
            statistics=own,
            surface=surface,
            events=8.0 * wheels * EVENT_COLUMNS * min(steps // 2 + 2, _EVENTS_TOUCHED),
            histories=8.0 * width * (steps // every + 1) if every else 0.0,
            results=2.0 * own + 8.0 * wheels * _TABLE_COLUMNS,
            once=8.0 * width * samples * _lanes(batch) + (_MAKING if surface and model.window.period else 0.0),
        )

    @property
    def stepped(self) -> float:
        """What a run takes while its batch is stepped [bytes]."""
        return self.state + self.statistics + self.surface + self.events

    @property
    def kept(self) -> float:
        """What a run takes from the beginning of the simulation to its end [bytes]."""
        return self.histories + self.results

    def peak(self, runs: int, batch: int) -> float:
        """Most memory that the simulation takes [bytes].

        Args:
            runs: All its runs.
            batch: Runs that are stepped together.
        """
        return self.once + runs * self.kept + _lanes(min(runs, batch)) * self.stepped


def footprint(model: "Model", runs: "Runs", duration: ArrayLike, *, save: "SaveAt | None" = None) -> Footprint:
    """Footprint of a simulation whose runs are all like the first of them.

    Args:
        model: What the runs share.
        runs: The runs.
        duration: [s], scalar or one entry a run.
        save: Histories to keep.
    """
    from tbatch.engine.prepare import Preparation, step_counts

    steps = step_counts(model, runs, duration)
    first = Preparation(model, runs, steps, "static").inputs(0)
    return Footprint.of(model, save=save, steps=int(steps.max()), surface=surface_bytes(first, set()), batch=len(runs))


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


def longest_chunk(steps: int, batch: int) -> int:
    """Most steps of a launch, for runs of at most `steps` steps of which `batch` are stepped together."""
    return max(1, min(steps, RUN_STEPS_A_CHUNK // _lanes(batch)))


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
