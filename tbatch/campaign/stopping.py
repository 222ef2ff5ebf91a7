"""When a speed has runs enough: ``campaign.stop``, asked only at fixed numbers of runs.

The looks are multiples of the shard size, further apart as the runs grow: every 64 runs up to 1,024, then in steps of
up to an eighth of what there is. At a look a speed stops or goes on by what its samples from 0 up to there say, and by
nothing else: neither the machine, nor the batches, nor an interruption, nor the other speeds. Looking often widens the
chance that an interval misses the truth a little; the printed ones are those of a number of runs fixed beforehand.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from tbatch.campaign.estimates.intervals import exact_interval
from tbatch.campaign.shards import SHARD_SAMPLES, Shard

TALLY_COLUMNS = ("sample", "separations")


@dataclass(frozen=True)
class Tally:
    """What some runs of a speed amount to; diverged runs do not count."""

    runs: int = 0
    separated: int = 0
    """Runs in which any wheelset separates."""
    events: int = 0
    """Separations of all wheelsets."""

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(self.runs + other.runs, self.separated + other.separated, self.events + other.events)


@dataclass(frozen=True)
class StopRule:
    """When a speed stops."""

    minimum: int
    """Runs below which it never does."""
    maximum: int
    """Runs at which it does in any case."""
    min_events: int
    """Separations of all wheelsets that it needs."""
    rel_ci: float
    """Half the width of the exact 95 % interval of its probability of separation, relative to the probability."""

    @classmethod
    def of(cls, resolved: Mapping[str, Any]) -> "StopRule | None":
        """The rule of a resolved scenario, if it has one."""
        campaign = resolved["campaign"]
        if (stop := campaign.get("stop")) is None:
            return None
        return cls(int(campaign["runs"]), int(stop["max_runs"]), int(stop["min_events"]), float(stop["rel_ci"]))

    def looks(self) -> Iterator[int]:
        """The numbers of runs at which it is asked, rising; the last is the maximum."""
        runs = -(-self.minimum // SHARD_SAMPLES) * SHARD_SAMPLES
        while runs < self.maximum:
            yield runs
            runs += SHARD_SAMPLES * max(1, runs // (8 * SHARD_SAMPLES))
        yield self.maximum

    def satisfied(self, tally: Tally) -> bool:
        """Whether these runs are enough."""
        if tally.events < self.min_events or tally.separated == 0:
            return False
        low, high = exact_interval(tally.separated, tally.runs)
        return 0.5 * (high - low) <= self.rel_ci * tally.separated / tally.runs

    def planned(self, stored: Sequence[Shard], tally_of: Callable[[Shard], Tally]) -> int:
        """How many samples a speed is to have, as far as its stored ones tell.

        Args:
            stored: The stored shards of the speed.
            tally_of: What a shard amounts to.
        """
        ordered = sorted(stored)
        for look in self.looks():
            at, total = 0, Tally()
            for shard in ordered:
                if shard.start == at and shard.stop <= look:
                    at, total = shard.stop, total + tally_of(shard)
            if at < look or self.satisfied(total):
                return look
        return self.maximum


def tally(runs: pa.Table, wheels: pa.Table) -> Tally:
    """What the runs of a shard amount to.

    Args:
        runs: Columns sample, status.
        wheels: Columns sample, separations.
    """
    sound = runs["sample"].to_numpy()[runs["status"].to_numpy() == 0]
    sample, separations = wheels["sample"].to_numpy(), wheels["separations"].to_numpy()
    kept = np.isin(sample, sound)
    separated = np.unique(sample[kept & (separations > 0)])
    return Tally(len(sound), len(separated), int(separations[kept].sum()))
