"""Runs of one course sit together, whatever the order in which they come; every run has a lane of its own."""

import numpy as np
import pytest

from tbatch.engine.rows import LANES
from tbatch.engine.seating import MIXED_COST, seats


def blocks_of(counts: list[int], seed: int | None = None) -> list[set[int]]:
    """The courses found in each block, for so many runs of each course, in the order of the courses or shuffled."""
    courses = np.repeat(np.arange(len(counts)), counts)
    if seed is not None:
        courses = np.random.default_rng(seed).permutation(courses)
    lanes = seats(courses.tolist())
    assert len(set(lanes.tolist())) == len(courses)
    blocks: dict[int, set[int]] = {}
    for course, lane in zip(courses.tolist(), lanes.tolist(), strict=True):
        blocks.setdefault(lane // LANES, set()).add(course)
    assert sorted(blocks) == list(range(len(blocks)))
    # The first lane of a block is never spare: the others copy it.
    assert {block * LANES for block in blocks} <= set(lanes.tolist())
    return [blocks[block] for block in sorted(blocks)]


def cost(blocks: list[set[int]]) -> float:
    return sum(1.0 if len(block) == 1 else MIXED_COST for block in blocks)


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_whole_blocks_hold_one_course_whatever_the_order(seed):
    assert sorted(map(sorted, blocks_of([2 * LANES, LANES, 3 * LANES], seed))) == [[0], [0], [1], [2], [2], [2]]


def test_what_is_left_over_shares_blocks_or_sits_alone_where_that_is_cheaper():
    assert {0, 1, 2, 3} in blocks_of([LANES + 4] * 4)
    assert all(len(block) == 1 for block in blocks_of([LANES - 2] * 5))
    assert blocks_of([3]) == [{0}]


@pytest.mark.parametrize("speeds", [2, 5, 10, 20])
def test_a_batch_of_several_speeds_costs_little_more_than_one_of_a_single_speed(speeds):
    # 64 runs of each speed cost the same; 100 of each, as the shards of a campaign leave them, less than 5 % more.
    assert cost(blocks_of([64] * speeds)) == cost(blocks_of([64 * speeds]))
    assert cost(blocks_of([100] * speeds)) < 1.05 * cost(blocks_of([100 * speeds])) + 1.0


def test_the_longest_runs_come_first():
    courses = [*[0] * 20, *[1] * 20, *[2] * 20]
    lanes = seats(courses)
    assert lanes[0] == 0
    assert (lanes[:16] < LANES).all()
