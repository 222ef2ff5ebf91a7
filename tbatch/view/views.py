"""Recordings that are made when somebody looks: envelopes, and runs that were not kept.

They stand in ``views/`` of the campaign folder with an index of what each was made from and its SHA-256. All of them
can be made again and none belongs to the result: a folder that cannot be written to has them in a temporary one.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbatch import __version__
from tbatch.campaign.durable import hash_of, write_bytes
from tbatch.campaign.store import RECORDINGS
from tbatch.view.envelope import envelope_name, envelope_runs, make_envelope
from tbatch.view.kept import record_of, replay_with_histories
from tbatch.view.timeline import write_envelope, write_recording

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

VIEWS = "views"
INDEX = "index.json"

Say = Callable[[str], None]


class Views:
    """The recordings of a campaign: those of its kept runs, and those made to be looked at."""

    def __init__(self, campaign: Campaign, say: Say) -> None:
        """Takes the campaign; nothing is made yet.

        Args:
            campaign: The campaign.
            say: Where to tell what is being made.
        """
        self._campaign, self._say = campaign, say

    @cached_property
    def folder(self) -> Path:
        """Where they are written; it is there when something is."""
        folder = self._campaign.folder / VIEWS
        writable = os.access(folder if folder.exists() else self._campaign.folder, os.W_OK)
        return folder if writable else Path(tempfile.mkdtemp(prefix="tbatch-views-"))

    def kept(self) -> list[Path]:
        """The recordings of kept runs that are there, and of runs looked at before."""
        folder = self._campaign.folder / RECORDINGS
        noted = [folder / name for name in sorted(self._campaign.store.manifest.recordings)]
        made = [self.folder / name for name, note in sorted(self._index.items()) if note.get("run")]
        names = {path.name for path in noted}
        return [path for path in [*noted, *(path for path in made if path.name not in names)] if path.exists()]

    def run(self, name: str) -> Path:
        """The recording of a run; one that was not kept is simulated again, and compared with what is stored."""
        self._campaign.pair(name)  # a ValueError that says which runs there are
        kept = self._campaign.folder / RECORDINGS / f"{name}.rrd"
        if kept.name in self._campaign.store.manifest.recordings and kept.exists():
            return kept
        made_from = {"run": name, "campaign": self._campaign.store.manifest.campaign}
        path = self.folder / f"{name}.rrd"
        if self._is_there(path, made_from):
            return path
        self._say(f"{name} was not kept: it is simulated again")
        result = replay_with_histories(self._campaign, [name])
        if not self._campaign.is_stored(name):
            self._say(f"{name} is not stored in the folder yet, so not compared")
        elif differing := self._campaign.differs_from_stored(name, result):
            self._say(f"{name} is NOT the stored run, other versions or processor? differing: {', '.join(differing)}")
        else:
            self._say(f"{name} is bit for bit the stored run")
        write_recording(record_of(self._campaign, name, result), path)
        self._note(path, made_from)
        return path

    def envelopes(self) -> list[Path]:
        """An envelope for each speed that has stored runs; those that are not there are made, in some seconds each."""
        paths = []
        for case in range(len(self._campaign.speeds)):
            samples = envelope_runs(self._campaign, case)
            if not samples:
                continue
            made_from = {"envelope": case, "samples": samples, "campaign": self._campaign.store.manifest.campaign}
            path = self.folder / f"{envelope_name(case)}.rrd"
            if not self._is_there(path, made_from):
                runs = f"{len(samples)} run{'s' if len(samples) > 1 else ''}"
                self._say(f"envelope at {self._campaign.speeds[case] * 3.6:.4g} km/h, from {runs} simulated again")
                write_envelope(make_envelope(self._campaign, case, samples), path)
                self._note(path, made_from)
            paths.append(path)
        return paths

    @property
    def _index(self) -> dict[str, dict[str, Any]]:
        try:
            index = json.loads((self.folder / INDEX).read_bytes())
        except (OSError, ValueError):
            return {}
        return index if isinstance(index, dict) else {}

    def _is_there(self, path: Path, made_from: dict[str, Any]) -> bool:
        note = self._index.get(path.name)
        if note is None or not path.exists() or {**note, "sha256": ""} != self._noted(made_from):
            return False
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest() == note["sha256"]

    def _note(self, path: Path, made_from: dict[str, Any]) -> None:
        note = {**self._noted(made_from), "sha256": hash_of(path.read_bytes())}
        write_bytes(self.folder / INDEX, json.dumps({**self._index, path.name: note}, indent=1).encode())

    def _noted(self, made_from: dict[str, Any]) -> dict[str, Any]:
        # The samples of an envelope can be many thousand characters; what matters is whether they are the same.
        short = {
            key: hash_of(json.dumps(value).encode()) if key == "samples" else value for key, value in made_from.items()
        }
        return {**short, "version": __version__, "sha256": ""}
