"""A measured running surface: the table that names its file, and the file's points."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.level import read_level
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Flag, Quantity, Text, Word
from tbatch.scenario.section import Section

_UNITS = ("m", "cm", "mm", "um")
_LARGEST_FILE = 64 * 2**20
_HIGHEST_LEVEL = 0.5


class Measured(Section):
    """A measured level, from a text file of two columns: chainage [m] and level."""

    file: Annotated[str, Text("a path, relative to the scenario file's folder", lambda path: 0 < len(path) <= 4096)]
    """The file."""
    unit: Annotated[str, Word(_UNITS)] = "mm"
    """Unit of the level."""
    up: Annotated[bool, Flag()] = False
    """Whether the file counts the level positive upwards."""
    window: Annotated[Any, Quantity("m", -1e7, 1e7, words=("random",))] = "random"
    """Chainage that lies at run.start [m], or a stretch drawn at random for each sample."""
    sha256: Annotated[
        str | None, Text("the SHA-256 of the file's bytes", lambda text: re.fullmatch("[0-9a-f]{64}", text) is not None)
    ] = None
    """Checksum that the file must have; filled in when the scenario is resolved."""


@dataclass(frozen=True, eq=False)
class MeasuredLevel:
    """A measured file as read."""

    x: NDArray[np.float64]
    """chainage [m], shape (point,)"""
    r: NDArray[np.float64]
    """level, positive where the rail is lower [m], shape (point,)"""


def read_measured(measured: Measured, folder: Path, findings: Findings) -> tuple[Measured, MeasuredLevel | None]:
    """Read a measured file.

    Args:
        measured: The table that names it.
        folder: Folder that a relative path starts from.
        findings: Takes what is wrong with the file.

    Returns:
        The table with the file's full path and checksum, and its points; None where it cannot be used.
    """
    key = ("irregularity", "measured", "file")
    accepted = "a text file of two columns, chainage [m] and level, of at most 64 MiB"

    def refuse(message: str) -> tuple[Measured, None]:
        findings.refuse(key, message, value=measured.file, accepted=accepted)
        return measured, None

    try:
        path = (folder / Path(measured.file).expanduser()).resolve()
        if not path.is_file():
            return refuse("is not a file" if path.exists() else f"does not exist in {folder}")
        if path.stat().st_size > _LARGEST_FILE:
            return refuse("is too large")
        content = path.read_bytes()
        x, r = read_level(path, unit=measured.unit, up=measured.up)
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: no home for "~"
        return refuse(f"cannot be read: {error}")
    highest = float(np.abs(r).max())
    if highest > _HIGHEST_LEVEL:
        path_of_unit = ("irregularity", "measured", "unit")
        message = f"makes the level up to {highest:g} m"
        findings.refuse(
            path_of_unit, message, value=measured.unit, accepted=f"a unit that keeps it below {_HIGHEST_LEVEL} m"
        )
        return measured, None
    sha256 = hashlib.sha256(content).hexdigest()
    if measured.sha256 not in (None, sha256):
        return refuse("has changed: its checksum is no longer that of irregularity.measured.sha256")
    return measured.model_copy(update={"file": str(path), "sha256": sha256}), MeasuredLevel(x, r)
