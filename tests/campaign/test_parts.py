"""However a campaign is shared out, the joined folder is that of one process."""

import json
import shutil

import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy import ToyExecutor, ToyScenario, bytes_of, contents

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.faults import FolderInUse, FolderUnusable, ScenarioChanged, StoreDamaged
from tbatch.campaign.lock import FolderLock
from tbatch.campaign.merging import merge
from tbatch.campaign.part import Part
from tbatch.campaign.records import tables_of
from tbatch.campaign.run import run
from tbatch.campaign.shards import missing_shards
from tbatch.campaign.store import Store
from tbatch.campaign.verification import verify


def ignore(text):
    """Takes messages that a test does not look at."""


def work(folder, part=None, scenario=None, **options):
    scenario = scenario or ToyScenario(samples=300)
    executor = options.pop("executor", None) or ToyExecutor(scenario)
    return run(scenario, out=folder, executor=executor, part=Part.parse(part) if part else None, **options)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The campaign of one process."""
    folder = tmp_path_factory.mktemp("alone")
    work(folder)
    return bytes_of(folder)


class Mortal:
    """Workers, one of which was killed while it wrote."""

    def simulate(self, campaign, missing, report, message):
        """Stores all; what was half written stays."""
        (campaign.folder / "wheels" / ".c00-s000000-000064.parquet.there-1.tmp").write_bytes(b"half")
        result = campaign.executor.simulate([pair for shard in missing for pair in shard.pairs])
        tables = tables_of(campaign.scenario, missing, result)
        campaign.store.commit(tables, run_steps=1, seconds=1.0, kernel_seconds=1.0)


def test_what_a_killed_worker_was_writing_is_gone_when_the_work_is_done(tmp_path, alone):
    work(tmp_path, cluster=Mortal())
    assert bytes_of(tmp_path) == alone


@given(st.integers(1, 9), st.integers(1, 700), st.integers(1, 700), st.integers(1, 12))
def test_every_shard_is_in_one_part_and_stays_there_when_the_campaign_grows(cases, one, other, count):
    parts = [Part(index, count) for index in range(count)]
    owner = {}
    for samples in sorted((one, other)):
        for shard in missing_shards(cases, samples, []):
            holders = [part for part in parts if part.holds(shard, cases)]
            assert len(holders) == 1
            block = (shard.case, shard.start)
            assert owner.setdefault(block, holders[0]) == holders[0]


def test_parts_share_the_work_evenly_and_each_meets_every_speed():
    shards = missing_shards(9, 64 * 9, [])
    for index in range(9):
        mine = [shard for shard in shards if Part(index, 9).holds(shard, 9)]
        assert len(mine) == 9
        assert {shard.case for shard in mine} == set(range(9))


@pytest.mark.parametrize("text", ["", "1", "4/4", "-1/4", "1/0", "0/0", "a/b", "1/2/3", "1.0/2", " 0/2"])
def test_what_is_no_part_is_refused(text):
    with pytest.raises(ValueError, match="i from 0 to n - 1"):
        Part.parse(text)


def test_parts_in_one_folder_in_any_order_give_the_bytes_of_one_process(tmp_path, alone):
    for part in ("2/3", "0/3", "1/3"):
        work(tmp_path, part)
    assert contents(Campaign.open(tmp_path)) == contents(Campaign.open(tmp_path))
    assert bytes_of(tmp_path) == alone
    assert verify(tmp_path).damage == []
    executor = ToyExecutor(ToyScenario(samples=300))
    work(tmp_path, executor=executor)
    assert executor.asked == []
    assert not (tmp_path / "parts").exists()


def test_a_part_writes_its_own_shards_once_and_nothing_of_the_others(tmp_path):
    work(tmp_path, "0/3")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    work(tmp_path, "1/3")
    assert {path: path.stat().st_mtime_ns for path in before} == before
    executor = ToyExecutor(ToyScenario(samples=300))
    said = []
    work(tmp_path, "1/3", executor=executor, message=said.append)
    assert executor.asked == []
    assert said == [f"complete already: all runs of part 1/3 are stored in {tmp_path}"]


def test_another_number_of_parts_goes_on_where_the_first_stopped(tmp_path, alone):
    work(tmp_path, "0/3")
    executor = ToyExecutor(ToyScenario(samples=300))
    for index in range(5):
        work(tmp_path, f"{index}/5", executor=executor)
    assert len(executor.asked) == len(set(executor.asked)) < 600
    assert bytes_of(tmp_path) == alone


def test_a_part_redoes_what_is_missing_of_it_and_takes_over_what_it_did_not_note(tmp_path, alone):
    for index in range(2):
        work(tmp_path, f"{index}/2")
    (tmp_path / "parts" / "0-of-2.json").unlink()
    (lost,) = [path for path in (tmp_path / "runs").iterdir() if path.stem == "c00-s000000-000064"]
    lost.unlink()
    executor = ToyExecutor(ToyScenario(samples=300))
    work(tmp_path, "0/2", executor=executor)
    assert executor.asked == [(0, sample) for sample in range(64)]
    assert bytes_of(tmp_path) == alone


def test_folders_of_several_machines_join_into_the_first(tmp_path, alone):
    folders = [tmp_path / str(index) for index in range(3)]
    for index, folder in enumerate(folders):
        work(folder, f"{index}/3")
    sources = {folder: bytes_of(folder) for folder in folders[1:]}
    campaign = merge(folders[0], folders[1:], message=ignore)
    assert campaign.runs_stored == 600
    assert bytes_of(folders[0]) == alone
    assert {folder: bytes_of(folder) for folder in sources} == sources
    assert len(campaign.store.manifest.sessions) == 4
    assert verify(folders[0]).damage == []


def test_folders_join_into_a_new_one_and_again_without_effect(tmp_path, alone):
    folders = [tmp_path / str(index) for index in range(2)]
    for index, folder in enumerate(folders):
        work(folder, f"{index}/2")
    for _ in range(2):
        merge(tmp_path / "all", folders, message=ignore)
        assert bytes_of(tmp_path / "all") == alone
    executor = ToyExecutor(ToyScenario(samples=300))
    work(tmp_path / "all", executor=executor)
    assert executor.asked == []


def test_a_shorter_campaign_joins_a_longer_one_and_no_run_counts_twice(tmp_path):
    work(tmp_path / "short", scenario=ToyScenario(samples=100))
    work(tmp_path / "long", "0/2", scenario=ToyScenario(samples=200))
    merge(tmp_path / "short", [tmp_path / "long"], message=ignore)
    grown = work(tmp_path / "short", scenario=ToyScenario(samples=200))
    assert contents(grown) == contents(work(tmp_path / "at once", scenario=ToyScenario(samples=200)))


def test_another_campaign_is_not_joined_and_its_keys_are_named(tmp_path):
    work(tmp_path / "one")
    work(tmp_path / "other", scenario=ToyScenario(samples=300, seed=8))
    with pytest.raises(ScenarioChanged, match=r"campaign.seed: stored 7, given 8"):
        merge(tmp_path / "one", [tmp_path / "other"], message=ignore)
    with pytest.raises(FolderUnusable, match="not a campaign folder"):
        merge(tmp_path / "nothing", [], message=ignore)


def test_a_damaged_folder_is_not_joined_and_nothing_is_changed(tmp_path):
    for index in range(2):
        work(tmp_path / str(index), f"{index}/2")
    damaged = next((tmp_path / "1" / "wheels").iterdir())
    data = bytearray(damaged.read_bytes())
    data[len(data) // 2] ^= 1
    damaged.write_bytes(data)
    before = bytes_of(tmp_path / "0")
    with pytest.raises(StoreDamaged, match=damaged.name):
        merge(tmp_path / "0", [tmp_path / "1"], message=ignore)
    assert bytes_of(tmp_path / "0") == before


def test_other_bits_of_the_same_shard_are_said_and_the_first_is_kept(tmp_path):
    work(tmp_path / "0")
    work(tmp_path / "1")
    other = Store.open(tmp_path / "1")
    shard = other.shards[0]
    tables = {kind: other.shard_table(kind, shard) for kind in ("runs", "wheels", "events")}
    other.commit({shard: {**tables, "events": tables["events"].slice(1)}})
    said = []
    before = bytes_of(tmp_path / "0")
    merge(tmp_path / "0", [tmp_path / "1"], message=said.append)
    assert any(f"{shard.name} of" in line and "the first is kept" in line for line in said)
    assert bytes_of(tmp_path / "0") == before


def test_the_whole_and_its_parts_keep_out_of_each_other(tmp_path):
    work(tmp_path, "0/2")
    with FolderLock(tmp_path), pytest.raises(FolderInUse):
        work(tmp_path, "1/2")
    with FolderLock(tmp_path, "parts/1-of-2.lock"):
        for attempt in (lambda: work(tmp_path), lambda: work(tmp_path, "1/2")):
            with pytest.raises(FolderInUse, match="in use by pid"):
                attempt()
        work(tmp_path, "0/2")


def test_a_part_that_a_scheduler_starts_again_elsewhere_takes_its_lock_over(tmp_path):
    work(tmp_path, "0/2")
    lock = tmp_path / "parts" / "1-of-2.lock"
    lock.write_text(json.dumps({"pid": 1, "host": "elsewhere", "boot_id": "another"}))
    said = []
    work(tmp_path, "1/2", message=said.append)
    assert "took over the lock of pid 1 on host elsewhere" in said[0]
    assert Campaign.open(tmp_path).runs_stored == 600


def test_parts_that_start_together_in_a_new_folder_do_not_disturb_each_other(tmp_path):
    """The second begins in the middle of the first: before its manifest stands, and while it writes."""
    for moment in ("building", "running"):
        folder = tmp_path / moment
        begun = []

        def begin(state, folder=folder, moment=moment, begun=begun):
            if state.phase == moment and not begun:
                begun.append(work(folder, "1/2"))

        work(folder, "0/2", progress=begin)
        assert Campaign.open(folder).runs_stored == 600
        assert verify(folder).damage == []
        shutil.rmtree(folder)
