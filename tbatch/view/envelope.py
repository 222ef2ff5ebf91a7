"""How the contact forces of one speed spread along the line: percentiles of Q/Q0 at each place, over runs and wheels.

In each bin of the line a passage of a wheel counts with its largest value for the high percentiles, with its least one
for the low ones, and with that at the middle for the median.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tbatch.view.passages import passages_of, sound_runs

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

MOST_RUNS = 256
MOST_RUN_STEPS = 2e6  # simulated again for one speed: three seconds on two cores
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
    return sound_runs(campaign, case, MOST_RUNS, MOST_RUN_STEPS)


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
    passages = passages_of(campaign, case, samples, progress)
    bins = len(passages.place)
    least, middle, largest = (
        values.reshape(-1, bins) for values in (passages.least, passages.middle, passages.largest)
    )
    return Envelope(
        campaign=campaign.name,
        case=case,
        speed=campaign.speeds[case],
        runs=len(samples),
        place=passages.place,
        ratio=percentiles(least, middle, largest),
        separated=np.nanmean(np.where(np.isnan(least), np.nan, least == 0.0), axis=0),
        passages=np.isfinite(least).sum(axis=0),
    )


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
