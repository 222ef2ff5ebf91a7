"""The manifest of a campaign folder: which shards are stored, with their checksums, and what made them.

The manifest is what commits a shard: files that it does not name do not count. It can be lost and made again from the
shard files, which carry their campaign's identity and their own name.

It is JSON; the first line is the checksum of all that follows, the entries of the shards are the last.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tbatch.campaign.durable import hash_of, read_bytes, write_bytes
from tbatch.campaign.entries import Entries
from tbatch.campaign.faults import FolderUnusable, StoreDamaged
from tbatch.campaign.shards import Shard

MANIFEST_NAME = "manifest.json"
FORMAT = 2
_SHARDS, _END = ',\n"shards": [\n', "\n]}\n"


@dataclass
class Manifest:
    """What a folder's manifest says."""

    campaign: str
    """Identity of the campaign: SHA-256 of its resolved scenario without the number of runs."""
    documents: dict[str, list[str]] = field(default_factory=dict)
    """SHA-256 of each document of the folder; two while one is being replaced."""
    sessions: list[dict[str, Any]] = field(default_factory=list)
    """Each process that worked in the folder: versions, processor, run-steps done and seconds taken."""
    shards: Entries = field(default_factory=Entries)
    """Rows and status counts of each stored shard, and for each of its files the SHA-256 and the size."""
    recordings: dict[str, str] = field(default_factory=dict)
    """SHA-256 of the recording of each kept run, by file name."""
    quarantine: dict[str, str] = field(default_factory=dict)
    """SHA-256 of each file about a diverged run, by file name."""

    def write(self, folder: Path, name: str = MANIFEST_NAME) -> None:
        """Writes it durably into the folder."""
        head = {
            "format": FORMAT,
            "campaign": self.campaign,
            "documents": self.documents,
            "sessions": self.sessions,
            "recordings": self.recordings,
            "quarantine": self.quarantine,
        }
        body = f"{json.dumps(head)[1:-1]}{_SHARDS}{self.shards.text()}{_END}".encode()
        write_bytes(folder / name, _first_line(body) + body)

    def join(self, other: "Manifest", shards: Mapping[Shard, Mapping[str, Any]] | None = None) -> None:
        """Takes over what another manifest of the same campaign says; of a shard that both name, the other's word.

        Args:
            other: A part's manifest, or that of another folder.
            shards: The entries of it that are new here; default: all.
        """
        for name, accepted in other.documents.items():
            known = self.documents.setdefault(name, [])
            known += [sha256 for sha256 in accepted if sha256 not in known]
        place = self.join_sessions(other)
        for shard, entry in (other.shards if shards is None else shards).items():
            self.shards[shard] = {**entry, "session": place.get(entry.get("session"))}
        self.recordings |= other.recordings
        self.quarantine |= other.quarantine

    def join_sessions(self, other: "Manifest") -> dict[Any, int]:
        """Takes over another manifest's sessions; gives for the number of each its number here."""
        place: dict[Any, int] = {}
        for number, session in enumerate(other.sessions):
            same = [here for here, known in enumerate(self.sessions) if known.get("id", id(known)) == session.get("id")]
            if same:
                self.sessions[same[0]] = session
            else:
                self.sessions.append(session)
            place[number] = same[0] if same else len(self.sessions) - 1
        return place

    @classmethod
    def read(cls, folder: Path, name: str = MANIFEST_NAME) -> "Manifest | None":
        """Reads the folder's manifest; None where there is none, StoreDamaged where it is not what was written."""
        path = folder / name
        if not path.exists():
            return None
        try:
            data = read_bytes(path)
            first, _, body = data.partition(b"\n")
            if first + b"\n" != _first_line(body):
                if json.loads(data)["format"] == 1:
                    raise FolderUnusable(
                        f"{path}: written by a tbatch before its first release: read it with that, or run its scenario"
                        " in another folder"
                    )
                raise StoreDamaged(f"{path}: its content is not what was written (checksum differs)")
            head, _, entries = body.decode().removesuffix(_END).partition(_SHARDS)
            content = json.loads(f"{{{head}}}")
            if (written := content["format"]) > FORMAT:
                raise StoreDamaged(f"{path}: written by a newer tbatch (format {written}), update tbatch to read it")
            shards = Entries.parse(entries)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise StoreDamaged(f"{path}: not a manifest ({error})") from error
        return cls(
            content["campaign"],
            content["documents"],
            content["sessions"],
            shards,
            content["recordings"],
            content.get("quarantine", {}),
        )


def _first_line(body: bytes) -> bytes:
    return b'{"checksum": "%s",\n' % hash_of(body).encode()
