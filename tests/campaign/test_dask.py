"""A real scheduler and real workers on the loopback: the bytes are those of this process alone, whoever is killed."""

import contextlib
import importlib.util
import random
import signal
import socket
import subprocess
import sys
import threading
import time

import psutil
import pytest
from toy import bytes_of

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.cluster import Dask
from tbatch.campaign.faults import ClusterUnusable
from tbatch.campaign.run import run
from tbatch.campaign.verification import verify
from tbatch.cli import exit_codes
from tbatch.scenario import Scenario

needs_dask = pytest.mark.skipif(
    not importlib.util.find_spec("distributed"), reason="Dask is not installed: tbatch[dask]"
)
SHORT = ("run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"', "campaign.runs=150")
WAIT = 90.0


def short(*changes):
    return Scenario.load("quick", overrides=[*SHORT, *changes])


class Cluster:
    """A scheduler and two workers, each a process of its own."""

    def __init__(self, folder):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.folder = folder
        self.processes = []
        address = f"tcp://127.0.0.1:{self.port}"
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        for _ in range(2):
            self.add_worker(address)

    def add_worker(self, address, threads=1):
        """Start a worker; its nanny starts it again when it dies."""
        arguments = [address, "--nthreads", str(threads), "--host", "127.0.0.1", "--no-dashboard"]
        return self._start("dask_worker", *arguments, "--local-directory", str(self.folder))

    def _start(self, module, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments]
        if module == "dask_scheduler":
            command.append("--no-dashboard")
        log = open(self.folder / f"{module}-{len(self.processes)}.log", "w")
        process = subprocess.Popen(command, stdout=log, stderr=log, cwd=self.folder)
        log.close()
        self.processes.append(process)
        return process

    @property
    def name(self):
        """What --executor is given."""
        return f"dask://127.0.0.1:{self.port}"

    def workers(self):
        """The processes that simulate: children of the workers' nannies."""
        found = []
        for nanny in self.processes[1:]:
            with contextlib.suppress(psutil.Error):
                children = psutil.Process(nanny.pid).children(recursive=True)
                found += [child for child in children if "spawn_main" in " ".join(child.cmdline())]
        return found

    def stop(self):
        """End all of it."""
        families = []
        for process in self.processes:
            with contextlib.suppress(psutil.Error):
                families += psutil.Process(process.pid).children(recursive=True)
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(10)
        for process in [*families, *(psutil.Process(p.pid) for p in self.processes if p.poll() is None)]:
            with contextlib.suppress(psutil.Error):
                process.kill()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Two workers, of one thread each."""
    cluster = Cluster(tmp_path_factory.mktemp("cluster"))
    yield cluster
    cluster.stop()


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """The campaign of this process alone."""
    folder = tmp_path_factory.mktemp("local")
    run(short(), out=folder, threads=2)
    return bytes_of(folder)


@needs_dask
def test_workers_store_the_bytes_of_one_process(tmp_path, cluster, local):
    seen = []
    campaign = run(short(), out=tmp_path, cluster=Dask(cluster.name), progress=seen.append)
    assert bytes_of(tmp_path) == local
    assert verify(tmp_path).damage == []
    assert (seen[-1].runs_done, seen[-1].run_steps_done) == (300, seen[-1].run_steps_total)
    assert 1 <= len(campaign.store.manifest.sessions) - 1 <= 2
    assert campaign.run_steps_per_second > 0.0


def run_and_kill(folder, cluster, share, wait):
    """Runs the campaign; a worker is killed a while after a share of the runs is stored. Gives whom it met."""
    killed = []

    def kill(state):
        workers = cluster.workers()
        if state.phase == "running" and not killed and workers and state.runs_done >= share * state.runs_total:
            time.sleep(wait)
            workers[0].kill()
            killed.append(workers[0].pid)

    run(short(), out=folder, cluster=Dask(cluster.name), progress=kill)
    return killed


@needs_dask
def test_a_worker_killed_in_the_middle_changes_nothing(tmp_path, cluster, local):
    assert run_and_kill(tmp_path, cluster, 0.2, 0.05)
    assert bytes_of(tmp_path) == local
    assert verify(tmp_path).damage == []


@needs_dask
@pytest.mark.slow
def test_a_worker_killed_twenty_times_changes_nothing(tmp_path, cluster, local):
    moments = random.Random(3)
    for number in range(20):
        assert run_and_kill(tmp_path / str(number), cluster, moments.uniform(0.0, 0.7), moments.uniform(0.0, 0.3))
        assert bytes_of(tmp_path / str(number)) == local


@needs_dask
@pytest.mark.slow
def test_the_process_that_hands_out_may_be_killed_too(tmp_path, cluster, local):
    command = [sys.executable, "-m", "tbatch", "run", "quick", "--out", str(tmp_path), "--executor", cluster.name]
    command += [word for change in SHORT for word in ("--set", change)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    until = time.monotonic() + WAIT
    while not list(tmp_path.glob("runs/*.parquet")) and time.monotonic() < until and process.poll() is None:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    run(short(), out=tmp_path, cluster=Dask(cluster.name))
    assert bytes_of(tmp_path) == local


@needs_dask
def test_an_interruption_stops_at_once_and_is_resumed(tmp_path, cluster, local):
    command = [sys.executable, "-m", "tbatch", "run", "quick", "--out", str(tmp_path), "--executor", cluster.name]
    command += [word for change in (*SHORT, "campaign.runs=20000") for word in ("--set", change)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + WAIT
    while not list(tmp_path.glob("runs/*.parquet")):
        assert time.monotonic() < until
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "resume with: tbatch resume" in said
    assert "Traceback" not in said
    assert verify(tmp_path).damage == []
    assert 0 < Campaign.open(tmp_path).runs_total - Campaign.open(tmp_path).runs_stored


@needs_dask
@pytest.mark.slow
def test_a_worker_of_several_threads_is_refused_with_what_to_do(tmp_path):
    cluster = Cluster(tmp_path)
    try:
        cluster.add_worker(f"tcp://127.0.0.1:{cluster.port}", threads=2)
        refused = None
        until = time.monotonic() + WAIT
        while refused is None and time.monotonic() < until:
            try:
                run(short("campaign.runs=1"), out=tmp_path / str(time.monotonic()), cluster=Dask(cluster.name))
            except ClusterUnusable as error:
                refused = str(error)
        assert "--nthreads 1" in refused
    finally:
        cluster.stop()


@needs_dask
@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_said_and_what_is_stored_stays(tmp_path):
    cluster = Cluster(tmp_path)

    def lose(state):
        if state.runs_done:
            cluster.stop()

    try:
        with pytest.raises(ClusterUnusable, match=r"resume|answers"):
            run(short("campaign.runs=2000"), out=tmp_path / "folder", cluster=Dask(cluster.name), progress=lose)
    finally:
        cluster.stop()
    assert Campaign.open(tmp_path / "folder").runs_stored > 0
    assert verify(tmp_path / "folder").damage == []


@needs_dask
def test_no_scheduler_is_said_with_its_address(tmp_path, monkeypatch):
    monkeypatch.setattr("tbatch.campaign.cluster.CONNECT", 0.5)
    with pytest.raises(ClusterUnusable, match=r"no Dask scheduler answers at tcp://127.0.0.1:9"):
        run(short(), out=tmp_path, cluster=Dask("dask://127.0.0.1:9"))


@pytest.mark.parametrize(
    "address",
    [
        "dask://",
        "dask://host",
        "dask:host:1",
        "tcp://host:1",
        "dask://host:1/x",
        "dask://a..b:1",
        "dask://host:65536",
        "ray",
    ],
)
def test_what_is_no_executor_is_refused(address):
    with pytest.raises(ValueError, match="dask://HOST:PORT is needed"):
        Dask(address)


def test_without_dask_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterUnusable, match=r"pip install 'tbatch\[dask\]'") as error:
        Dask("dask://host:1")
    assert exit_codes.explain(error.value)[0] == 2


@needs_dask
def test_a_second_thread_is_refused_by_the_worker_itself(monkeypatch):
    from tbatch.campaign import worker

    monkeypatch.setattr(worker, "_home", [threading.get_ident() + 1])
    with pytest.raises(ClusterUnusable, match="--nthreads 1"):
        worker.run_shards("x", {}, [])
