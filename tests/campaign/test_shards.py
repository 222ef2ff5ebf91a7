"""Shards are cut at fixed samples, whatever was stored before."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbatch.campaign.shards import SHARD_SAMPLES, Shard, missing_shards, overlapping, take_batch


def test_a_new_campaign_is_cut_at_multiples_of_the_shard_size():
    shards = missing_shards(2, 150, [])
    assert [shard.name for shard in shards] == [
        "c00-s000000-000064",
        "c01-s000000-000064",
        "c00-s000064-000128",
        "c01-s000064-000128",
        "c00-s000128-000150",
        "c01-s000128-000150",
    ]


def test_an_extension_adds_only_the_samples_that_are_missing():
    shards = missing_shards(1, 200, missing_shards(1, 100, []))
    assert [shard.name for shard in shards] == ["c00-s000100-000128", "c00-s000128-000192", "c00-s000192-000200"]


@given(st.integers(1, 3), st.lists(st.integers(1, 400), min_size=1, max_size=4), st.data())
def test_every_run_is_in_exactly_one_shard_after_any_extensions_and_losses(cases, counts, data):
    present: list[Shard] = []
    for samples in sorted(counts):
        if present:
            lost = data.draw(st.sets(st.sampled_from(present)))
            present = [shard for shard in present if shard not in lost]
        present += missing_shards(cases, samples, present)
        pairs = [pair for shard in present for pair in shard.pairs]
        assert sorted(pairs) == [(case, sample) for case in range(cases) for sample in range(samples)]
        assert all((shard.start // SHARD_SAMPLES) == (shard.stop - 1) // SHARD_SAMPLES for shard in present)
        assert not overlapping(present)


def test_overlapping_shards_are_found():
    one, other = Shard(0, 64, 1), Shard(10, 20, 1)
    assert overlapping([other, one, Shard(10, 20, 0)]) == [(one, other)]


def test_names_are_read_back_and_nothing_else_is():
    shard = Shard(64, 100, 3)
    assert Shard.parse(shard.name) == shard
    for name in (
        "c03-s000064-000064",
        "c03-s000064-000129",
        "c3-s000064-000100",
        "c03-s0064-0100",
        "x",
        shard.name + ".x",
    ):
        with pytest.raises(ValueError, match="not the name of a shard"):
            Shard.parse(name)


def test_batches_share_the_work_evenly():
    shards = missing_shards(9, 64, [])
    sizes = []
    while shards:
        batch = take_batch(shards, 512)
        sizes.append(sum(map(len, batch)))
        shards = shards[len(batch) :]
    assert sizes == [320, 256]


def test_a_batch_holds_at_least_one_shard():
    assert len(take_batch(missing_shards(2, 64, []), 1)) == 1


def test_a_million_runs_are_planned_in_a_few_megabytes():
    import tracemalloc

    tracemalloc.start()
    shards = missing_shards(2, 1_000_000, [])
    batch = take_batch(shards, 512)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert sum(len(shard) for shard in shards) == 2_000_000
    # What is simulated at a time does not grow with the plan, and the plan takes some hundred bytes a shard.
    assert sum(len(shard) for shard in batch) <= 512
    assert peak < 20e6
