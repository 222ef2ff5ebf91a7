"""The campaign folder: the scenario as given and resolved, the manifest, and Parquet shards.

    campaign.toml   the scenario as given          resolved.json   with every default, in SI
    manifest.json   versions, shards, checksums    lock            who works here
    runs/ wheels/ events/   one Parquet file each per shard        rrd/   recordings of the kept runs

Reading needs no lock. Whoever writes must hold the folder's lock.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa

from tbatch.campaign.adoption import adopt, shard_metadata
from tbatch.campaign.durable import (
    hash_of,
    make_folder,
    read_bytes,
    read_table,
    remove_leftovers,
    table_bytes,
    write_bytes,
)
from tbatch.campaign.faults import FolderUnusable, ScenarioChanged, StoreDamaged
from tbatch.campaign.identity import changed_keys, identity, run_count
from tbatch.campaign.manifest import MANIFEST_NAME, Manifest
from tbatch.campaign.provenance import decisive, processor, versions
from tbatch.campaign.records import KINDS
from tbatch.campaign.shards import Shard, overlapping

SCENARIO_NAME = "campaign.toml"
RESOLVED_NAME = "resolved.json"
RECORDINGS = "rrd"

Message = Callable[[str], None]


class Store:
    """A campaign folder. ``open`` reads one, ``prepare`` makes one ready to be written."""

    def __init__(self, folder: Path, resolved: dict[str, Any], manifest: Manifest) -> None:
        """Takes what the folder's documents say; use ``open`` or ``prepare``."""
        self.folder = folder
        self.resolved = resolved
        self.manifest = manifest

    @classmethod
    def open(cls, folder: Path) -> "Store":
        """Reads a campaign folder. FolderUnusable if it is none, StoreDamaged if its documents do not fit together."""
        folder = Path(folder)
        manifest = Manifest.read(folder)
        path = folder / RESOLVED_NAME
        if manifest is None and not path.exists():
            raise FolderUnusable(f"{folder} is not a campaign folder: it has no {RESOLVED_NAME}")
        data = read_bytes(path)
        try:
            resolved = json.loads(data)
            found = identity(resolved)
            run_count(resolved)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise StoreDamaged(f"{path}: not a resolved scenario ({error})") from error
        if manifest is None:
            return cls(folder, resolved, Manifest(found))
        damage = [f"{path}: not the scenario of {MANIFEST_NAME}"] if found != manifest.campaign else []
        damage += _document_damage(folder, manifest)
        if damage:
            raise StoreDamaged(damage)
        return cls(folder, resolved, manifest)

    @classmethod
    def prepare(cls, folder: Path, source: str, resolved: Mapping[str, Any], *, message: Message) -> "Store":
        """Makes the folder ready for a scenario's runs; the caller holds its lock.

        A new folder is filled, an old one checked against the scenario, extended if more runs are asked for, cleaned of
        what a killed process left, and its stray shards taken over.

        Args:
            folder: The folder, which exists.
            source: The scenario as given.
            resolved: The scenario resolved, as JSON holds it.
            message: Where to say what was found.
        """
        given: dict[str, Any] = json.loads(json.dumps(resolved))
        for kind in KINDS:
            make_folder(folder / kind)
        for place in (folder, *(folder / kind for kind in KINDS)):
            remove_leftovers(place)
        if (folder / RESOLVED_NAME).exists() or (folder / MANIFEST_NAME).exists():
            store = cls.open(folder)
            changed = changed_keys(store.resolved, given)
            if changed:
                lines = "\n".join(f"  {key}: stored {old}, given {new}" for key, old, new in changed)
                raise ScenarioChanged(
                    f"folder {folder} holds a campaign of another scenario:\n{lines}\n"
                    "Choose another folder with --out, or give the stored values; only more runs extend a campaign."
                )
        else:
            store = cls(folder, given, Manifest(identity(given)))
        store._write_documents(source, given)
        store._adopt(message)
        store._begin_session(message)
        store.manifest.write(folder)
        return store

    @property
    def shards(self) -> list[Shard]:
        """The stored shards."""
        return sorted(self.manifest.shards)

    def path(self, kind: str, shard: Shard) -> Path:
        """A shard's file of one kind."""
        return self.folder / kind / f"{shard.name}.parquet"

    def commit(
        self,
        tables: Mapping[Shard, Mapping[str, pa.Table]],
        *,
        run_steps: int = 0,
        seconds: float = 0.0,
        kernel_seconds: float = 0.0,
    ) -> None:
        """Stores shards: their files first, then the manifest, which makes them count.

        Args:
            tables: For each shard a table of each kind.
            run_steps: Time steps of all their runs.
            seconds: Time that they took [s].
            kernel_seconds: Time of it in the batch kernels, without preparation and compilation [s].
        """
        stored = {}
        for shard, of_kind in tables.items():
            files = {}
            for kind in reversed(KINDS):  # runs/ last: a file there says that the others are whole
                metadata = shard_metadata(self.manifest.campaign, shard, kind)
                data = table_bytes(of_kind[kind].replace_schema_metadata(metadata))
                sha256 = write_bytes(self.path(kind, shard), data)
                files[kind] = {"sha256": sha256, "bytes": len(data), "rows": of_kind[kind].num_rows}
            diverged = sum(status != 0 for status in of_kind["runs"]["status"].to_pylist())
            stored[shard] = {
                "runs": len(shard),
                "diverged": diverged,
                "session": len(self.manifest.sessions) - 1,
                "files": files,
            }
        self.manifest.shards.update(stored)
        session = self.manifest.sessions[-1]
        session["run_steps"] += run_steps
        session["seconds"] += seconds
        session["kernel_seconds"] += kernel_seconds
        self.manifest.write(self.folder)

    def table(self, kind: str, columns: Sequence[str] | None = None) -> pa.Table:
        """All stored rows of a kind, ordered by case and sample, every file checked against the manifest."""
        parts = []
        damage: list[str] = []
        for shard in sorted(self.manifest.shards, key=lambda shard: (shard.case, shard.start)):
            try:
                parts.append(self.shard_table(kind, shard, columns))
            except StoreDamaged as error:
                damage += error.damage
        if damage:
            raise StoreDamaged(damage)
        if not parts:
            raise FolderUnusable(f"campaign folder {self.folder} holds no finished runs yet")
        return pa.concat_tables(parts)

    def shard_table(self, kind: str, shard: Shard, columns: Sequence[str] | None = None) -> pa.Table:
        """The rows of one stored shard, checked against the manifest."""
        sha256 = self.manifest.shards[shard]["files"][kind]["sha256"]
        return read_table(self.path(kind, shard), sha256, columns).replace_schema_metadata(None)

    def damage(self) -> list[str]:
        """A line for each file that is missing or not what was written; empty for a sound store."""
        found = [f"{self.path('runs', b)}: its runs are also in {a.name}" for a, b in overlapping(self.manifest.shards)]
        for shard, entry in self.manifest.shards.items():
            for kind in KINDS:
                try:
                    read_bytes(self.path(kind, shard), entry["files"][kind]["sha256"])
                except StoreDamaged as error:
                    found += error.damage
        return found

    def note_recordings(self, recordings: Mapping[str, str]) -> None:
        """Notes the recordings of the kept runs: SHA-256 by file name."""
        self.manifest.recordings = dict(recordings)
        self.manifest.write(self.folder)

    def _write_documents(self, source: str, resolved: dict[str, Any]) -> None:
        """Writes the scenario; while one is replaced, the manifest allows the old and the new."""
        path = self.folder / SCENARIO_NAME
        if not source:  # a scenario made from tables, such as those of resolved.json when a campaign is resumed
            source = path.read_text() if path.exists() else f"# made from tables, see {RESOLVED_NAME}\n"
        texts = {SCENARIO_NAME: source.encode(), RESOLVED_NAME: json.dumps(resolved, indent=1).encode()}
        new = {name: [hash_of(data)] for name, data in texts.items()}
        if self.manifest.documents == new:
            return
        if self.manifest.documents:
            old = self.manifest.documents
            self.manifest.documents = {name: [*new[name], *old.get(name, [])] for name in new}
            self.manifest.write(self.folder)
        for name, data in texts.items():
            write_bytes(self.folder / name, data)
        self.manifest.documents = new
        self.resolved = resolved

    def _adopt(self, message: Message) -> None:
        """Drops shards whose files are gone, takes over whole ones that no manifest names, refuses damaged ones."""
        for shard in list(self.manifest.shards):
            gone = [str(path) for kind in KINDS if not (path := self.path(kind, shard)).exists()]
            if gone:
                del self.manifest.shards[shard]
                message(f"missing, its runs are redone: {', '.join(gone)}")
        damage = self.damage()
        if damage:
            raise StoreDamaged(damage)
        session = len(self.manifest.sessions) - 1
        for shard, entry in adopt(self.folder, self.manifest.campaign, self.manifest.shards, message).items():
            self.manifest.shards[shard] = {**entry, "session": session if session >= 0 else None}

    def _begin_session(self, message: Message) -> None:
        made_by = versions()
        for session in self.manifest.sessions[-1:]:
            before, now = decisive(session["versions"]), decisive(made_by)
            differing = [f"{name} {before[name]} -> {now[name]}" for name in now if before[name] != now[name]]
            if differing:
                message(f"made by other versions so far ({', '.join(differing)}): runs may differ in their last bits")
        self.manifest.sessions.append(
            {"versions": made_by, "processor": processor(), "run_steps": 0, "seconds": 0.0, "kernel_seconds": 0.0}
        )


def _document_damage(folder: Path, manifest: Manifest) -> list[str]:
    damage = []
    for name, accepted in manifest.documents.items():
        try:
            if hash_of(read_bytes(folder / name)) not in accepted:
                damage.append(f"{folder / name}: its content is not what was written (SHA-256 differs)")
        except StoreDamaged as error:
            damage += error.damage
    return damage
