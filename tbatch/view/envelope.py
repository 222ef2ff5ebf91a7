"""How the contact forces of one speed spread along the line: percentiles of Q/Q0 at each place, over runs and wheels.

The runs are simulated again, a bounded number of them. The line is cut into short bins. In each bin a passage of a
wheel counts with its largest value for the high percentiles, with its least one for the low ones, and with that at the
middle for the median: a peak is never averaged away.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

MOST_RUNS = 256
MOST_RUN_STEPS = 2e6  # simulated again for one speed: three seconds on two cores
MOST_MEMORY = 128e6  # of histories at a time [bytes]
BIN = 0.25  # length of a bin at least [m]
MOST_BINS = 2000
LEVELS = (("max", 100.0), ("99.85 %", 99.85), ("95 %", 95.0), ("50 %", 50.0), ("5 %", 5.0))
"""Names and percentages of the curves, from above."""
KMH = 3.6

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Envelope:
    """The spread of Q/Q0 along the line at one speed."""

    campaign: str
    case: int
    speed: float  # [m/s]
    runs: int  # that it was made from
    place: Array
    # middles of the bins [m], shape (bin,)
    ratio: Array
    # Q/Q0 by level of LEVELS, NaN where no wheel passed, shape (bin, level)
    separated: Array
    # share of the passages that lose contact in the bin, shape (bin,)
    passages: NDArray[np.int64]
    # wheels that passed, over all runs, shape (bin,)

    @property
    def name(self) -> str:
        """Its name beside those of runs."""
        return envelope_name(self.case)


def envelope_name(case: int) -> str:
    """The name of the envelope of a speed."""
    return f"envelope-c{case:02d}"


def envelope_runs(campaign: Campaign, case: int) -> list[int]:
    """The samples that the envelope of a speed is made from: the first sound ones, as many as take seconds."""
    runs = campaign.table("runs", ("case", "sample", "status", "steps"))
    case_of, sample, status, steps = (runs[name].to_numpy() for name in ("case", "sample", "status", "steps"))
    sound = (case_of == case) & (status == 0)
    within = np.cumsum(steps[sound]) <= MOST_RUN_STEPS
    return [int(one) for one in sample[sound][within | (np.arange(len(within)) == 0)][:MOST_RUNS]]


def make_envelope(
    campaign: Campaign, case: int, samples: Sequence[int], progress: Callable[[Any], None] | None = None
) -> Envelope:
    """Simulates runs of one speed again and takes their percentiles.

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
    passages: list[tuple[Array, Array, Array]] = []
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
                passages.append(passage(travelled - offset, force[:, wheel] / force[0, wheel], edges))
    least, middle, largest = (np.array(values) for values in zip(*passages, strict=True))
    return Envelope(
        campaign=campaign.name,
        case=case,
        speed=campaign.speeds[case],
        runs=len(samples),
        place=0.5 * (edges[1:] + edges[:-1]),
        ratio=percentiles(least, middle, largest),
        separated=np.nanmean(np.where(np.isnan(least), np.nan, least == 0.0), axis=0),
        passages=np.isfinite(least).sum(axis=0),
    )


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


def percentiles(least: Array, middle: Array, largest: Array) -> Array:
    """The curves of LEVELS from what passages show, shape (passage, bin) each; no value is made that none has."""
    curves = []
    for _, level in LEVELS:
        values = middle if level == 50.0 else largest if level > 50.0 else least
        ordered = np.sort(values, axis=0)  # NaN last
        known = np.isfinite(ordered).sum(axis=0)
        rank = np.clip(np.ceil(0.01 * level * known).astype(int) - 1, 0, len(ordered) - 1)
        curves.append(np.take_along_axis(ordered, rank[None], axis=0)[0])
    return np.stack(curves, axis=1)
