"""Wheel loads along the line of runs simulated again: what each passage of a wheel shows in each short bin.

A passage counts in a bin with its least and its largest value and with that at the middle: no peak is averaged away.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

MOST_MEMORY = 128e6  # of histories at a time [bytes]
BIN = 0.25  # length of a bin at least [m]
MOST_BINS = 2000

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Passages:
    """Q/Q0 of passages by bin; NaN where a wheel did not cross all of the bin."""

    place: Array
    # middles of the bins [m], shape (bin,)
    least: Array
    # shape (run, wheel, bin)
    middle: Array
    # shape (run, wheel, bin)
    largest: Array
    # shape (run, wheel, bin)


def sound_runs(campaign: Campaign, case: int, most_runs: int, most_steps: float) -> list[int]:
    """The first samples of a speed that did not diverge, within a number of runs and of run-steps; at least one.

    Args:
        campaign: The campaign.
        case: Index of the speed.
        most_runs: How many runs.
        most_steps: How many run-steps to simulate them again.
    """
    runs = campaign.table("runs", ("case", "sample", "status", "steps"))
    case_of, sample, status, steps = (runs[name].to_numpy() for name in ("case", "sample", "status", "steps"))
    sound = (case_of == case) & (status == 0)
    within = np.cumsum(steps[sound]) <= most_steps
    return [int(one) for one in sample[sound][within | (np.arange(len(within)) == 0)][:most_runs]]


def passages_of(
    campaign: Campaign, case: int, samples: Sequence[int], progress: Callable[[Any], None] | None = None
) -> Passages:
    """Simulates runs of one speed again, a bounded number at a time.

    Args:
        campaign: The campaign.
        case: Index of the speed.
        samples: The runs.
        progress: Called after each chunk of steps; may raise to stop.
    """
    from tbatch.engine.runs import SaveAt

    resolved = campaign.store.resolved["run"]
    start, length = float(resolved["start"]), float(resolved["distance"])
    offsets = campaign.scenario.model().vehicle.wheel_offsets
    first, last = start + float(resolved["evaluate_from"]), start + length
    count = int(min(MOST_BINS, max(1, (last - first) // BIN)))
    edges = np.linspace(first, last, count + 1)
    found = np.empty((3, len(samples), len(offsets), count))
    steps = max(campaign.executor.steps_per_run()[case], 1)
    together = max(1, int(MOST_MEMORY / (8.0 * steps * len(offsets))))
    for begin in range(0, len(samples), together):
        pairs = [(case, sample) for sample in samples[begin : begin + together]]
        runs, _ = campaign.scenario.runs(pairs)
        save = SaveAt(campaign.step, ("contact_force",))
        result = campaign.executor.simulate(pairs, save=save, progress=progress)
        for run, force in enumerate(result.contact_force):
            travelled = start + float(runs.speed[run]) * result.time
            for wheel, offset in enumerate(offsets):
                # At t = 0 a run is in static equilibrium: the force is Q0, the run's own.
                one = passage(travelled - offset, force[:, wheel] / force[0, wheel], edges)
                found[:, begin + run, wheel] = one
    return Passages(0.5 * (edges[1:] + edges[:-1]), *found)


def passage(position: Array, ratio: Array, edges: Array) -> tuple[Array, Array, Array]:
    """What one wheel shows in each bin: least, middle and largest value, NaN where it did not cross all of the bin.

    Args:
        position: Places of the wheel [m], rising, shape (n,).
        ratio: Q/Q0, NaN after the run's end, shape (n,).
        edges: Of the bins [m], rising, shape (bin + 1,).
    """
    alive = np.isfinite(ratio)
    position, ratio = position[alive], ratio[alive]
    least, middle, largest = (np.full(len(edges) - 1, np.nan) for _ in range(3))
    cuts = np.searchsorted(position, edges)
    # To within a sample: the last bin ends where the run does.
    spacing = position[1] - position[0] if len(position) > 1 else 0.0
    reached = (edges[:-1] >= position[0] - spacing) & (edges[1:] <= position[-1] + spacing) & (cuts[1:] > cuts[:-1])
    if reached.any():
        bins = np.flatnonzero(reached)  # without a gap: the wheel moves on
        inside = slice(cuts[bins[0]], cuts[bins[-1] + 1])
        starts = cuts[bins] - cuts[bins[0]]
        least[bins] = np.minimum.reduceat(ratio[inside], starts)
        largest[bins] = np.maximum.reduceat(ratio[inside], starts)
        middle[bins] = np.interp(0.5 * (edges[bins] + edges[bins + 1]), position, ratio)
    return least, middle, largest
