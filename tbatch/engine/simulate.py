"""Simulate: many runs of one model, in batches sized to memory, each advanced chunk by chunk."""

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tbatch.engine.batch import Batch
from tbatch.engine.collected import Collected, Progress
from tbatch.engine.footprint import Footprint, longest_chunk, surface_bytes
from tbatch.engine.histories import Follow, Histories
from tbatch.engine.memory import available_memory
from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation, step_counts
from tbatch.engine.result import Result
from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs, SaveAt, State
from tbatch.engine.tables import imported_tables, kernel_tables
from tbatch.numerics.initial import InitialState
from tbatch.numerics.one_thread import one_blas_thread
from tbatch.numerics.run_inputs import RunInputs

LANDING_WINDOW = 5e-3
"""Time after the end of a separation in which its landing force is sought [s]."""
CHUNK_SECONDS = 0.08
"""Aim for the length of one launch: the unit of progress and cancellation."""
MEMORY_SHARE = 0.25
"""Share of the available memory that a batch may take if no limit is given."""


@one_blas_thread
def simulate(
    model: Model,
    runs: Runs,
    duration: ArrayLike,
    *,
    initial: str | State = "static",
    threads: int | None = None,
    save: SaveAt | None = None,
    follow: Follow | None = None,
    progress: Callable[[Progress], None] | None = None,
    memory: float | None = None,
    chunk: int | None = None,
) -> Result:
    """Step all runs. A run's result depends on its inputs alone, not on what it is batched with.

    Args:
        model: What the runs share.
        runs: The runs.
        duration: [s], scalar or one entry a run; rounded up to a whole step.
        initial: "static" equilibrium, "rest" (undeformed track, static contact force) or a `State`.
        threads: Worker threads; None for all processors available.
        save: Histories to keep; None for summary and separations only.
        follow: Called after each chunk with what it added to the saved histories.
        progress: Called after each chunk; an exception it raises stops the simulation.
        memory: Most bytes a batch may take; None for a quarter of what is available.
        chunk: Steps a launch; None to aim at 0.08 s.

    Raises:
        ValueError: If an input is out of range; names what, where and what is accepted.
        MemoryError: If the histories and results of all runs do not fit into the memory that is free.
    """
    steps = step_counts(model, runs, duration)
    preparation = Preparation(model, runs, steps, initial)
    longest = int(steps.max())
    needs = Footprint.of(model, save=save, steps=longest)
    _refuse_too_much(needs, len(runs), len(runs) if save is None or save.runs is None else len(save.runs))
    histories = Histories(model, save, steps)
    collected = Collected(model, len(runs), int(steps.sum()), progress)
    # Runs of like length and speed share a batch, so that they can share blocks and few lanes idle.
    waiting = np.lexsort([runs.start, runs.speed, -steps])
    limit = MEMORY_SHARE * available_memory() if memory is None else memory
    for members, inputs in _batches(preparation, waiting.tolist(), needs.stepped, limit):
        most = longest_chunk(longest, len(inputs), threads) if chunk is None else max(1, min(longest, chunk))
        states = _starts(preparation, histories, members, inputs)
        batch = Batch(
            model,
            inputs,
            states,
            collected.statistics,
            spare_rows=histories.probe_rows_needed,
            chunk=most,
            first=histories.places_of_saved(members),
        )
        # What the batch was made of is not needed while it is stepped.
        inputs.clear()
        preparation.forget()
        _advance(model, batch, members, most, chunk is None, threads, histories, collected, follow)
        collected.finish(batch, members)
        del batch
    return collected.result(runs, histories)


def _batches(
    preparation: Preparation, waiting: Sequence[int], per_run: float, limit: float
) -> Iterator[tuple[list[int], list[RunInputs]]]:
    """The runs with their constants, in batches of whole blocks that take at most `limit` bytes, or of one block."""
    members: list[int] = []
    inputs: list[RunInputs] = []
    used, surfaces = 0.0, set[int]()
    for run in waiting:
        one = preparation.inputs(run)
        takes = per_run + surface_bytes(one, surfaces)
        if inputs and used + takes > limit and len(inputs) % LANES == 0:
            yield members, inputs
            members, inputs, used, surfaces = [], [], 0.0, {id(one.profile)}
            takes = per_run + surface_bytes(one, set())
        members.append(run)
        inputs.append(one)
        used += takes
    yield members, inputs


def _starts(
    preparation: Preparation, histories: Histories, members: Sequence[int], inputs: Sequence[RunInputs]
) -> Iterator[InitialState]:
    """Initial states of a batch, one after the other; each goes into the histories."""
    for run, one in zip(members, inputs, strict=True):
        state = preparation.start(run, one)
        histories.begin(run, one, state)
        yield state


def _refuse_too_much(needs: Footprint, runs: int, saved: int) -> None:
    """Refuse, before anything is computed, what cannot be kept."""
    free, kept = available_memory(), runs * (needs.kept - needs.histories) + saved * needs.histories
    if kept > free:
        raise MemoryError(
            f"histories and results of {runs} runs need {kept / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are "
            "free: save fewer channels or fewer samples (save.every), or simulate fewer runs at a time"
        )


def _advance(
    model: Model,
    batch: Batch,
    members: list[int],
    most: int,
    adapt: bool,
    threads: int | None,
    histories: Histories,
    collected: "Collected",
    follow: Follow | None,
) -> None:
    """Launch chunks until every run of the batch has ended."""
    launch = _Launch(model, batch, members, histories, collected.statistics, most, threads)
    n, count = 0, min(most, 8) if adapt else most
    while batch.active:
        batch.need_surfaces(n, count)
        began = time.perf_counter()
        launch(n, count)
        seconds = time.perf_counter() - began
        collected.chunk(batch, members, n, count, seconds)
        histories.take(members, launch.samples, n, count, batch)
        if follow is not None and (piece := histories.piece(members, n, count)) is not None:
            follow(piece)
        n += count
        if adapt:
            count = int(np.clip(count * CHUNK_SECONDS / max(seconds, 1e-6), 1, min(4 * count, most)))


class _Launch:
    """The kernel with everything of one batch bound to it."""

    def __init__(
        self,
        model: Model,
        batch: Batch,
        members: list[int],
        histories: Histories,
        statistics: Any,
        most: int,
        threads: int | None,
    ) -> None:
        from tbatch.engine import runtime

        runtime.start(threads)
        from tbatch.engine.kernels.advance import advance

        self._kernel = advance
        self.samples = histories.buffer(members, batch, most)
        self._every = histories.every_steps
        self._compiled_in = (model.factor.pattern, batch.at, statistics.accumulators)
        self._model = _model_arguments(model, histories)
        self._batch = batch
        # To round-off a whole number of steps stays inside the landing window.
        watch = int(np.floor(LANDING_WINDOW / model.step * (1.0 + 1e-12)))
        self._kept = (statistics.places, statistics.rows, statistics.counters, watch, batch.events, self._every)
        self._sampled = (batch.spare, histories.sample_rows, self.samples)

    def __call__(self, first: int, count: int) -> None:
        """Advance `count` steps from step `first`."""
        first_sample = first // self._every + 1 if self._every else 0
        batch = self._batch
        surfaces = batch.surfaces
        runs = (batch.lockstep, surfaces.segment_real, surfaces.segment_whole, surfaces.coefficients)
        state = (batch.displacement, batch.velocity, batch.load, batch.memory, batch.marks)
        self._kernel(
            *self._compiled_in, first, count, *self._model, *runs, *state, *self._kept, first_sample, *self._sampled
        )


def _model_arguments(model: Model, histories: Histories) -> tuple[Any, ...]:
    """What the kernel asks of the model and the probes, in the order of its parameters."""
    scheme, track, window = model.scheme, model.track, model.window
    coefficients = [scheme.c1, scheme.c2, scheme.c3, 2.0 / scheme.first, 4.0 / scheme.first, scheme.splitting]
    line = (track.element_count, track.element_length, model.compliance)
    return (
        scheme.step,
        np.array(coefficients),
        *line,
        *(window.period, window.period_elements, window.home),
        *kernel_tables(model),
        *imported_tables(model),
        np.array(model.vehicle.wheel_dofs, np.int32),
        *(histories.probe_rows, histories.probe_shape),
    )
