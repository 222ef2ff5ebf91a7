"""Every file of a campaign folder read again and held against what was written: ``tbatch verify``."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tbatch.campaign.adoption import shard_metadata, stray_entry
from tbatch.campaign.durable import TEMPORARY_SUFFIX, read_bytes, read_table
from tbatch.campaign.faults import StoreDamaged
from tbatch.campaign.manifest import MANIFEST_NAME
from tbatch.campaign.records import KINDS
from tbatch.campaign.shards import Shard
from tbatch.campaign.store import QUARANTINE, RECORDINGS, Store


@dataclass
class Verification:
    """What was found in a campaign folder."""

    files: int = 0
    """Files read and found to be what was written."""
    damage: list[str] = field(default_factory=list)
    """A line for each file that is missing, altered, foreign or in the wrong place."""
    notes: list[str] = field(default_factory=list)
    """What a killed process left: no damage, and put right when the campaign goes on."""


def verify(folder: Path) -> Verification:
    """Reads every file of a campaign folder; FolderUnusable if it is none."""
    found = Verification()
    try:
        store = Store.open(folder)
    except StoreDamaged as error:
        found.damage += error.damage
        return found
    found.files = len(store.manifest.documents) + 1
    found.damage += store.damage(lambda shard: False)
    if not (folder / MANIFEST_NAME).exists() and not store.manifest.shards and _strays(store):
        found.damage.append(f"{folder / MANIFEST_NAME}: missing")
    for shard in store.shards:
        damage = _shard_damage(store, shard)
        found.damage += damage
        found.files += 0 if damage else len(KINDS)
    for place, noted in ((RECORDINGS, store.manifest.recordings), (QUARANTINE, store.manifest.quarantine)):
        for name, sha256 in noted.items():
            try:
                read_bytes(folder / place / name, sha256)
                found.files += 1
            except StoreDamaged as error:
                found.damage += error.damage
    for name in _strays(store):
        _judge_stray(store, name, found)
    for left in [*folder.glob(f".*{TEMPORARY_SUFFIX}"), *folder.glob(f"*/.*{TEMPORARY_SUFFIX}")]:
        found.notes.append(f"{left}: left by a killed process, removed when the campaign goes on")
    return found


def _shard_damage(store: Store, shard: Shard) -> list[str]:
    """A line for each file that was not so written, says of itself another name, or has other runs' rows."""
    entry = store.manifest.shards[shard]
    damage = []
    for kind in KINDS:
        path, noted = store.path(kind, shard), entry["files"][kind]
        try:
            table = read_table(path, noted["sha256"])
        except StoreDamaged as error:
            damage += error.damage
            continue
        said = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
        if said != shard_metadata(store.manifest.campaign, shard, kind):
            damage.append(f"{path}: it is {said.get('tbatch.kind')} of {said.get('tbatch.shard')}")
        samples = table["sample"].to_numpy()
        if table.num_rows != noted["rows"] or np.any((samples < shard.start) | (samples >= shard.stop)):
            damage.append(f"{path}: does not hold the rows of its name")
    return damage


def _strays(store: Store) -> list[str]:
    """Names of Parquet files that no manifest names."""
    known = {shard.name for shard in store.manifest.shards}
    return sorted({path.stem for kind in KINDS for path in (store.folder / kind).glob("*.parquet")} - known)


def _judge_stray(store: Store, name: str, found: Verification) -> None:
    """A stray shard is what a killed process left, or it has no business there."""
    paths = {kind: path for kind in KINDS if (path := store.folder / kind / f"{name}.parquet").exists()}
    try:
        shard = Shard.parse(name)
        if len(paths) == len(KINDS):
            stray_entry(paths, store.manifest.campaign, shard)
            found.notes.append(f"{name}: stored but not noted, taken over when the campaign goes on")
            return
        for kind, path in paths.items():
            said = read_table(path).schema.metadata or {}
            expected = shard_metadata(store.manifest.campaign, shard, kind)
            if {key.decode(): value.decode() for key, value in said.items()} != expected:
                raise StoreDamaged(f"{path}: not a file of this campaign's {name}")
        found.notes.append(f"{name}: left incomplete by a killed process, its runs are redone")
    except StoreDamaged as error:
        found.damage += error.damage
    except ValueError as error:
        found.damage.append(f"{next(iter(paths.values()))}: {error}")
