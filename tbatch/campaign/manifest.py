"""The manifest of a campaign folder: which shards are stored, with their checksums, and what made them.

The manifest is what commits a shard: files that it does not name do not count. It can be lost and made again from the
shard files, which carry their campaign's identity and their own name.

It is written anew whenever shards are stored, so its text is put together from lines made once for each shard: of a
campaign of a million runs it has 15,625. Its first line is the checksum of all that follows.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tbatch.campaign.durable import hash_of, read_bytes, write_bytes
from tbatch.campaign.faults import FolderUnusable, StoreDamaged
from tbatch.campaign.shards import Shard

MANIFEST_NAME = "manifest.json"
FORMAT = 2


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
    _lines: dict[Shard, tuple[dict[str, Any], str]] = field(default_factory=dict, init=False, repr=False, compare=False)
    """The text of each entry that was written before."""

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
        shards = ",\n".join(map(self._line, sorted(self.shards)))
        body = f'{json.dumps(head)[1:-1]},\n"shards": [\n{shards}\n]}}\n'.encode()
        write_bytes(folder / name, _first_line(body) + body)

    def _line(self, shard: Shard) -> str:
        """The text of a shard's entry; an entry is replaced, never altered."""
        entry = self.shards[shard]
        known = self._lines.get(shard)
        if known is None or known[0] is not entry:
            known = self._lines[shard] = entry, json.dumps({"name": shard.name, **entry})
        return known[1]

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
            data = read_bytes(path)
            content = json.loads(data)
            first, _, body = data.partition(b"\n")
            if first + b"\n" != _first_line(body):
                if content["format"] == 1:
                    raise FolderUnusable(
                        f"{path}: written by a tbatch before its first release: read it with that, or run its scenario"
                        " in another folder"
                    )
                raise StoreDamaged(f"{path}: its content is not what was written (checksum differs)")
            if (written := content["format"]) > FORMAT:
                raise StoreDamaged(f"{path}: written by a newer tbatch (format {written}), update tbatch to read it")
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


def _first_line(body: bytes) -> bytes:
    return b'{"checksum": "%s",\n' % hash_of(body).encode()
