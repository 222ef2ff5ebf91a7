"""Recordings for the rerun viewer: one .rrd file for each kept run, its dashboard inside.

This package is the only place that imports rerun, and it does so when a recording is written: the import takes
two seconds and 90 MB, which a campaign without kept runs should not pay.
"""

from __future__ import annotations

from pathlib import Path

from tbatch.view.envelope import Envelope
from tbatch.view.overlay import Overlay
from tbatch.view.record import RunRecord

__all__ = ["RecordingUnavailable", "check_loadable", "write_envelope", "write_overlay", "write_recording"]


class RecordingUnavailable(ValueError):
    """Recordings cannot be written here; the text says in one line why."""


def check_loadable() -> None:
    """Load what writes recordings.

    Raises:
        RecordingUnavailable: If it cannot be loaded.
    """
    try:
        import rerun  # noqa: F401
    except ImportError as error:
        raise RecordingUnavailable(
            f"rerun cannot be loaded ({error}); install it with: pip install rerun-sdk"
        ) from error


def write_recording(record: RunRecord, path: str | Path) -> Path:
    """Write one run as an .rrd file with its dashboard, in one go: the file is whole or not there.

    Needs neither a display nor a network. Writing a record twice gives the same data (`rerun rrd compare`).

    Args:
        record: The run.
        path: Where to write; folders are made, a file of that name is replaced.

    Returns:
        The path written.
    """
    check_loadable()
    from tbatch.view.timeline.recording import write

    return write(record, Path(path))


def write_envelope(envelope: Envelope, path: str | Path) -> Path:
    """Write the spread of one speed's forces as an .rrd file, in one go: the file is whole or not there.

    Args:
        envelope: The envelope.
        path: Where to write; folders are made, a file of that name is replaced.

    Returns:
        The path written.
    """
    check_loadable()
    from tbatch.view.timeline.envelope import write

    return write(envelope, Path(path))


def write_overlay(overlay: Overlay, path: str | Path) -> Path:
    """Write responses on the same axes as one .rrd file; otherwise as ``write_recording``."""
    check_loadable()
    from tbatch.view.timeline.overlay_recording import write

    return write(overlay, Path(path))
