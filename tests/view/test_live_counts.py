"""What a live view counts is what `tbatch stats` counts."""

import numpy as np
import pyarrow as pa
import pytest
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.run import run
from tbatch.view.live.counts import SpeedCounts, read_shards
from tbatch.view.live.news import StoredShard


@pytest.fixture
def toy(tmp_path):
    scenario = ToyScenario(samples=150)
    return run(scenario, out=tmp_path, executor=ToyExecutor(scenario, diverging=frozenset({(1, 99)})))


def test_counts_read_from_the_shards_are_the_campaign_s_statistics(toy):
    store = toy.store
    shards = []
    for shard, entry in store.manifest.shards.items():
        files = [(str(store.path(kind, shard)), entry["files"][kind]["sha256"]) for kind in ("runs", "wheels")]
        shards.append(StoredShard(shard.case, shard.start, *files))
    counts = [SpeedCounts() for _ in toy.speeds]
    paths = read_shards(shards[::2], counts) | read_shards(shards[1::2], counts)
    assert set(paths) == {0, 1}
    for row, count in zip(toy.statistics(any_wheelset=True).to_pylist(), counts, strict=True):
        assert (count.runs, count.separated) == (row["runs"], row["separated_runs"])
        assert count.separations == row["separations"]
        assert count.probability == (row["probability"], row["probability_low"], row["probability_high"])
        assert count.distance == pytest.approx(row["evaluated_distance"])
    of_wheels = toy.table("wheels").filter(of_sound_runs(toy)).to_pylist()
    for case, count in enumerate(counts):
        expected = np.sum([row["histogram"] for row in of_wheels if row["case"] == case], axis=0)
        np.testing.assert_array_equal(count.histogram, expected)


def of_sound_runs(campaign: Campaign):
    wheels = campaign.table("wheels", ("case", "sample")).to_pylist()
    return pa.array([(row["case"], row["sample"]) != (1, 99) for row in wheels])
