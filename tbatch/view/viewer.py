"""Opening recordings in the rerun viewer, or saying what to do where it cannot run."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

STARTED = 3.0  # a viewer that lives this long has found its display and its graphics device [s]


class ViewerUnavailable(ValueError):
    """The viewer was asked for where it cannot be shown; the text says in one line what to do instead."""


def recordings(path: str | Path, *, run: str | None = None) -> list[Path]:
    """Find the recordings to view: one file, or all of a folder, or those of one run.

    Args:
        path: An .rrd file or a campaign folder.
        run: A run's printed id, "c03-s000127".

    Returns:
        Files in the order of their names, at least one.
    """
    path = Path(path)
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder; expected a campaign folder or an .rrd file")
    if path.is_file() and path.suffix != ".rrd":
        raise ValueError(f"{path}: not an .rrd file; expected a campaign folder or an .rrd file")
    found = [path] if path.is_file() else sorted(path.rglob("*.rrd"))
    found = [file for file in found if not file.name.startswith(".")]
    if run is not None:
        kept = ", ".join(file.stem for file in found[:8]) + (", ..." if len(found) > 8 else "")
        found = [file for file in found if file.stem == run]
        if not found:
            raise ValueError(
                f"run {run} has no recording in {path} (kept: {kept or 'none'}); "
                f"`tbatch replay {path} --run {run} --rrd {run}.rrd` writes one"
            )
    if not found:
        raise ValueError(
            f'{path}: no recordings; keep some with [keep] timelines = "worst:3", '
            f"or write one with `tbatch replay {path} --run ID --rrd FILE`"
        )
    return found


def open_viewer(files: Sequence[str | Path], *, started: float = STARTED) -> None:
    """Open recordings in a viewer of its own, which stays open when this process ends.

    Args:
        files: The .rrd files.
        started: How long to watch for a failing start [s].

    Raises:
        ViewerUnavailable: No display, no graphics device or no viewer here.
    """
    paths = [Path(file).absolute() for file in files]
    _start([*map(str, paths)], _instead(paths), started)


def connect_viewer(url: str, *, memory: str, started: float = STARTED) -> int:
    """Open a viewer on what a server passes on, which stays open when that ends.

    Args:
        url: The server's address.
        memory: Most that the viewer keeps, "1GiB"; the oldest goes first.
        started: How long to watch for a failing start [s].

    Returns:
        The viewer's process number.

    Raises:
        ViewerUnavailable: No display, no graphics device or no viewer here.
    """
    return _start(["--memory-limit", memory, "--connect", url], f"run `rerun --connect {url}` elsewhere", started)


def open_catalogue(name: str, runs: Sequence[Path], envelopes: Sequence[Path] = ()) -> None:
    """Open the table of a campaign's recordings in a viewer of its own, which stays open when this process ends.

    Args:
        name: The campaign's name.
        runs: Recordings of runs, that with the most separations first.
        envelopes: Recordings of envelopes.

    Raises:
        ViewerUnavailable: No display, no graphics device or no viewer here.
    """
    files, more = ([str(file.absolute()) for file in some] for some in (runs, envelopes))
    instead = _instead([Path(file) for file in [*files, *more]])
    binary = viewer_here(instead)
    command = [sys.executable, "-m", "tbatch.view.timeline.catalogue", str(binary), name, *files, "--", *more]
    with tempfile.TemporaryFile() as log:
        child = _launch(command, instead, log, stdout=subprocess.PIPE)
        assert child.stdout is not None
        with child.stdout as said:
            opened = said.readline().strip() == b"open"  # or nothing, at its end
        if not opened:
            raise _not_started(child.wait(), log, instead)


def viewer_here(instead: str) -> Path:
    """Find the viewer's native program where it can be shown.

    Args:
        instead: What to do otherwise.

    Raises:
        ViewerUnavailable: No display or no viewer here.
    """
    if not has_display(os.environ, sys.platform):
        raise ViewerUnavailable(f"no display here: {instead}")
    binary = find_binary()
    if binary is None:
        raise ViewerUnavailable(f"the rerun viewer is not installed here (pip install rerun-sdk): {instead}")
    return binary


def _start(arguments: Sequence[str], instead: str, started: float) -> int:
    binary = viewer_here(instead)
    # The native program, not the `rerun` script, which would have to stay as its parent (rerun 0.41); and on the
    # loopback alone, since a viewer listens to the whole network by default.
    command = [str(binary), "--bind", "127.0.0.1", *arguments]
    with tempfile.TemporaryFile() as log:
        child = _launch(command, instead, log, stdout=log)
        code = _watch(child, started)
        if code:
            raise _not_started(code, log, instead)
    return child.pid


def _launch(command: Sequence[str], instead: str, log: IO[bytes], *, stdout: Any) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=stdout, stderr=log, start_new_session=True)
    except OSError as error:
        raise ViewerUnavailable(f"the rerun viewer does not start ({error}): {instead}") from error


def _not_started(code: int, log: IO[bytes], instead: str) -> ViewerUnavailable:
    log.seek(0)
    reason = _reason(log.read().decode(errors="replace")) or f"exit code {code}"
    return ViewerUnavailable(f"the rerun viewer does not start ({reason}): {instead}")


def has_display(environment: Mapping[str, str], platform: str) -> bool:
    """Whether windows can be opened: on Linux an X or Wayland display must be named."""
    if platform in ("win32", "darwin"):
        return True
    return bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def find_binary() -> Path | None:
    """Find the viewer's native program beside its Python package, without importing rerun."""
    package = importlib.util.find_spec("rerun_cli")
    if package is None or package.origin is None:
        return None
    folder = Path(package.origin).parent
    names = {"win32": ["rerun.exe"], "darwin": ["Rerun.app/Contents/MacOS/Rerun", "rerun"]}
    return next((folder / name for name in names.get(sys.platform, ["rerun"]) if (folder / name).exists()), None)


def _watch(child: subprocess.Popen[bytes], seconds: float) -> int | None:
    """Wait a moment for an early end; None while the viewer runs."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        code = child.poll()
        if code is not None:
            return code
        time.sleep(0.05)
    return None


def _reason(output: str) -> str:
    """Pick what a failed start says about its reason."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in output.splitlines()]
    for line in lines:
        if line.startswith("Error:"):
            return line.rsplit(": ", 1)[-1]
        if " panicked at " in line:
            return line.split(" panicked at ", 1)[1].strip("'")
    return next((line[:200] for line in reversed(lines) if line), "")


def _instead(files: Sequence[Path]) -> str:
    """Say how to look at the files from elsewhere."""
    what = " ".join(map(str, files)) if len(files) < 3 else f"{files[0].parent}{os.sep}*.rrd"
    return (
        f"copy {what} to a machine with a display and run `rerun` on it, or run here `rerun --serve-web --bind "
        f"127.0.0.1 {what}`, forward ports 9090 and 9876 (ssh -L) and open the address it prints"
    )
