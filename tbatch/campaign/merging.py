"""Campaign folders of several machines joined into one: ``tbatch merge``."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.durable import make_folder, read_bytes, write_bytes
from tbatch.campaign.faults import FolderUnusable, StoreDamaged
from tbatch.campaign.identity import run_count
from tbatch.campaign.part import holding
from tbatch.campaign.preparation import refuse_if_changed
from tbatch.campaign.records import KINDS
from tbatch.campaign.shards import SHARD_SAMPLES, Shard, overlapping
from tbatch.campaign.store import QUARANTINE, SCENARIO_NAME, Message, Store


def merge(target: Path, sources: Sequence[Path], *, message: Message) -> Campaign:
    """Joins campaign folders into one, which then names every shard of all of them in one manifest.

    Every file is read against its checksum before it counts. The sources are only read.

    Args:
        target: The folder to join into: a campaign folder, one that parts worked in, or a new one.
        sources: Further folders of the same campaign.
        message: Where to say what was found.

    Raises:
        ScenarioChanged: A folder holds another campaign; names the keys.
        StoreDamaged: A file of any folder is not what was written; nothing was changed.
    """
    known = {folder.resolve(): folder for folder in sources}
    known.pop(target.resolve(), None)
    others = [Store.open(folder) for folder in known.values()]
    stores = [*([Store.open(target)] if _exists(target) else []), *others]
    if not stores:
        raise FolderUnusable(f"{target} is not a campaign folder, and no other is given to merge into it")
    for store in others:
        refuse_if_changed(store.folder, _without_runs(stores[0].resolved), _without_runs(store.resolved))
    damage = [line for store in others for line in store.damage()]
    if damage:
        raise StoreDamaged(damage)
    longest = max(stores, key=lambda store: run_count(store.resolved))
    source = read_bytes(longest.folder / SCENARIO_NAME).decode()
    make_folder(target)
    with holding(target, None, message):
        store = Store.prepare(target, source, longest.resolved, message=message)
        for other in others:
            taken = _take_over(store, other, message)
            message(f"{other.folder}: {taken} of {len(other.shards)} shards taken over")
        store.save()
    return Campaign(store)


def _take_over(store: Store, other: Store, message: Message) -> int:
    """Copies the shards of another folder that this one has not; gives their number."""
    sessions = store.manifest.join_sessions(other.manifest)
    taken: dict[Shard, dict[str, Any]] = {}
    beside = defaultdict(list)  # no shard reaches beyond its block of samples
    for shard in store.manifest.shards:
        beside[_block(shard)].append(shard)
    for shard, entry in other.manifest.shards.items():
        if shard in store.manifest.shards:
            if _sums(store.manifest.shards[shard]) != _sums(entry):
                message(f"{shard.name} of {other.folder} has other last bits (another processor?); the first is kept")
        elif overlap := overlapping([shard, *beside[_block(shard)]]):
            message(f"{shard.name} of {other.folder} is left out: {overlap[0][0].name} holds some of its runs")
        else:
            for kind in reversed(KINDS):
                data = read_bytes(other.path(kind, shard), entry["files"][kind]["sha256"])
                write_bytes(store.path(kind, shard), data)
            taken[shard] = {**entry, "session": sessions.get(entry.get("session"))}
            beside[_block(shard)].append(shard)
    store.manifest.shards.update(taken)
    for name, sha256 in other.manifest.quarantine.items():
        make_folder(store.folder / QUARANTINE)
        write_bytes(store.folder / QUARANTINE / name, read_bytes(other.folder / QUARANTINE / name, sha256))
        store.manifest.quarantine[name] = sha256
    return len(taken)


def _exists(folder: Path) -> bool:
    try:
        return folder.is_dir() and any(folder.iterdir())
    except OSError as error:
        raise FolderUnusable(f"cannot read {folder}: {error.strerror}") from error


def _block(shard: Shard) -> tuple[int, int]:
    return shard.case, shard.start // SHARD_SAMPLES


def _sums(entry: dict[str, Any]) -> list[str]:
    return [entry["files"][kind]["sha256"] for kind in KINDS]


def _without_runs(resolved: dict[str, Any]) -> dict[str, Any]:
    campaign = {key: value for key, value in resolved["campaign"].items() if key != "runs"}
    return {**resolved, "campaign": campaign}
