"""A million runs: memory stays bounded, and neither the store nor its readers are in the way."""

import gc
from types import SimpleNamespace

import numpy as np
import psutil
import pyarrow as pa
import pytest
from toy import STEPS, ToyExecutor, ToyScenario

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.entries import Entries
from tbatch.campaign.executor import Local
from tbatch.campaign.merging import merge
from tbatch.campaign.part import Part
from tbatch.campaign.records import tables_of
from tbatch.campaign.run import run
from tbatch.campaign.shards import Shard, missing_shards
from tbatch.campaign.summary import status_text
from tbatch.scenario import Scenario

MILLION = 1_000_000
BATCH = 2048


class Instant(ToyExecutor):
    """One wheel; whether a run separates is decided by its number, for a whole batch at once."""

    def simulate(self, pairs, *, progress=None, save=None):
        """Gives the runs' results."""
        case, sample = np.array(pairs).T
        runs = len(pairs)
        separated = separates(case, sample).astype(np.int32)
        own, event = np.arange(runs, dtype=np.int32), np.flatnonzero(separated).astype(np.int32)
        columns = {name: np.full(runs, value) for name, value in {"evaluated_time": 0.9, "force_max": 1e5}.items()}
        columns |= {name: 1e-3 * separated for name in ("separated_time", "longest", "largest_gap")}
        columns |= {"largest_landing_force": 1e5 * separated, "force_min": 2e4 * (1 - separated)}
        columns |= {"separations": separated, "censored": 0 * separated, "evaluated_distance": np.full(runs, 45.0)}
        wheel = np.ones(runs, np.int32)
        return SimpleNamespace(
            status=np.zeros(runs, int),
            steps=np.full(runs, STEPS),
            run_steps_per_second=1e9,
            summary=pa.table({"run": own, "wheel": wheel, **columns}),
            separations=pa.table({"run": event, "wheel": wheel[event], "start": event * 0.0, "end": event * 0.0}),
        )


def separates(case, sample):
    """About three runs in ten."""
    return (sample * 2_654_435_761 + case * 40_503) % 1000 < 300


def shards_of(samples, cases=2):
    return {
        shard: {"runs": len(shard), "diverged": 0, "files": {"runs": {"sha256": "0" * 64, "bytes": 1, "rows": 1}}}
        for shard in missing_shards(cases, samples, [])
    }


def test_entries_are_what_was_put_in_and_their_text_gives_them_back():
    entries = Entries(shards_of(1000))
    assert dict(entries) == shards_of(1000)
    again = Entries.parse(entries.text())
    assert dict(again) == dict(entries)
    assert again.text() == entries.text()
    first = next(iter(entries))
    entries[first] = {"runs": 7}
    assert entries[first] == {"runs": 7}
    assert entries.pop(first) == {"runs": 7}
    assert first not in entries
    assert Entries.parse("") == {}
    for text in ("x", '{"name": "c00"}', '{"other": 1}'):
        with pytest.raises(ValueError):
            Entries.parse(text)


def test_parts_of_many_shards_join_without_comparing_all_with_all(tmp_path, monkeypatch):
    """Each shard is held against its neighbours alone: the comparisons grow with the shards, not with their square."""
    scenario = ToyScenario(samples=64 * 40)
    for index in range(2):
        run(scenario, out=tmp_path / str(index), executor=Instant(scenario, limit=BATCH), part=Part(index, 2))
    compared = []
    from tbatch.campaign import merging

    real = merging.overlapping
    monkeypatch.setattr(merging, "overlapping", lambda shards: compared.append(len(shards)) or real(shards))
    assert merge(tmp_path / "0", [tmp_path / "1"], message=print).missing() == []
    assert compared == [1] * 40


@pytest.mark.slow
def test_a_million_runs_are_stored_read_and_resumed_in_bounded_memory(tmp_path):
    """The manifest grows by 12 bytes a run, and that is all that does; 25 leave room for the allocator."""
    scenario = ToyScenario(samples=MILLION // 2)
    process, seen = psutil.Process(), {}

    def note(state):
        if state.runs_done % (10 * BATCH) == 0:
            seen[state.runs_done] = (process.memory_info().rss, process.num_fds())

    campaign = run(scenario, out=tmp_path, executor=Instant(scenario, limit=BATCH), progress=note)
    warm, end = min(done for done in seen if done > MILLION // 10), max(seen)
    assert seen[end][0] - seen[warm][0] < 25 * (end - warm)
    assert seen[end][1] == seen[warm][1]

    gc.collect()
    before = process.memory_info().rss
    opened = Campaign.open(tmp_path)
    assert f"{MILLION} of {MILLION} runs stored, complete" in status_text(opened, opened.store.damage())
    rows = opened.statistics().to_pylist()
    # One speed at a time: 500,000 runs of 15 numbers, read, chosen from and resampled.
    assert process.memory_info().rss - before < 1.5e9
    samples = np.arange(MILLION // 2)
    assert [row["separated_runs"] for row in rows] == [int(separates(case, samples).sum()) for case in (0, 1)]
    again = Instant(scenario, limit=BATCH)
    assert run(scenario, out=tmp_path, executor=again).missing() == campaign.missing() == []
    assert again.asked == []


@pytest.mark.slow
def test_the_engine_keeps_its_memory_over_a_million_short_runs():
    """All that a campaign does with a batch but storing it, which the test above does; 5 % is the allocator's.

    Takes a quarter of an hour or more.
    """
    changes = ("run.distance=0.5 m", "run.evaluate_from=0.1 m", "run.taper=0.1 m", "integration.step=0.2 ms")
    scenario = Scenario.load("quick", overrides=[*changes, "track.model=rigid", "track.length=60 m"])
    process, executor = psutil.Process(), Local(scenario, threads=2)
    seen = []
    for first in range(0, MILLION // 2, BATCH // 2):
        shards = [Shard(at, at + 64, case) for at in range(first, first + BATCH // 2, 64) for case in (0, 1)]
        tables_of(scenario, shards, executor.simulate([pair for shard in shards for pair in shard.pairs]))
        seen.append((process.memory_info().rss, process.num_fds()))
    warm, end = seen[len(seen) // 5], seen[-1]
    assert end[0] < 1.05 * warm[0]
    assert end[1] == warm[1]
