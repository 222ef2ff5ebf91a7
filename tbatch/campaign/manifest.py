"""The manifest of a campaign folder: which shards are stored, with their checksums, and what made them.

The manifest is what commits a shard: files that it does not name do not count. It can be lost and made again from the
shard files, which carry their campaign's identity and their own name.
"""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tbatch.campaign.durable import read_bytes, write_bytes
from tbatch.campaign.faults import StoreDamaged
from tbatch.campaign.identity import canonical
from tbatch.campaign.shards import Shard

MANIFEST_NAME = "manifest.json"
FORMAT = 1


@dataclass
class Manifest:
    """What a folder's manifest says."""

    campaign: str
    """Identity of the campaign: SHA-256 of its resolved scenario without the number of runs."""
    documents: dict[str, list[str]] = field(default_factory=dict)
    """SHA-256 of each document of the folder; two while one is being replaced."""
    sessions: list[dict[str, Any]] = field(default_factory=list)
    """Each process that worked in the folder: versions, processor, run-steps done and seconds taken."""
    shards: dict[Shard, dict[str, Any]] = field(default_factory=dict)
    """Rows and status counts of each stored shard, and for each of its files the SHA-256 and the size."""
    recordings: dict[str, str] = field(default_factory=dict)
    """SHA-256 of the recording of each kept run, by file name."""
    quarantine: dict[str, str] = field(default_factory=dict)
    """SHA-256 of each file about a diverged run, by file name."""

    def write(self, folder: Path, name: str = MANIFEST_NAME) -> None:
        """Writes it durably into the folder."""
        content = {
            "format": FORMAT,
            "campaign": self.campaign,
            "documents": self.documents,
            "sessions": self.sessions,
            "shards": [{"name": shard.name, **self.shards[shard]} for shard in sorted(self.shards)],
            "recordings": self.recordings,
            "quarantine": self.quarantine,
        }
        text = json.dumps({**content, "checksum": _checksum(content)}, indent=1)
        write_bytes(folder / name, text.encode())

    def join(self, other: "Manifest") -> None:
        """Takes over what another manifest of the same campaign says; of a shard that both name, the other's word.

        Args:
            other: A part's manifest, or that of another folder.
        """
        for name, accepted in other.documents.items():
            known = self.documents.setdefault(name, [])
            known += [sha256 for sha256 in accepted if sha256 not in known]
        place = self.join_sessions(other)
        for shard, entry in other.shards.items():
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
            content = json.loads(read_bytes(path))
            checksum = content.pop("checksum")
            if content["format"] > FORMAT:
                raise StoreDamaged(
                    f"{path}: written by a newer tbatch (format {content['format']}), update tbatch to read it"
                )
            if checksum != _checksum(content):
                raise StoreDamaged(f"{path}: its content is not what was written (checksum differs)")
            shards = {Shard.parse(entry.pop("name")): entry for entry in content["shards"]}
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


def _checksum(content: dict[str, Any]) -> str:
    return hashlib.sha256(canonical(content).encode()).hexdigest()
