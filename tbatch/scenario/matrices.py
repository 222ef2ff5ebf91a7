"""The matrices of an imported track: the table that names their files, and the track they make."""

import hashlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Quantity, Text, Word
from tbatch.scenario.section import BENDING_STIFFNESS, Section

if TYPE_CHECKING:
    from tbatch.physics.track import Track

FILES = ("mass", "damping", "stiffness", "nodes", "mapping")
"""The keys that name a file."""

_PATH = Text("a path, relative to the scenario file's folder", lambda path: 0 < len(path) <= 4096)
_CHECKSUM = Text(
    "the SHA-256 of the file's bytes, then #NAME where a matrix is named",
    lambda text: re.fullmatch("[0-9a-f]{64}(#.+)?", text) is not None,
)
_ACCEPTED = {
    "nodes": "a node map: a CSV file with a heading line, see docs/exporting_matrices.md",
    "mapping": "the mapping file of ANSYS: equation, node, dof",
}
_MATRIX = "a matrix file of Matrix Market, SciPy, Abaqus, ANSYS or Nastran, see docs/exporting_matrices.md"


class Checksums(Section):
    """What the files must be."""

    mass: Annotated[str | None, _CHECKSUM] = None
    """Checksum of the mass."""
    damping: Annotated[str | None, _CHECKSUM] = None
    """Checksum of the damping."""
    stiffness: Annotated[str | None, _CHECKSUM] = None
    """Checksum of the stiffness."""
    nodes: Annotated[str | None, _CHECKSUM] = None
    """Checksum of the node map."""
    mapping: Annotated[str | None, _CHECKSUM] = None
    """Checksum of the mapping."""


class Matrices(Section):
    """Files of M, C and K, and of the rail's place in them; FILE#NAME picks a matrix of a Nastran file."""

    mass: Annotated[str, _PATH]
    """The mass matrix."""
    damping: Annotated[str | None, _PATH] = None
    """The damping matrix; none by default, beside track.rayleigh."""
    stiffness: Annotated[str, _PATH]
    """The stiffness matrix."""
    nodes: Annotated[str, _PATH]
    """The node map: the rail's nodes, their x, their dofs."""
    mapping: Annotated[str | None, _PATH] = None
    """ANSYS mapping file, so that the node map of a Harwell-Boeing matrix can name nodes and dofs."""
    units: Annotated[str, Word(("m-kg-s", "mm-t-s"))] = "m-kg-s"
    """Units of the matrices: newtons and metres, or newtons, millimetres and tonnes."""
    offset: Annotated[float, Quantity("m", -1e6, 1e6)] = 0.0
    """Added to the x of the node map [m]."""
    rail_EI: Annotated[float | None, BENDING_STIFFNESS] = None
    """Bending stiffness of the rail [N m2], of both if rails = 2; without it the local rail compliance is off."""
    sha256: Checksums | None = None
    """Checksums that the files must have; filled in when the scenario is resolved."""


def read_matrices(
    table: Matrices,
    folder: Path,
    findings: Findings,
    *,
    rails: int | None,
    rayleigh: tuple[float, float],
) -> tuple[Matrices, "Track | None"]:
    """Read the files of an imported track and build it.

    Args:
        table: The table that names them.
        folder: Folder that relative paths start from.
        findings: Takes what is wrong with the files.
        rails: 1: half model, 2: whole model, None: either.
        rayleigh: (alpha [1/s], beta [s]): alpha M + beta K is added to the damping.

    Returns:
        The table with full paths and checksums, and the track; None where there is none.
    """
    from tbatch.physics.substructure.substructure import Substructure

    before = len(findings.problems)
    parsed: dict[str, Any] = {}
    paths: dict[str, str] = {}
    checksums: dict[str, str] = {}
    for name in FILES:
        given = getattr(table, name)
        if given is None:
            continue
        try:
            paths[name], checksums[name], parsed[name] = _read(name, given, folder)
        except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: no home for "~"
            _refuse(name, f"cannot be read: {' '.join(str(error).split())}", table, findings)
            continue
        expected = getattr(table.sha256, name) if table.sha256 else None
        if expected not in (None, checksums[name]):
            message = f"has changed: its checksum is no longer that of track.matrices.sha256.{name}"
            _refuse(name, message, table, findings)
    if len(findings.problems) > before:
        return table, None
    try:
        substructure = Substructure.combine(
            parsed["mass"],
            parsed.get("damping"),
            parsed["stiffness"],
            parsed["nodes"],
            labels=parsed.get("mapping"),
            units=table.units,
            offset=table.offset,
        )
        track = substructure.track(rail_EI=table.rail_EI, rails=rails, rayleigh=rayleigh)
    except ValueError as error:
        said = str(error)
        at_fault = next((name for name, path in paths.items() if said.startswith(path)), None)
        if at_fault is None:
            findings.refuse(("track", "matrices"), said)
        else:
            _refuse(at_fault, f"cannot be used: {said}", table, findings)
        return table, None
    table = table.model_copy(update={**paths, "sha256": Checksums.model_validate(checksums)})
    return table, track


def _read(name: str, given: str, folder: Path) -> tuple[str, str, Any]:
    """Return the full path of a file with the matrix's name, its checksum, and what it holds."""
    from tbatch.physics.substructure.ansys_mapping import read_mapping
    from tbatch.physics.substructure.node_map import read_node_map
    from tbatch.physics.substructure.reading import load, parse_matrix, split_name, text_of

    file, matrix = split_name(folder / Path(given).expanduser())
    file = file.resolve()
    if not file.is_file():
        raise ValueError(f"{file} {'is not a file' if file.exists() else 'does not exist'}")
    content = load(file)
    checksum = hashlib.sha256(content).hexdigest()
    if name == "nodes":
        return str(file), checksum, read_node_map(text_of(content), str(file))
    if name == "mapping":
        return str(file), checksum, read_mapping(text_of(content), str(file))
    mark = "" if matrix is None else f"#{matrix}"
    return f"{file}{mark}", f"{checksum}{mark}", parse_matrix(content, str(file), matrix)


def _refuse(name: str, message: str, table: Matrices, findings: Findings) -> None:
    accepted = _ACCEPTED.get(name, _MATRIX)
    findings.refuse(("track", "matrices", name), message, value=getattr(table, name), accepted=accepted)
