"""The file of a recording: whole or not there, and the same when it is written twice."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr

APPLICATION = "tbatch"


@contextmanager
def recording_file(
    path: Path, identity: str, *, name: str, application: str = APPLICATION
) -> Iterator[rr.RecordingStream]:
    """A stream into a temporary name, moved into place once all is written; nothing is left of a failure.

    Args:
        path: Where to write; folders are made, a file of that name is replaced.
        identity: Fixed id of the recording: a run written twice is the same recording.
        name: Its name in the viewer.
        application: Recordings of one application share a layout in the viewer (rerun 0.41).
    """
    if path.is_dir():  # else it would be moved into it
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = _partial(path)
    try:
        with _heeded(), rr.RecordingStream(application, recording_id=identity, send_properties=False) as stream:
            stream.save(partial)
            stream.set_log_time_enabled(False)  # no start time either, for the same reason
            stream.send_recording_name(name)
            yield stream
        shutil.move(partial, path)
    finally:
        partial.unlink(missing_ok=True)
        if partial.parent != path.parent:
            partial.parent.rmdir()


def _partial(path: Path) -> Path:
    """Where to write until all is written: beside the file, or elsewhere where its name is no UTF-8.

    The recording library (rerun 0.41) takes UTF-8 alone; in the locale "C" any other letter of a path is a surrogate.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return Path(tempfile.mkdtemp(prefix="tbatch-")) / "run.rrd"
    return path.with_name(f".{path.name}.partial")


@contextmanager
def _heeded() -> Iterator[None]:
    """Writes the file that was asked for even where RERUN=off silences what a program shows while it runs."""
    silenced = os.environ.pop("RERUN", None)
    try:
        yield
    finally:
        if silenced is not None:
            os.environ["RERUN"] = silenced
