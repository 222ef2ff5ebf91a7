"""Where tbatch keeps what it need not make twice: compiled kernels, parsed unit definitions."""

import os
import tempfile
from pathlib import Path


def cache_folder(name: str) -> Path | None:
    """A folder of the user's cache that can be written, or None if there is none.

    `TBATCH_CACHE` moves it; else it is in `XDG_CACHE_HOME` or `~/.cache`.

    Args:
        name: What is kept there, with its version.
    """
    root = os.environ.get("TBATCH_CACHE") or os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folder = Path(root) / "tbatch" / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        return None
    return folder
