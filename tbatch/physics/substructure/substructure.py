"""The matrices of a track as tbatch takes them: one order of rows, SI, the rail's deflection down and theta = dw/dx."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from tbatch.physics.quantities import finite, one_of
from tbatch.physics.slab import accept_rayleigh
from tbatch.physics.substructure.ansys_mapping import read_mapping
from tbatch.physics.substructure.file_matrix import FileMatrix, Label, shown_label
from tbatch.physics.substructure.node_map import HELD, NodeMap, read_node_map
from tbatch.physics.substructure.reading import load, read_matrix, text_of

if TYPE_CHECKING:
    from tbatch.physics.track import Track

UNITS = {"m-kg-s": (1.0, 1.0), "mm-t-s": (1e-3, 1e3)}
"""Consistent units of a model: its unit of energy [J] and how many of its units of length are a metre."""


@dataclass(frozen=True, eq=False)
class Substructure:
    """M, C, K of a track read from files, and which of their rows are the rail's."""

    mass: sparse.csc_matrix
    """M, shape (dof, dof)."""
    damping: sparse.csc_matrix
    """C, likewise."""
    stiffness: sparse.csc_matrix
    """K, likewise."""
    rail_x: NDArray[np.float64]
    """Positions of the rail's nodes [m], shape (node,)."""
    rail_w: NDArray[np.int64]
    """Row of each node's deflection, from 0; -1 where it is held and has no row, shape (node,)."""
    rail_theta: NDArray[np.int64] | None
    """The same of each node's rotation; None where the rail has none."""
    files: Mapping[str, str]
    """Files of "mass", "damping", "stiffness" and "nodes"."""
    labels: tuple[Label, ...] | None = None
    """Node and dof of each row; None where no file says."""

    @classmethod
    def combine(
        cls,
        mass: FileMatrix,
        damping: FileMatrix | None,
        stiffness: FileMatrix,
        nodes: NodeMap,
        *,
        labels: Sequence[Label] | None = None,
        units: str = "m-kg-s",
        offset: float = 0.0,
    ) -> "Substructure":
        """Bring matrices to one order of rows, the rail to tbatch's signs, and everything to SI.

        Only the rail's dofs are turned and scaled. The others keep the sense and the unit of length they have in the
        finite element model: K̂ is as definite as before, and nothing outside the model meets them.

        Args:
            mass: Mass matrix.
            damping: Damping matrix, None for no damping.
            stiffness: Stiffness matrix.
            nodes: Which rows are the rail's.
            labels: Node and dof of each row, for files that do not say.
            units: Units of the files, a key of ``UNITS``.
            offset: Added to the x of the nodes [m].
        """
        energy, per_metre = UNITS[one_of("units", units, tuple(UNITS))]
        given = {"mass": mass, "damping": damping, "stiffness": stiffness}
        found = _in_one_order({name: matrix for name, matrix in given.items() if matrix is not None}, labels)
        ordered = found["stiffness"]
        rail_w, rail_theta = nodes.rows(ordered)
        scale = np.ones(ordered.size)
        for rows, signs, factor in ((rail_w, nodes.w_sign, per_metre), (rail_theta, nodes.theta_sign, 1.0)):
            if rows is not None:
                own = rows != HELD
                scale[rows[own]] = factor * (1.0 if signs is None else signs[own])
        turn = sparse.diags(scale)
        nothing = sparse.csc_matrix((ordered.size, ordered.size))
        M, C, K = (
            sparse.csc_matrix(energy * (turn @ found[name].matrix @ turn)) if name in found else nothing
            for name in ("mass", "damping", "stiffness")
        )
        if rail_theta is not None and nodes.theta_sign is not None:
            _accept_rotation(K, rail_w, rail_theta, nodes.path)
        files = {name: matrix.path for name, matrix in found.items()} | {"nodes": nodes.path}
        x = nodes.x + finite("offset", offset, "m")
        return cls(M, C, K, x, rail_w, rail_theta, files, ordered.labels)

    @classmethod
    def read(
        cls,
        *,
        mass: str | Path,
        stiffness: str | Path,
        nodes: str | Path,
        damping: str | Path | None = None,
        mapping: str | Path | None = None,
        units: str = "m-kg-s",
        offset: float = 0.0,
    ) -> "Substructure":
        """Read a track's matrices and its node map.

        Args:
            mass: File of the mass matrix, of any format of ``read_matrix``.
            stiffness: File of the stiffness matrix.
            nodes: File of the node map.
            damping: File of the damping matrix, None for no damping.
            mapping: ANSYS mapping file: node and dof of each row, for Harwell-Boeing matrices.
            units: Units of the matrices, "m-kg-s" or "mm-t-s".
            offset: Added to the x of the nodes [m].
        """
        return cls.combine(
            read_matrix(mass),
            None if damping is None else read_matrix(damping),
            read_matrix(stiffness),
            read_node_map(text_of(load(Path(nodes))), str(nodes)),
            labels=None if mapping is None else read_mapping(text_of(load(Path(mapping))), str(mapping)),
            units=units,
            offset=offset,
        )

    def track(
        self,
        *,
        rail_EI: float | None = None,
        rails: int | None = None,
        rayleigh: tuple[float, float] = (0.0, 0.0),
    ) -> "Track":
        """Return the track of these matrices.

        Args:
            rail_EI: Bending stiffness of the rail [N m2], of both if rails = 2; None if not known.
            rails: 1: half model, 2: whole model, None: either.
            rayleigh: (alpha [1/s], beta [s]): alpha M + beta K is added to the damping.
        """
        from tbatch.physics.track import Track

        alpha, beta = accept_rayleigh(rayleigh)
        damping = sparse.csc_matrix(self.damping + alpha * self.mass + beta * self.stiffness)
        try:
            return Track.from_matrices(
                self.mass,
                damping,
                self.stiffness,
                rail_x=self.rail_x,
                rail_w=self.rail_w,
                rail_theta=self.rail_theta,
                rail_EI=rail_EI,
                rails=rails,
                source=Path(self.files["stiffness"]).name,
            )
        except ValueError as error:
            raise ValueError(self._in_terms_of_files(error)) from error

    def _in_terms_of_files(self, error: ValueError) -> str:
        """Return a message about matrices and rows with the file, and the row's node and dof, added."""
        message, matrix, row = str(error), getattr(error, "matrix", ""), getattr(error, "row", None)
        if row is not None:
            named = f"row {row + 1} of the file" if self.labels is None else shown_label(self.labels[row])
            message += f" (row {row} from 0 is {named})"
        if not matrix and ("rail_w" in message or "rail_theta" in message):
            matrix = "nodes"
        return f"{self.files[matrix]}: {message}" if matrix in self.files else message


def _in_one_order(matrices: dict[str, FileMatrix], labels: Sequence[Label] | None) -> dict[str, FileMatrix]:
    """Return the matrices with the same rows: by node and dof where all say them, else as they stand."""
    largest = max(matrix.size for matrix in matrices.values())
    for name, matrix in matrices.items():
        if labels is not None and matrix.labels is None:
            if matrix.size != len(labels) and (matrix.stated or matrix.size > len(labels)):
                raise ValueError(f"{matrix.path}: {matrix.size} rows, but the mapping has {len(labels)} equations")
            matrices[name] = replace(matrix.with_rows(len(labels)), labels=tuple(labels))
    known = [matrix for matrix in matrices.values() if matrix.labels is not None]
    if known and len(known) < len(matrices):
        other = next(matrix for matrix in matrices.values() if matrix.labels is None)
        raise ValueError(f"{other.path}: has rows without node and dof, but {known[0].path} has them; give all alike")
    if known:
        union = sorted({label for matrix in known for label in matrix.labels or ()})
        return {name: matrix.sorted_as(union) for name, matrix in matrices.items()}
    stated = [matrix for matrix in (matrices["stiffness"], *matrices.values()) if matrix.stated]
    for matrix in matrices.values():
        if stated and matrix.size != stated[0].size and (matrix.stated or matrix.size > stated[0].size):
            raise ValueError(f"{matrix.path}: {matrix.size} rows, but {stated[0].path} has {stated[0].size}")
    return {name: matrix.with_rows(largest) for name, matrix in matrices.items()}


def _accept_rotation(K: sparse.csc_matrix, rail_w: NDArray[np.int64], rail_theta: NDArray[np.int64], path: str) -> None:
    """Refuse signs that make the rotations count against the deflections.

    Between the nodes of a beam the deflection of the first and the rotation of the second couple by +6EI/l² if
    theta = dw/dx, by -6EI/l² if theta = -dw/dx.
    """
    coupling = np.zeros(0)
    for w, theta, sign in ((rail_w[:-1], rail_theta[1:], 1.0), (rail_w[1:], rail_theta[:-1], -1.0)):
        own = (w != HELD) & (theta != HELD)
        if own.any():
            coupling = np.append(coupling, sign * np.asarray(K[w[own], theta[own]]).ravel())
    if coupling.sum() < -0.5 * np.abs(coupling).sum():
        message = "the signs make the rotations -dw/dx, by the stiffness between the rail's nodes"
        raise ValueError(f"{path}: {message}; accepted: theta_sign the other way round, or no theta_sign")
