"""The campaign folder: the scenario as given and resolved, the manifest, and Parquet shards.

    campaign.toml   the scenario as given          resolved.json   with every default, in SI
    manifest.json   versions, shards, checksums    lock            who works here
    runs/ wheels/ events/   one Parquet file each per shard        rrd/   recordings of the kept runs
    quarantine/     what is known of diverged runs parts/          manifests of the parts of ``--shard i/n``

Reading needs no lock. Whoever writes must hold the folder's lock.
"""

import json
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa

from tbatch.campaign.adoption import shard_metadata
from tbatch.campaign.durable import hash_of, read_bytes, read_table, table_bytes, write_bytes
from tbatch.campaign.faults import FolderUnusable, StoreDamaged
from tbatch.campaign.identity import identity, run_count
from tbatch.campaign.manifest import MANIFEST_NAME, Manifest
from tbatch.campaign.part import Part, part_manifests
from tbatch.campaign.records import KINDS
from tbatch.campaign.shards import Shard, overlapping

SCENARIO_NAME = "campaign.toml"
RESOLVED_NAME = "resolved.json"
RECORDINGS = "rrd"
QUARANTINE = "quarantine"

Message = Callable[[str], None]


class Store:
    """A campaign folder. ``open`` reads one, ``prepare`` makes one ready to be written.

    ``manifest`` is what all manifests of the folder say together, ``own`` the one that this process writes: the same,
    but for a part.
    """

    def __init__(self, folder: Path, resolved: dict[str, Any], manifest: Manifest) -> None:
        """Takes what the folder's documents say; use ``open`` or ``prepare``."""
        self.folder = folder
        self.resolved = resolved
        self.manifest = manifest
        self.own = manifest
        self.own_name = MANIFEST_NAME

    @classmethod
    def open(cls, folder: Path, *, lost: Container[str] = ()) -> "Store":
        """Reads a campaign folder. FolderUnusable if it is none, StoreDamaged if its documents do not fit together.

        Args:
            folder: The folder.
            lost: Names of documents that may be missing: they are about to be written again.
        """
        folder = Path(folder)
        manifest = read_manifests(folder)
        path = folder / RESOLVED_NAME
        if manifest is None and not path.exists():
            raise FolderUnusable(f"{folder} is not a campaign folder: it has no {RESOLVED_NAME}")
        data = read_bytes(path)
        try:
            resolved = json.loads(data)
            found = identity(resolved)
            _read_through(resolved)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise StoreDamaged(f"{path}: not a resolved scenario ({error})") from error
        if manifest is None:
            return cls(folder, resolved, Manifest(found))
        damage = [f"{path}: not the scenario of {MANIFEST_NAME}"] if found != manifest.campaign else []
        damage += _document_damage(folder, manifest, lost)
        if damage:
            raise StoreDamaged(damage)
        return cls(folder, resolved, manifest)

    @classmethod
    def prepare(
        cls,
        folder: Path,
        source: str,
        resolved: Mapping[str, Any],
        *,
        message: Message,
        part: Part | None = None,
    ) -> "Store":
        """Makes the folder ready for a scenario's runs; the caller holds its lock, or that of its part.

        A new folder is filled, an old one checked against the scenario, extended if more runs are asked for, cleaned of
        what a killed process left, and its stray shards taken over.

        Args:
            folder: The folder, which exists.
            source: The scenario as given.
            resolved: The scenario resolved, as JSON holds it.
            message: Where to say what was found.
            part: The part that is to be written; default: the whole.
        """
        from tbatch.campaign.preparation import prepare

        return prepare(folder, source, resolved, message=message, part=part)

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
        campaign = self.manifest.campaign
        entries = {shard: write_shard(self.folder, campaign, shard, of_kind) for shard, of_kind in tables.items()}
        self.note(entries, run_steps=run_steps, seconds=seconds, kernel_seconds=kernel_seconds)

    def note(
        self,
        entries: Mapping[Shard, Mapping[str, Any]],
        *,
        session: int | None = None,
        run_steps: int = 0,
        seconds: float = 0.0,
        kernel_seconds: float = 0.0,
    ) -> None:
        """Makes shards count whose files are written: by this process, or by a worker that answers to it.

        Args:
            entries: What ``write_shard`` gave for each.
            session: Number of the session that made them; default: the last, this process's.
            run_steps: Time steps of all their runs.
            seconds: Time that they took [s].
            kernel_seconds: Time of it in the batch kernels, without preparation and compilation [s].
        """
        number = len(self.own.sessions) - 1 if session is None else session
        new = {shard: {**entry, "session": number} for shard, entry in entries.items()}
        self.own.shards.update(new)
        made_by = self.own.sessions[number]
        made_by["run_steps"] += run_steps
        made_by["seconds"] += seconds
        made_by["kernel_seconds"] += kernel_seconds
        self.save(new)

    def save(self, new: Mapping[Shard, Mapping[str, Any]] | None = None) -> None:
        """Writes the manifest of this process.

        Args:
            new: Entries of shards that came since it was last written; default: any may be new.
        """
        if self.own is not self.manifest:
            self.manifest.join(self.own, new)
        self.own.write(self.folder, self.own_name)

    def table(self, kind: str, columns: Sequence[str] | None = None, case: int | None = None) -> pa.Table:
        """All stored rows of a kind, ordered by case and sample, every file checked against the manifest.

        Args:
            kind: Of the table.
            columns: Names of those to read; default: all.
            case: Rows of one speed alone; default: of all.
        """
        parts = []
        damage: list[str] = []
        every = sorted(self.manifest.shards, key=lambda shard: (shard.case, shard.start))
        chosen = [shard for shard in every if case in (None, shard.case)]
        for shard in chosen or every[:1]:
            try:
                parts.append(self.shard_table(kind, shard, columns))
            except StoreDamaged as error:
                damage += error.damage
        if damage:
            raise StoreDamaged(damage)
        if not parts:
            raise FolderUnusable(f"campaign folder {self.folder} holds no finished runs yet")
        return pa.concat_tables(parts if chosen else [parts[0].slice(0, 0)])

    def shard_table(self, kind: str, shard: Shard, columns: Sequence[str] | None = None) -> pa.Table:
        """The rows of one stored shard, checked against the manifest."""
        sha256 = self.manifest.shards[shard]["files"][kind]["sha256"]
        return read_table(self.path(kind, shard), sha256, columns).replace_schema_metadata(None)

    def damage(self, looked_at: Callable[[Shard], bool] = lambda shard: True) -> list[str]:
        """A line for each shard file that is missing or not what was written; empty for a sound store.

        Args:
            looked_at: Which shards to read; default: all.
        """
        found = [f"{self.path('runs', b)}: its runs are also in {a.name}" for a, b in overlapping(self.manifest.shards)]
        for shard, entry in self.manifest.shards.items():
            if not looked_at(shard):
                continue
            for kind in KINDS:
                try:
                    read_bytes(self.path(kind, shard), entry["files"][kind]["sha256"])
                except StoreDamaged as error:
                    found += error.damage
        return found

    def note_recordings(self, recordings: Mapping[str, str]) -> None:
        """Notes the recordings of the kept runs: SHA-256 by file name."""
        self.own.recordings = dict(recordings)
        self.save()

    def note_quarantine(self, files: Mapping[str, str]) -> None:
        """Notes files about diverged runs: SHA-256 by file name."""
        self.own.quarantine.update(files)
        self.save()


def read_manifests(folder: Path) -> Manifest | None:
    """What the manifests of a campaign folder say, its parts' included; None where there is none."""
    # The parts first: a process that joins them writes what they say before it removes them.
    of_parts = [(path, Manifest.read(folder, f"{path.parent.name}/{path.name}")) for path in part_manifests(folder)]
    manifest = Manifest.read(folder)
    for path, of_part in of_parts:
        if of_part is None:
            continue
        manifest = manifest or Manifest(of_part.campaign)
        if of_part.campaign != manifest.campaign:
            raise StoreDamaged(f"{path}: the manifest of another campaign")
        manifest.join(of_part)
    return manifest


def write_shard(folder: Path, campaign: str, shard: Shard, tables: Mapping[str, pa.Table]) -> dict[str, Any]:
    """Writes a shard's files and gives its entry in the manifest, which alone makes it count.

    Args:
        folder: The campaign folder.
        campaign: Identity of the campaign.
        shard: The shard.
        tables: A table of each kind.
    """
    files = {}
    for kind in reversed(KINDS):  # runs/ last: a file there says that the others are whole
        data = table_bytes(tables[kind].replace_schema_metadata(shard_metadata(campaign, shard, kind)))
        sha256 = write_bytes(folder / kind / f"{shard.name}.parquet", data)
        files[kind] = {"sha256": sha256, "bytes": len(data), "rows": tables[kind].num_rows}
    diverged = sum(status != 0 for status in tables["runs"]["status"].to_pylist())
    return {"runs": len(shard), "diverged": diverged, "files": files}


def _read_through(resolved: Mapping[str, Any]) -> None:
    """Reads what every reader needs of a resolved scenario: without a manifest nothing else vouches for it."""
    run_count(resolved)
    for table, key in (("campaign", "name"), ("campaign", "seed"), ("contact", "law"), ("vehicle", "rails")):
        resolved[table][key]
    for number in (resolved["integration"]["step"], *resolved["speed"]["values"]):
        float(number)


def _document_damage(folder: Path, manifest: Manifest, lost: Container[str]) -> list[str]:
    damage = []
    for name, accepted in manifest.documents.items():
        if name in lost:
            continue
        try:
            if hash_of(read_bytes(folder / name)) not in accepted:
                damage.append(f"{folder / name}: its content is not what was written (SHA-256 differs)")
        except StoreDamaged as error:
            damage += error.damage
    return damage
