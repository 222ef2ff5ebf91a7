"""Seating: which block and lane each run of a batch takes.

A block whose lanes keep one course is stepped faster than one whose lanes go their own ways, whatever the number of
its lanes that are used. So the runs of a course fill whole blocks as far as they go, and what is left over of each
course shares blocks with what is left over of the others, or sits alone where that costs less.
"""

from collections.abc import Hashable, Sequence

import numpy as np

from tbatch.engine.rows import LANES

MIXED_COST = 1.5
"""Time that a block of several courses takes, relative to one whose lanes keep the same course."""


def seats(courses: Sequence[Hashable]) -> np.ndarray:
    """Lane of each run, counted through all blocks, shape (run,); lanes that no run takes are spare.

    Args:
        courses: Course of each run; equal ones have their wheels at the same places all the way.
    """
    members: dict[Hashable, list[int]] = {}
    for run, course in enumerate(courses):
        members.setdefault(course, []).append(run)
    blocks: list[list[int]] = []
    left: list[list[int]] = []
    for runs in members.values():
        whole = len(runs) - len(runs) % LANES
        blocks += [runs[first : first + LANES] for first in range(0, whole, LANES)]
        if whole < len(runs):
            left.append(runs[whole:])
    blocks += _shared(left)
    # The order in which the runs are given is kept as far as blocks allow: the longest begin.
    blocks.sort(key=lambda runs: runs[0])
    lane = np.zeros(len(courses), np.int64)
    for block, runs in enumerate(blocks):
        lane[runs] = block * LANES + np.arange(len(runs))
    return lane


def _shared(left: Sequence[list[int]]) -> list[list[int]]:
    """Blocks for what is left over of each course."""
    # A remainder that fills more than two lanes in three is cheaper alone.
    alone = [runs for runs in left if len(runs) * MIXED_COST >= LANES]
    rest = [runs for runs in left if len(runs) * MIXED_COST < LANES]
    joined = [run for runs in rest for run in runs]
    together = [joined[first : first + LANES] for first in range(0, len(joined), LANES)]
    return alone + (rest if len(rest) <= MIXED_COST * len(together) else together)
