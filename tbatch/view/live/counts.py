"""What the stored runs of a campaign amount to, speed by speed, as they come in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa

from tbatch.campaign.durable import read_table
from tbatch.campaign.estimates.intervals import exact_interval
from tbatch.view.live.news import StoredShard

POINTS_EVERY = 8  # runs between two points of the path that a probability took


@dataclass
class SpeedCounts:
    """What the runs of one speed amount to; diverged runs do not count."""

    runs: int = 0
    separated: int = 0
    """Runs in which any wheelset separates."""
    separations: int = 0
    """Separations of all wheelsets."""
    distance: float = 0.0
    """Evaluated distance of all wheelsets [m]."""
    histogram: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    """Steps of all wheelsets by Q/Q0, in bins of 0.05 from 0, the last for all above, shape (bin,)."""

    @property
    def probability(self) -> tuple[float, float, float]:
        """Of a separation of any wheelset in a run: estimate and exact 95 % interval."""
        low, high = exact_interval(self.separated, self.runs)
        return (self.separated / self.runs if self.runs else float("nan")), low, high

    def add(self, runs: pa.Table, wheels: pa.Table) -> list[tuple[int, float, float, float]]:
        """Takes in the runs of a shard.

        Args:
            runs: Columns sample, status.
            wheels: Columns sample, separations, evaluated_distance, histogram.

        Returns:
            The path of the probability: runs so far, estimate, low and high, every few runs.
        """
        sound = np.sort(runs["sample"].to_numpy()[runs["status"].to_numpy() == 0])
        wheels = wheels.filter(pa.array(np.isin(wheels["sample"].to_numpy(), sound)))
        sample, separations = wheels["sample"].to_numpy(), wheels["separations"].to_numpy()
        self.separations += int(separations.sum())
        self.distance += float(wheels["evaluated_distance"].to_numpy().sum())
        if wheels.num_rows:
            bins = wheels["histogram"].combine_chunks()
            added = bins.flatten().to_numpy().reshape(len(bins), -1).sum(axis=0)
            self.histogram = added if not len(self.histogram) else self.histogram + added
        separated = np.isin(sound, sample[separations > 0])
        path = []
        for first in range(0, len(sound), POINTS_EVERY):
            few = separated[first : first + POINTS_EVERY]
            self.runs += len(few)
            self.separated += int(few.sum())
            path.append((self.runs, *self.probability))
        return path


def read_shards(
    shards: Sequence[StoredShard], counts: Sequence[SpeedCounts]
) -> dict[int, list[tuple[int, float, float, float]]]:
    """Takes in stored shards, and gives the path of the probability of each speed that has new runs.

    Args:
        shards: Where they are.
        counts: What there is by now, by case.
    """
    paths: dict[int, list[tuple[int, float, float, float]]] = {}
    for shard in sorted(shards, key=lambda shard: (shard.case, shard.start)):
        runs = read_table(Path(shard.runs[0]), shard.runs[1], ("sample", "status"))
        columns = ("sample", "separations", "evaluated_distance", "histogram")
        wheels = read_table(Path(shard.wheels[0]), shard.wheels[1], columns)
        paths.setdefault(shard.case, []).extend(counts[shard.case].add(runs, wheels))
    return paths
