"""Where the runs of a batch are simulated: here, in this process, with all its threads.

An executor has ``simulate`` and the sizes that a campaign plans with. What a run gives depends on nothing that an
executor chooses: not on the batch, its order, or the number of threads.
"""

import os
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from tbatch.campaign.shards import SHARD_SAMPLES

if TYPE_CHECKING:
    from tbatch.engine.model import Model
    from tbatch.engine.result import Result
    from tbatch.scenario import Scenario

FIRST_RUNS = 128  # at least, and 32 for each thread: two blocks of lanes or more keep a thread busy
MOST_RUNS = 512
STORE_EVERY = 15.0  # s: what an interruption may cost

Pair = tuple[int, int]


class Executor(Protocol):
    """Where runs are simulated; ``Local`` is one."""

    def steps_per_run(self) -> Sequence[int]:
        """Time steps of a run of each case."""
        ...

    def batch_limit(self, rate: float | None, steps: float) -> int:
        """How many runs to simulate together."""
        ...

    def simulate(self, pairs: Sequence[Pair], *, progress: Any = None, save: Any = None, follow: Any = None) -> Any:
        """Simulates runs."""
        ...


class Local:
    """Simulates the runs of a scenario in this process."""

    def __init__(self, scenario: "Scenario", *, threads: int | None = None) -> None:
        """Takes the scenario; ``threads`` defaults to the cores that this process may use."""
        self.scenario = scenario
        self.threads = threads or usable_cores()

    @cached_property
    def model(self) -> "Model":
        """The scenario's model, factorised when first used."""
        return self.scenario.model()

    def simulate(
        self,
        pairs: Sequence[Pair],
        *,
        progress: Callable[[Any], None] | None = None,
        save: Any = None,
        follow: Callable[[Any], None] | None = None,
    ) -> "Result":
        """Simulates runs.

        Args:
            pairs: The runs, as (case, sample).
            progress: Called after each chunk of steps with the engine's Progress; may raise to stop.
            save: What to keep beside summary and separations, a SaveAt.
            follow: Called after each chunk with what it added to that.
        """
        from tbatch.engine.simulate import simulate

        runs, duration = self.scenario.runs(pairs)
        return simulate(self.model, runs, duration, threads=self.threads, save=save, follow=follow, progress=progress)

    def steps_per_run(self) -> list[int]:
        """Time steps of a run of each case."""
        _, duration = self.scenario.runs([(case, 0) for case in range(len(self.scenario.speeds))])
        step = self.scenario.document.integration.step
        return [int(np.ceil(time / step - 1e-9)) for time in np.asarray(duration)]

    def batch_limit(self, rate: float | None, steps: float) -> int:
        """How many runs to simulate together.

        Enough to keep all threads busy, few enough that the results are stored every ``STORE_EVERY`` seconds. The
        first batch of a campaign, whose rate is not known yet, is the smallest that keeps all threads busy. The engine
        splits a batch that would not fit into memory.

        Args:
            rate: Run-steps per second so far, None if not known.
            steps: Time steps of a typical run.
        """
        fill = max(FIRST_RUNS, 32 * self.threads)
        wanted = fill if rate is None else int(rate * STORE_EVERY / max(steps, 1.0))
        return max(SHARD_SAMPLES, min(max(wanted, fill), max(MOST_RUNS, 2 * fill)))


def usable_cores() -> int:
    """Cores that this process may run on; the machine may have more."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
