"""Workers that simulate and store a campaign's shards for this process, over Dask: ``--executor dask://HOST:PORT``.

This process holds the folder, hands out shards and notes what is stored. A worker writes its shards to the shared
folder and answers with their checksums alone, so that a lost worker costs only what it was at: its shards are run again
by another one, bit for bit the same.
"""

import logging
import queue
import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from tbatch.campaign.executor import MOST_RUNS
from tbatch.campaign.faults import CampaignFault, ClusterUnusable
from tbatch.campaign.progress import Progress, Report
from tbatch.campaign.shards import SHARD_SAMPLES, Shard, take_batch
from tbatch.campaign.store import Message

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

CONNECT = 10.0  # s to reach the scheduler, and to reach it again
TASKS_A_WORKER = 6  # few enough to share surfaces between speeds, many enough that all workers end together
RETRIES = 2
LOOK_EVERY = 0.2  # s between two looks whether somebody wants to stop

_ADDRESS = re.compile(r"dask://((?:[^/\s:.]+\.)*[^/\s:.]+|\[[0-9A-Fa-f:.]+\]):(\d{1,5})/?", re.ASCII)


class Cluster(Protocol):
    """Where shards are simulated and stored by others; ``Dask`` is one."""

    def simulate(self, campaign: "Campaign", missing: Sequence[Shard], report: Report, message: Message) -> None:
        """Simulates and stores shards, and notes them in the campaign's manifest."""
        ...


class Dask:
    """The workers of a Dask scheduler."""

    def __init__(self, address: str) -> None:
        """Takes ``dask://HOST:PORT``; ValueError for anything else, ClusterUnusable where Dask is not installed."""
        match = _ADDRESS.fullmatch(address)
        if match is None or not 1 <= int(match[2]) <= 65535:
            raise ValueError(
                f"--executor {address!r}: local or dask://HOST:PORT is needed, such as dask://10.0.0.1:8786,"
                " with a port of 1 to 65535"
            )
        try:
            import distributed  # noqa: F401
        except ImportError as error:
            raise ClusterUnusable("Dask is not installed: pip install 'tbatch[dask]'") from error
        self.address = f"tcp://{match[1]}:{match[2]}"

    def simulate(self, campaign: "Campaign", missing: Sequence[Shard], report: Report, message: Message) -> None:
        """Simulates and stores shards; see ``Cluster``."""
        report(Progress("building", 0, sum(map(len, missing)), 0, 0, 0))
        with _client(self.address) as client:
            _Work(campaign, missing, report, message, client).finish()


class _Work:
    """The shards of one campaign on their way through the workers."""

    def __init__(
        self, campaign: "Campaign", missing: Sequence[Shard], report: Report, message: Message, client: Any
    ) -> None:
        self.campaign, self.report, self.message, self.client = campaign, report, message, client
        self.steps = campaign.executor.steps_per_run()
        self.run_steps_total = sum(len(shard) * self.steps[shard.case] for shard in missing)
        self.runs_total = sum(len(shard) for shard in missing)
        self.runs_done = self.steps_done = self.separations = 0
        self.done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._wait_for_workers()
        self.tasks = _tasks(missing, len(client.nthreads()))

    def finish(self) -> None:
        """Hands out all tasks and notes each as it comes back."""
        from tbatch.campaign.worker import run_shards

        folder, tables = str(Path(self.campaign.folder).resolve()), self.campaign.store.resolved
        names = [[shard.name for shard in task] for task in self.tasks]
        futures = self.client.map(
            run_shards, [folder] * len(names), [tables] * len(names), names, pure=False, retries=RETRIES
        )
        for future in futures:
            future.add_done_callback(self.done.put)
        try:
            while self.runs_done < self.runs_total:
                self._tell()
                try:
                    self._note(self.done.get(timeout=LOOK_EVERY))
                except queue.Empty:
                    self._check_scheduler()
            self._tell()
        finally:
            if self.runs_done < self.runs_total:
                _quietly_cancel(self.client, futures)

    def _note(self, future: Any) -> None:
        """Notes the shards of a finished task."""
        if future.status != "finished":
            raise _fault(future, self.address)
        stored = future.result()
        store = self.campaign.store
        store.note(
            {Shard.parse(name): entry for name, entry in stored["entries"].items()},
            session=self._session(stored["session"]),
            run_steps=stored["run_steps"],
            seconds=stored["seconds"],
            kernel_seconds=stored["kernel_seconds"],
        )
        self.runs_done += sum(entry["runs"] for entry in stored["entries"].values())
        self.steps_done += stored["run_steps"]
        self.separations += stored["separations"]
        future.release()

    def _session(self, made_by: dict[str, Any]) -> int:
        """Number of a worker's session in the manifest."""
        from tbatch.campaign.preparation import warn_of_other_versions

        sessions = self.campaign.store.own.sessions
        for number, session in enumerate(sessions):
            if session.get("id") == made_by["id"]:
                return number
        warn_of_other_versions(sessions[-1], made_by, self.message)
        sessions.append(made_by | {"run_steps": 0, "seconds": 0.0, "kernel_seconds": 0.0})
        return len(sessions) - 1

    def _wait_for_workers(self) -> None:
        """Waits until there is a worker; ClusterUnusable if one has several threads."""
        asked = time.monotonic()
        told = False
        while not (threads := self.client.nthreads()):
            self._tell()
            self._check_scheduler()
            if not told and time.monotonic() - asked > 2.0:
                self.message(f"the scheduler at {self.address} has no workers yet; waiting for some")
                told = True
            time.sleep(LOOK_EVERY)
        many = [worker for worker, count in threads.items() if count != 1]
        if many:
            raise ClusterUnusable(
                f"worker {many[0]} has {threads[many[0]]} threads: one is needed, which is Taichi's. Start workers "
                "with --nthreads 1, one for each core"
            )

    @property
    def address(self) -> str:
        return str(self.client.scheduler.address) if self.client.scheduler else "the scheduler"

    def _check_scheduler(self) -> None:
        if self.client.status != "running":
            raise ClusterUnusable(f"the scheduler was lost ({self.client.status}); what is stored stays, resume")

    def _tell(self) -> None:
        state = Progress(
            "running", self.runs_done, self.runs_total, self.steps_done, self.run_steps_total, self.separations
        )
        self.report(state)


def _tasks(missing: Sequence[Shard], workers: int) -> list[list[Shard]]:
    """The shards in groups to be run together, all speeds of the same samples side by side."""
    runs = sum(len(shard) for shard in missing)
    limit = max(SHARD_SAMPLES, min(MOST_RUNS, runs // max(1, TASKS_A_WORKER * workers)))
    tasks = []
    left = list(missing)
    while left:
        tasks.append(take_batch(left, limit))
        left = left[len(tasks[-1]) :]
    return tasks


def _client(address: str) -> Any:
    from distributed import Client

    # Its warnings about lost connections would come between the lines of the progress; what matters is raised.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ClusterUnusable(f"no Dask scheduler answers at {address} ({text})") from error


def _fault(future: Any, address: str) -> BaseException:
    """What became of a task that gave no result."""
    if future.status != "error":
        return ClusterUnusable(f"the scheduler at {address} dropped a task ({future.status}); resume")
    error: BaseException = future.exception()
    if isinstance(error, CampaignFault):
        return error
    if type(error).__name__ == "KilledWorker":
        return ClusterUnusable(f"several workers died at the same task ({error}); memory? What is stored stays, resume")
    return error


def _quietly_cancel(client: Any, futures: Any) -> None:
    try:
        client.cancel(futures, force=True)
    except Exception:
        logging.getLogger(__name__).debug("the scheduler has gone, with its tasks", exc_info=True)
