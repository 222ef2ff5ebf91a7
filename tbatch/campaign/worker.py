"""What a worker of a cluster does: it simulates shards, stores them in the shared folder, and says what it stored.

A worker has one process and one thread: Taichi 1.7.4 compiles only in the thread that started it, so it is started
here, inside the task, and never by a plugin of the worker. The scenario is built once a process.
"""

import json
import os
import socket
import threading
import time
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from tbatch.campaign.executor import Local
from tbatch.campaign.faults import ClusterUnusable
from tbatch.campaign.identity import canonical, identity
from tbatch.campaign.provenance import processor, versions
from tbatch.campaign.records import tables_of
from tbatch.campaign.shards import Shard
from tbatch.campaign.store import RESOLVED_NAME, write_shard

_home: list[int] = []  # the thread that Taichi belongs to


def run_shards(folder: str, tables: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Simulates and stores shards of a campaign.

    Args:
        folder: The campaign folder, where this machine sees it.
        tables: The resolved scenario.
        names: Names of the shards, run together.

    Returns:
        ``entries``, what the manifest says of each shard by name, and what they took: ``run_steps``, ``seconds``,
        ``kernel_seconds``, ``separations``; ``session``, who made them.
    """
    if not _home:
        _home.append(threading.get_ident())
    if _home != [threading.get_ident()]:
        raise ClusterUnusable("a worker needs one thread, which is Taichi's: start it with --nthreads 1")
    campaign = identity(tables)
    _check_folder(Path(folder), campaign)
    executor = _executor(canonical(tables))
    shards = [Shard.parse(name) for name in names]
    began = time.perf_counter()
    result = executor.simulate([pair for shard in shards for pair in shard.pairs])
    stored = {
        shard.name: write_shard(Path(folder), campaign, shard, of_kind)
        for shard, of_kind in tables_of(executor.scenario, shards, result).items()
    }
    seconds = time.perf_counter() - began
    run_steps = int(np.sum(result.steps))
    kernel = result.run_steps_per_second
    return {
        "entries": stored,
        "run_steps": run_steps,
        "seconds": seconds,
        "kernel_seconds": run_steps / kernel if kernel > 0.0 else seconds,
        "separations": result.separations.num_rows,
        "session": {
            "id": f"{socket.gethostname()}-{os.getpid()}",
            "versions": versions(),
            "processor": processor(),
        },
    }


@lru_cache(maxsize=1)
def _executor(tables: str) -> Local:
    from tbatch.scenario import Scenario

    return Local(Scenario.from_tables(json.loads(tables)), threads=1)


def _check_folder(folder: Path, campaign: str) -> None:
    try:
        found = identity(json.loads((folder / RESOLVED_NAME).read_bytes()))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        found = None
    if found != campaign:
        raise ClusterUnusable(
            f"worker on {socket.gethostname()}: {folder} is not the campaign's folder there; give a folder that all "
            "machines see under the same path with --out"
        )
