"""Disks fill, processes are killed, environments are hostile: a campaign ends in the same bytes or says what is wrong.

Real processes and the real engine; the toy campaign's faults are in test_campaign, the cluster's in test_dask.
"""

import builtins
import contextlib
import errno
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from toy import ToyExecutor, ToyScenario, contents

from tbatch.campaign import durable
from tbatch.campaign.campaign import Campaign
from tbatch.campaign.executor import Local
from tbatch.campaign.faults import FolderUnusable, OutOfSpace
from tbatch.campaign.run import run
from tbatch.campaign.verification import verify
from tbatch.cli import exit_codes
from tbatch.scenario import Scenario

SHORT = ("run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"')
KINDS = ("runs", "wheels", "events")


def short(*changes):
    return Scenario.load("quick", overrides=[*SHORT, *changes])


def command(folder, *options, changes=SHORT):
    sets = [word for change in changes for word in ("--set", change)]
    return [sys.executable, "-m", "tbatch", "run", "quick", "--out", str(folder), *sets, *options]


def tbatch(folder, *options, changes=SHORT, **settings):
    done = subprocess.run(
        command(folder, *options, changes=changes), capture_output=True, text=True, timeout=300, check=False, **settings
    )
    assert "Traceback" not in done.stdout + done.stderr
    return done


def bytes_of(folder):
    return {(kind, path.name): path.read_bytes() for kind in KINDS for path in (Path(folder) / kind).iterdir()}


def first_stored(folder, process):
    until = time.monotonic() + 120.0
    while not list(Path(folder).glob("runs/*.parquet")):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The folder of an undisturbed campaign of 100 samples."""
    folder = tmp_path_factory.mktemp("sound")
    run(short("campaign.runs=100"), out=folder, threads=1)
    return folder


# Killed at any moment


def kill_and_resume(folder, kills, draw):
    """Kills the real campaign at random moments after its start and lets the last go through."""
    acknowledged = {}
    for _ in range(kills):
        process = subprocess.Popen(command(folder, "--runs", "100"), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        if draw.random() < 0.5:
            with contextlib.suppress(AssertionError):
                first_stored(folder, process)
        time.sleep(draw.uniform(0.0, 1.0))
        process.kill()
        process.communicate()
        if (folder / "resolved.json").exists() and (folder / "manifest.json").exists():
            assert verify(folder).damage == []
            stored = bytes_of(folder)
            assert acknowledged.items() <= stored.items()
            names = {shard.name for shard in Campaign.open(folder).store.shards}
            acknowledged = {key: data for key, data in stored.items() if key[1].removesuffix(".parquet") in names}
    written = {key: (folder / key[0] / key[1]).stat().st_mtime_ns for key in acknowledged}
    assert tbatch(folder, "--runs", "100").returncode == 0
    assert {key: (folder / key[0] / key[1]).stat().st_mtime_ns for key in written} == written


def test_a_killed_campaign_ends_in_the_same_bytes(tmp_path, sound):
    kill_and_resume(tmp_path / "folder", 2, random.Random(1))
    assert bytes_of(tmp_path / "folder") == bytes_of(sound)


@pytest.mark.slow
def test_fifty_kills_end_in_the_same_bytes(tmp_path, sound):
    draw = random.Random(2)
    for number in range(10):
        kill_and_resume(tmp_path / str(number), 5, draw)
        assert bytes_of(tmp_path / str(number)) == bytes_of(sound)


# The n-th write fails


@pytest.mark.parametrize(
    ("call", "number"), [("open", errno.EACCES), ("open", errno.ENOSPC), ("write", errno.ENOSPC), ("fsync", errno.EIO)]
)
def test_any_call_that_writes_may_fail_and_resuming_gives_the_same(tmp_path, monkeypatch, call, number):
    scenario = ToyScenario(samples=40)
    expected = contents(run(scenario, out=tmp_path / "sound", executor=ToyExecutor(scenario)))
    for failing in range(1, 60):
        folder = tmp_path / str(failing)
        calls = 0

        def fault(failing=failing):
            nonlocal calls
            calls += 1
            if calls == failing:
                raise OSError(number, os.strerror(number))

        class File:
            def __init__(self, file):
                self.file = file

            def __enter__(self):
                return self

            def __exit__(self, *error):
                self.file.close()

            def __getattr__(self, name):
                return getattr(self.file, name)

            def write(self, data):
                fault()
                return self.file.write(data)

        def opened(path, mode="r", fault=fault, File=File):
            if call == "open" and "w" in mode:
                fault()
            file = builtins.open(path, mode)
            return File(file) if call == "write" else file

        real_sync = os.fsync

        def synced(descriptor, fault=fault, real_sync=real_sync):
            fault()
            real_sync(descriptor)

        monkeypatch.setattr(durable, "open", opened, raising=False)
        if call == "fsync":
            monkeypatch.setattr(durable.os, "fsync", synced)
        try:
            run(scenario, out=folder, executor=ToyExecutor(scenario))
        except (OutOfSpace, FolderUnusable) as error:
            assert exit_codes.explain(error)[0] == (2 if number == errno.EACCES else 6)
            assert str(folder) in str(error)
        else:
            break
        finally:
            monkeypatch.undo()
        assert not list(folder.rglob("*.tmp"))
        assert contents(run(scenario, out=folder, executor=ToyExecutor(scenario))) == expected
        assert verify(folder).damage == []
    else:
        pytest.fail("writing never succeeded")
    assert failing > 8


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_full_disk_is_said_and_resuming_on_a_larger_one_gives_the_same(tmp_path):
    scenario = ToyScenario(samples=300)
    expected = contents(run(scenario, out=tmp_path / "sound", executor=ToyExecutor(scenario)))
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("no disk can be mounted here")
    try:
        with pytest.raises(OutOfSpace, match=r"bytes to write") as error:
            run(scenario, out=disk / "folder", executor=ToyExecutor(scenario, limit=64))
        assert str(disk) in str(error.value)
        assert exit_codes.explain(error.value)[0] == 6
        subprocess.run(["mount", "-o", "remount,size=8m", str(disk)], check=True)
        stored = Campaign.open(disk / "folder").runs_stored if (disk / "folder" / "manifest.json").exists() else 0
        executor = ToyExecutor(scenario)
        assert contents(run(scenario, out=disk / "folder", executor=executor)) == expected
        assert len(executor.asked) <= 600 - stored
        assert verify(disk / "folder").damage == []
    finally:
        subprocess.run(["umount", str(disk)], check=True)


# The same bits in every way


class Shuffled(Local):
    """Simulates a batch of any size in any order."""

    def __init__(self, scenario, *, threads, batch, shuffled):
        super().__init__(scenario, threads=threads)
        self.batch, self.shuffled = batch, shuffled

    def batch_limit(self, rate, steps):
        """As many as asked for."""
        return self.batch

    def rows(self, pairs):
        """Each run's rows as text, which holds every bit of a number, in the order of the pairs."""
        order = list(range(len(pairs)))
        if self.shuffled:
            random.Random(4).shuffle(order)
        result = self.simulate([pairs[place] for place in order])
        back = {place: at for at, place in enumerate(order)}
        wheels, events = result.summary.to_pylist(), result.separations.to_pylist()
        return [
            str([[{**row, "run": 0} for row in table if row["run"] == back[place]] for table in (wheels, events)])
            for place in range(len(pairs))
        ]


def check_bits(samples, threads, batches):
    scenario = short(f"campaign.runs={samples}")
    pairs = [(case, sample) for sample in range(samples) for case in range(2)]
    expected = Shuffled(scenario, threads=1, batch=0, shuffled=False).rows(pairs)
    for count in threads:
        for batch in batches:
            for shuffled in (False, True):
                executor = Shuffled(scenario, threads=count, batch=batch, shuffled=shuffled)
                found = [row for at in range(0, len(pairs), batch) for row in executor.rows(pairs[at : at + batch])]
                assert found == expected, (count, batch, shuffled)


def test_threads_batch_and_order_change_no_bit():
    check_bits(9, (2,), (7, 18))


@pytest.mark.slow
def test_no_thread_count_batch_or_order_changes_a_bit():
    check_bits(40, (1, 2, 4), (1, 7, 64, 80))


# One folder, several processes; signals


def test_a_second_campaign_on_the_same_folder_leaves_with_7_and_the_first_goes_on(tmp_path):
    first = subprocess.Popen(command(tmp_path, "--runs", "20000"), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    until = time.monotonic() + 60.0
    while not (tmp_path / "manifest.json").exists() and time.monotonic() < until:
        time.sleep(0.02)
    second = tbatch(tmp_path, "--runs", "20000")
    part = tbatch(tmp_path, "--runs", "20000", "--shard", "0/2")
    assert first.poll() is None
    first_stored(tmp_path, first)
    first.send_signal(signal.SIGINT)
    first.communicate(timeout=60)
    assert (first.returncode, second.returncode, part.returncode) == (130, 7, 7)
    assert f"in use by pid {first.pid} on host" in second.stderr
    assert verify(tmp_path).damage == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_within_ten_seconds_wherever_it_comes(tmp_path, number):
    """10 s is what the command promises; it is a bound of the stop, not a measure of speed."""
    process = subprocess.Popen(
        command(tmp_path, "--runs", "20000"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    until = time.monotonic() + 60.0
    while not (tmp_path / "manifest.json").exists() and time.monotonic() < until:
        time.sleep(0.02)
    process.send_signal(number)  # while the model is built or the kernels are loaded
    _, said = process.communicate(timeout=10)
    assert process.returncode == 128 + number
    assert "resume with: tbatch resume" in said
    assert "Traceback" not in said


# Hostile places


HOSTILE = {
    "home": {"HOME": "/proc/nowhere", "XDG_CACHE_HOME": "", "TBATCH_CACHE": "/proc/nowhere"},
    "locale": {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "clock": {"TZ": "Pacific/Kiritimati"},
    "hashes": {"PYTHONHASHSEED": "4711"},
    "viewer": {"RERUN": "off", "DISPLAY": ":99", "WAYLAND_DISPLAY": "nowhere"},
}


def in_hostile_place(tmp_path, names, sound):
    """Runs the campaign with one recording in a folder with blanks and other letters, without a network if root."""
    settings = {key: value for name in names for key, value in HOSTILE[name].items()}
    folder = tmp_path / "Gleis 7 – Überhöhung 道岔"
    changes = (*SHORT[:2], 'keep.timelines="worst:1"')
    words = command(folder, "--runs", "100", changes=changes)
    if not subprocess.run(["unshare", "-n", "true"], capture_output=True, check=False).returncode:
        words = ["unshare", "-n", *words]
    done = subprocess.run(words, capture_output=True, timeout=300, check=False, env={**os.environ, **settings})
    said = done.stderr.decode(errors="replace")
    assert done.returncode == 0, said
    assert "Traceback" not in said
    assert contents(Campaign.open(folder)) == contents(Campaign.open(sound))
    assert len(list((folder / "rrd").glob("*.rrd"))) == 2
    return folder


def test_no_locale_clock_network_or_viewer_changes_a_number(tmp_path, sound):
    # Without a home every start compiles anew, which takes a minute: see the slow test.
    folder = in_hostile_place(tmp_path, [name for name in HOSTILE if name != "home"], sound)
    assert verify(folder).damage == []


@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_each_hostile_place_alone(tmp_path, sound, name):
    in_hostile_place(tmp_path, [name], sound)


# Memory


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quick", "slab_irregular", "wheel_flat", "separation_vs_speed"])
def test_the_estimated_memory_is_within_a_quarter_of_the_measured_peak(tmp_path, name):
    changes = ["--set", 'keep.timelines="none"', "--runs", "200"]
    words = [sys.executable, "-m", "tbatch", "run", name, "--out", str(tmp_path / "folder"), *changes]
    said = subprocess.run([*words, "--dry-run"], capture_output=True, text=True, check=True).stdout
    estimated = float(said.split("memory  about ")[1].split(" MB")[0].replace(",", "")) * 1e6
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0
    assert estimated == pytest.approx(usage.ru_maxrss * 1024.0, rel=0.25)


MANY = """
from tbatch.engine.runs import Runs
from tbatch.engine.footprint import bytes_per_run
from tbatch.engine.simulate import simulate
from tbatch.scenario import Scenario
scenario = Scenario.load("quick")
runs, _ = scenario.runs([(0, sample % 4) for sample in range(40_000)])
assert 40_000 * bytes_per_run(scenario.model()) > 1e9
assert simulate(scenario.model(), runs, 4e-4, threads=2).status.max() == 0
"""


@pytest.mark.slow
def test_a_job_with_a_gigabyte_is_not_killed_for_more():
    """40,000 runs do not fit into the job's control group at once, though they fit into the machine."""
    group = Path("/sys/fs/cgroup/memory") / f"tbatch-{os.getpid()}"
    try:
        group.mkdir()
        (group / "memory.limit_in_bytes").write_text(str(2**30))
    except OSError:
        pytest.skip("no control group for memory can be made here")
    try:
        words = ["sh", "-c", f'echo $$ > {group}/cgroup.procs && exec "$0" -c "$1"', sys.executable, MANY]
        done = subprocess.run(words, capture_output=True, text=True, timeout=500, check=False)
        assert done.returncode == 0, done.stderr[-500:]
    finally:
        time.sleep(0.5)
        group.rmdir()
