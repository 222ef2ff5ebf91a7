"""How a campaign is cut into shards: a shard is a case and a range of samples, stored as one set of files.

The cuts are at fixed multiples of the sample index. They depend neither on the machine, nor on the number of threads,
nor on how often the campaign was interrupted or extended.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

SHARD_SAMPLES = 64

_NAME = re.compile(r"c(\d{2,})-s(\d{6,})-(\d{6,})")


@dataclass(frozen=True, order=True, slots=True)
class Shard:
    """Samples ``start`` up to, not including, ``stop`` of one case. Orders by sample first: all cases advance."""

    start: int
    stop: int
    case: int

    @property
    def name(self) -> str:
        """The name of the shard's files, without suffix."""
        return f"c{self.case:02d}-s{self.start:06d}-{self.stop:06d}"

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Its runs as (case, sample)."""
        return [(self.case, sample) for sample in range(self.start, self.stop)]

    def __len__(self) -> int:
        """The number of its runs."""
        return self.stop - self.start

    @classmethod
    def parse(cls, name: str) -> "Shard":
        """The shard of a name; ValueError if no shard is named so."""
        match = _NAME.fullmatch(name)
        if match is not None:
            case, start, stop = (int(text) for text in match.groups())
            shard = cls(start, stop, case)
            if shard.name == name and start < stop <= (start // SHARD_SAMPLES + 1) * SHARD_SAMPLES:
                return shard
        raise ValueError(f"{name!r} is not the name of a shard, which looks like 'c00-s000064-000128'")


def missing_shards(case_count: int, samples: int | Sequence[int], present: Iterable[Shard]) -> list[Shard]:
    """The shards still to be run for samples 0 up to ``samples`` (one number, or one a case), beside those present.

    A sample that a present shard covers is never run again: after 100 samples, an extension to 200 adds 100 to 128,
    128 to 192 and 192 to 200.
    """
    covered: dict[int, list[tuple[int, int]]] = {case: [] for case in range(case_count)}
    for shard in present:
        if shard.case in covered:
            covered[shard.case].append((shard.start, shard.stop))
    missing = []
    for case, ranges in covered.items():
        at, end = 0, samples if isinstance(samples, int) else samples[case]
        for start, stop in [*sorted(ranges), (end, end)]:
            missing += [Shard(a, b, case) for a, b in _cut(at, min(start, end))]
            at = max(at, stop)
    return sorted(missing)


def overlapping(shards: Iterable[Shard]) -> list[tuple[Shard, Shard]]:
    """Pairs of shards that hold a run twice; a sound store has none."""
    found = []
    last: dict[int, Shard] = {}
    for shard in sorted(shards, key=lambda shard: (shard.case, shard.start, shard.stop)):
        before = last.get(shard.case)
        if before is not None and shard.start < before.stop:
            found.append((before, shard))
        if before is None or shard.stop > before.stop:
            last[shard.case] = shard
    return found


def take_batch(shards: Sequence[Shard], limit: int) -> list[Shard]:
    """The next shards to be run together: about ``limit`` runs, at least one shard.

    The work left is shared out evenly over the batches to come, so that the last one is not a handful of runs, which
    would leave threads idle.
    """
    total = sum(len(shard) for shard in shards)
    share = total / max(1, math.ceil(total / max(limit, 1)))
    batch: list[Shard] = []
    size = 0
    for shard in shards:
        if batch and size + len(shard) > limit:
            break
        batch.append(shard)
        size += len(shard)
        if size >= share:
            break
    return batch


def _cut(start: int, stop: int) -> Iterable[tuple[int, int]]:
    while start < stop:
        end = min((start // SHARD_SAMPLES + 1) * SHARD_SAMPLES, stop)
        yield start, end
        start = end
