"""The recordings of a campaign's kept runs: which are there, which are to be written, which are no longer wanted.

What writes one is passed in: a campaign knows neither the viewer nor its files.
"""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from tbatch.campaign.durable import make_folder
from tbatch.campaign.progress import Progress, Report
from tbatch.campaign.store import RECORDINGS

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

RECORDED_TOGETHER = 8  # runs with full histories in memory at a time


class Recorder(Protocol):
    """Writes recordings: simulates the named runs again with histories and puts ``<name>.rrd`` into ``folder``."""

    def __call__(self, campaign: "Campaign", names: Sequence[str], folder: Path) -> None:
        """Writes one recording for each name."""
        ...


def write_missing_recordings(campaign: "Campaign", recorder: Recorder, report: Report) -> None:
    """Writes the recordings of the kept runs that are not there yet, and removes those of runs no longer kept."""
    folder = campaign.folder / RECORDINGS
    noted = campaign.store.manifest.recordings
    kept = campaign.kept()
    for name in set(noted) - {f"{name}.rrd" for name in kept}:
        (folder / name).unlink(missing_ok=True)
    todo = [name for name in kept if f"{name}.rrd" not in noted or not (folder / f"{name}.rrd").exists()]
    if todo:
        make_folder(folder)
    for first in range(0, len(todo), RECORDED_TOGETHER):
        report(Progress("recording", first, len(todo), 0, 0, 0))
        recorder(campaign, todo[first : first + RECORDED_TOGETHER], folder)
    paths = {f"{name}.rrd": folder / f"{name}.rrd" for name in kept}
    present = {name: path for name, path in paths.items() if path.exists()}
    if todo or present.keys() != noted.keys():
        campaign.store.note_recordings({name: _digest(path) for name, path in present.items()})
    if todo:
        written = sum(f"{name}.rrd" in present for name in todo)  # none where they cannot be written
        report(Progress("recording", written, len(todo), 0, 0, 0))


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
