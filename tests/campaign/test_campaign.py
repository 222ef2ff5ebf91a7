"""What a folder holds does not depend on how often, where and by what the campaign was stopped."""

import dataclasses
import errno
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from toy import STEPS, STOPPED, ToyExecutor, ToyScenario, contents

from tbatch.campaign import durable
from tbatch.campaign.campaign import Campaign
from tbatch.campaign.faults import FolderInUse, FolderUnusable, Interrupted, OutOfSpace, ScenarioChanged, StoreDamaged
from tbatch.campaign.lock import FolderLock
from tbatch.campaign.manifest import MANIFEST_NAME
from tbatch.campaign.part import Part
from tbatch.campaign.run import run
from tbatch.campaign.store import RESOLVED_NAME, SCENARIO_NAME, Store


def toy_run(folder, scenario=None, **options):
    scenario = scenario or ToyScenario()
    executor = options.pop("executor", None) or ToyExecutor(scenario)
    return run(scenario, out=folder, executor=executor, **options)


def reread(folder, scenario=None):
    return Campaign(Store.open(folder), scenario or ToyScenario())


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Content of the toy campaign, run in one go."""
    return contents(toy_run(tmp_path_factory.mktemp("undisturbed")))


def test_every_run_is_stored_once_with_its_inputs(tmp_path):
    campaign = toy_run(tmp_path, executor=ToyExecutor(ToyScenario(), diverging=frozenset({(1, 99)})))
    runs = campaign.table("runs").to_pylist()
    assert [(row["case"], row["sample"]) for row in runs] == [
        (case, sample) for case in (0, 1) for sample in range(100)
    ]
    assert runs[-1] == {
        "case": 1,
        "sample": 99,
        "name": "c01-s000099",
        "speed": 100.0,
        "seed": 7,
        "status": 1,
        "steps": STOPPED,
        "duration": 0.5,
        "evaluated_length": 45.0,
    }
    assert campaign.diverged == 1
    assert campaign.table("wheels").num_rows == 2 * 200
    separations = sum(campaign.table("wheels")["separations"].to_pylist())
    assert campaign.table("events").num_rows == separations > 0
    assert [row["runs"] for row in campaign.statistics().to_pylist()] == [100, 100, 99, 99]


def test_the_batch_size_changes_no_stored_byte(tmp_path, undisturbed):
    for limit in (1, 64, 100_000):
        folder = tmp_path / str(limit)
        assert contents(toy_run(folder, executor=ToyExecutor(ToyScenario(), limit=limit))) == undisturbed
    files = [sorted((folder / "wheels").iterdir()) for folder in tmp_path.iterdir()]
    assert len({tuple(path.read_bytes() for path in paths) for paths in files}) == 1


def test_a_complete_campaign_simulates_nothing_again(tmp_path, undisturbed):
    toy_run(tmp_path)
    executor = ToyExecutor(ToyScenario())
    assert contents(toy_run(tmp_path, executor=executor)) == undisturbed
    assert executor.asked == []


def test_more_runs_extend_and_redo_nothing(tmp_path):
    toy_run(tmp_path / "grown", ToyScenario(samples=30))
    executor = ToyExecutor(ToyScenario(samples=100))
    grown = toy_run(tmp_path / "grown", executor.scenario, executor=executor)
    assert sorted(executor.asked) == [(case, sample) for case in (0, 1) for sample in range(30, 100)]
    assert contents(grown) == contents(toy_run(tmp_path / "at once"))
    assert json.loads((tmp_path / "grown" / "resolved.json").read_text())["campaign"]["runs"] == 100


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seed": 8}, "campaign.seed: stored 7, given 8"),
        ({"samples": 50}, "campaign.runs: stored 100, given 50"),
        ({"speeds": (50.0, 101.0)}, r"speed.values: stored \[50.0,100.0\], given \[50.0,101.0\]"),
        ({"step": 2e-3}, "integration.step: stored 0.001, given 0.002"),
    ],
)
def test_a_changed_key_is_refused_by_name_and_nothing_is_touched(tmp_path, change, said):
    toy_run(tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with pytest.raises(ScenarioChanged, match=said):
        toy_run(tmp_path, dataclasses.replace(ToyScenario(), **change))
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_an_interruption_keeps_what_is_stored_and_resuming_gives_the_same(tmp_path, undisturbed):
    def interrupt(state):
        if state.runs_done >= 64:
            raise Interrupted(signal.SIGINT)

    with pytest.raises(Interrupted):
        toy_run(tmp_path, executor=ToyExecutor(ToyScenario(), limit=64), progress=interrupt)
    kept = reread(tmp_path)
    assert kept.runs_stored == 64
    executor = ToyExecutor(ToyScenario())
    assert contents(toy_run(tmp_path, executor=executor)) == undisturbed
    assert len(executor.asked) == 200 - 64


KILLED = """
import sys
sys.path.insert(0, {tests!r})
from toy import ToyExecutor, ToyScenario
from tbatch.campaign.run import run
print("ready", flush=True)
run(ToyScenario(samples=640), out={folder!r}, executor=ToyExecutor(ToyScenario(samples=640), limit=64, delay=0.002))
"""


def test_kill_9_at_any_moment_loses_no_stored_shard_and_resuming_gives_the_same(tmp_path):
    scenario = ToyScenario(samples=640)
    expected = contents(toy_run(tmp_path / "undisturbed", scenario))
    folder = tmp_path / "killed"
    code = KILLED.format(tests=str(Path(__file__).parent), folder=str(folder))
    moments = random.Random(1)
    kills = 0
    for _ in range(6):
        process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
        process.stdout.readline()
        time.sleep(moments.uniform(0.0, 0.12))
        kills += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        if (folder / MANIFEST_NAME).exists():
            assert reread(folder, scenario).store.damage() == []
    assert kills
    acknowledged = {
        (shard.case, sample)
        for shard in (reread(folder, scenario).store.shards if (folder / MANIFEST_NAME).exists() else [])
        for sample in range(shard.start, shard.stop)
    }
    executor = ToyExecutor(scenario)
    assert contents(toy_run(folder, scenario, executor=executor)) == expected
    assert not acknowledged & set(executor.asked)
    assert not list(folder.rglob("*.tmp"))


def test_shards_that_a_killed_process_stored_but_did_not_note_are_taken_over(tmp_path, undisturbed):
    toy_run(tmp_path)
    (tmp_path / MANIFEST_NAME).unlink()
    said = []
    executor = ToyExecutor(ToyScenario())
    assert contents(toy_run(tmp_path, executor=executor, message=said.append)) == undisturbed
    assert executor.asked == []
    assert any("taken over: c00-s000000-000064" in line for line in said)


def test_a_stray_shard_that_is_not_whole_is_redone(tmp_path, undisturbed):
    toy_run(tmp_path)
    (tmp_path / MANIFEST_NAME).unlink()
    (tmp_path / "wheels" / "c00-s000000-000064.parquet").unlink()
    cut = tmp_path / "events" / "c01-s000000-000064.parquet"
    cut.write_bytes(cut.read_bytes()[:-20])
    executor = ToyExecutor(ToyScenario())
    assert contents(toy_run(tmp_path, executor=executor)) == undisturbed
    assert len(executor.asked) == 128


def test_a_shard_of_another_campaign_is_refused_and_not_removed(tmp_path):
    toy_run(tmp_path / "one")
    toy_run(tmp_path / "other", ToyScenario(seed=8))
    (tmp_path / "one" / MANIFEST_NAME).unlink()
    name = "c00-s000064-000100.parquet"
    for kind in ("runs", "wheels", "events"):
        (tmp_path / "other" / kind / name).replace(tmp_path / "one" / kind / name)
    with pytest.raises(StoreDamaged, match=f"{name}: a shard of another campaign"):
        toy_run(tmp_path / "one")
    assert (tmp_path / "one" / "runs" / name).exists()


def test_a_file_of_another_campaign_is_not_removed_even_if_those_beside_it_are_missing(tmp_path):
    toy_run(tmp_path / "one")
    toy_run(tmp_path / "other", ToyScenario(seed=8, samples=150))
    name = "c00-s000128-000150.parquet"
    (tmp_path / "other" / "runs" / name).replace(tmp_path / "one" / "runs" / name)
    with pytest.raises(StoreDamaged, match=f"{name}: a shard of another campaign"):
        toy_run(tmp_path / "one", ToyScenario(samples=150))
    assert (tmp_path / "one" / "runs" / name).exists()


@pytest.mark.parametrize("lost", [(SCENARIO_NAME,), (RESOLVED_NAME,), (SCENARIO_NAME, RESOLVED_NAME)])
@pytest.mark.parametrize("part", [None, Part(0, 2)])
def test_a_lost_document_is_written_again_by_running_and_refused_by_reading(tmp_path, undisturbed, lost, part):
    toy_run(tmp_path)
    texts = {name: (tmp_path / name).read_bytes() for name in lost}
    for name in lost:
        (tmp_path / name).unlink()
    with pytest.raises(StoreDamaged, match=f"{lost[-1]}: missing"):
        Store.open(tmp_path)
    with pytest.raises(ScenarioChanged, match="another scenario"):
        toy_run(tmp_path, ToyScenario(seed=8), part=part)
    executor, said = ToyExecutor(ToyScenario()), []
    toy_run(tmp_path, executor=executor, part=part, message=said.append)
    assert executor.asked == []
    assert {name: (tmp_path / name).read_bytes() for name in lost} == texts
    assert lost[-1] in said[0]
    assert contents(reread(tmp_path)) == undisturbed


def test_a_resolved_scenario_without_what_readers_need_is_damage(tmp_path):
    (tmp_path / RESOLVED_NAME).write_text('{"campaign": {"runs": 3}}')
    with pytest.raises(StoreDamaged, match="not a resolved scenario"):
        Store.open(tmp_path)


def test_a_missing_file_is_redone_by_running_and_refused_by_reading(tmp_path, undisturbed):
    toy_run(tmp_path)
    (tmp_path / "runs" / "c01-s000064-000100.parquet").unlink()
    with pytest.raises(StoreDamaged, match=r"c01-s000064-000100.parquet: missing"):
        reread(tmp_path).statistics()
    executor = ToyExecutor(ToyScenario())
    assert contents(toy_run(tmp_path, executor=executor)) == undisturbed
    assert len(executor.asked) == 36


def test_a_single_flipped_bit_anywhere_is_found_and_no_number_is_given(tmp_path):
    toy_run(tmp_path)
    files = [path for path in sorted(tmp_path.rglob("*")) if path.is_file()]
    assert len(files) == 3 + 4 * 3
    draw = random.Random(2)
    for path in files * 4:
        sound = path.read_bytes()
        data = bytearray(sound)
        data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        path.write_bytes(data)
        with pytest.raises(StoreDamaged, match=path.name):
            store = Store.open(tmp_path)
            for kind in ("runs", "wheels", "events"):
                store.table(kind)
        with pytest.raises(StoreDamaged, match=path.name):
            toy_run(tmp_path)
        path.write_bytes(sound)
    assert reread(tmp_path).store.damage() == []


@pytest.mark.parametrize(("number", "fault"), [(errno.ENOSPC, OutOfSpace), (errno.EACCES, FolderUnusable)])
def test_the_nth_write_failing_is_said_and_resuming_gives_the_same(tmp_path, undisturbed, monkeypatch, number, fault):
    real = os.replace
    for failing in range(40):
        folder = tmp_path / str(failing)
        calls = 0

        def replace(source, target, failing=failing):
            nonlocal calls
            calls += 1
            if calls == failing + 1:
                raise OSError(number, os.strerror(number), str(target))
            real(source, target)

        monkeypatch.setattr(durable.os, "replace", replace)
        try:
            toy_run(folder, executor=ToyExecutor(ToyScenario(), limit=64))
        except fault as error:
            assert str(folder) in str(error)
        else:
            break
        finally:
            monkeypatch.undo()
        assert not list(folder.rglob("*.tmp"))
        assert contents(toy_run(folder)) == undisturbed
    else:
        pytest.fail("writing never succeeded")
    assert failing > 10


def test_a_folder_in_use_is_refused_before_anything_is_written(tmp_path):
    with FolderLock(tmp_path), pytest.raises(FolderInUse, match=f"pid {os.getpid()}"):
        toy_run(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_path_that_is_a_file_is_refused_naming_it(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FolderUnusable, match=str(tmp_path / "file")):
        toy_run(tmp_path / "file")


def test_reading_a_folder_without_campaign_says_so(tmp_path):
    with pytest.raises(FolderUnusable, match="not a campaign folder"):
        Store.open(tmp_path)


def test_progress_counts_up_to_the_whole(tmp_path):
    seen = []
    toy_run(tmp_path, executor=ToyExecutor(ToyScenario(), limit=64), progress=seen.append)
    assert [state.runs_done for state in seen] == sorted(state.runs_done for state in seen)
    last = seen[-1]
    assert (last.runs_done, last.runs_total) == (200, 200)
    assert last.run_steps_done == last.run_steps_total == 200 * STEPS
    assert last.separations == reread(tmp_path).table("events").num_rows
