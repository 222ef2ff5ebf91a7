"""What every track is once it is built: matrices, where its rail is, how wide it is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.elements import hermite
from tbatch.physics.imported.matrices import ImportedMatrices
from tbatch.physics.quantities import FloatArray
from tbatch.physics.slab import SlabParameters
from tbatch.physics.sparse import SparseSymmetric
from tbatch.physics.winkler import WinklerParameters

TrackMatrix: TypeAlias = BlockTridiagonal | SparseSymmetric


@dataclass(frozen=True, eq=False)
class Line:
    """M ü + C u̇ + K u = Nᵀ F: a line of equal elements from x = 0, with the vertical dofs at both ends pinned.

    Dof (node i, local dof r) is row i * node_dofs + r; node i is at x = i * element_length. Each layer has two local
    dofs, w (down) and theta = dw/dx. Displacements are measured from the track's own static equilibrium.

    An imported track is a line of any rows: each is a node of one dof, and `imported` says where the rail is.
    """

    kind: str
    """'slab', 'winkler', 'beam', 'rigid' or 'matrices'"""
    length: float
    """[m]"""
    element_count: int
    """elements of the rail: pairs of neighbouring rail nodes"""
    layers: Mapping[str, tuple[int, int]]
    """local dofs (w, theta) of each layer; the rail is first; empty for a rigid track"""
    mass: TrackMatrix
    """M, rows and columns of pinned dofs zero"""
    damping: TrackMatrix
    """C, likewise"""
    stiffness: TrackMatrix
    """K, likewise"""
    pinned: np.ndarray
    """true where a dof is held at zero, shape (node, m)"""
    period: int
    """elements per structural period: those of a bay"""
    rail_EI: float | None
    """bending stiffness of the rail [N m2], of both if rails = 2; None if not known"""
    rails: int | None
    """1: half model, 2: whole model, None: either"""
    name: str
    source: str = ""
    parameters: SlabParameters | WinklerParameters | None = None
    """the numbers it was built from"""
    imported: ImportedMatrices | None = None
    """of a track from matrices: where its rail is and what became of the given rows"""
    window: "Callable[[float], Line] | None" = None
    """of an endless track: makes the finite line of a length [m] that is stepped in its place; None for a finite one"""

    @property
    def element_length(self) -> float:
        """Length of an element [m]; the mean one of an imported track."""
        return self.length / self.element_count

    @property
    def begin(self) -> float:
        """Where the rail begins [m]: 0, but for an imported track."""
        return 0.0 if self.imported is None else float(self.imported.rail.x[0])

    @property
    def end(self) -> float:
        """Where the rail ends [m]."""
        return self.length if self.imported is None else float(self.imported.rail.x[-1])

    @property
    def node_count(self) -> int:
        """Number of nodes, one more than elements; the number of rows of an imported track."""
        return self.element_count + 1 if self.imported is None else self.mass.node_count

    @property
    def node_dofs(self) -> int:
        """Number m of dofs of a node, pinned ones included; 0 for a rigid track."""
        return self.mass.node_dofs

    @property
    def free(self) -> np.ndarray:
        """True where a dof moves, shape (node, m)."""
        return ~self.pinned

    def locate(self, x: ArrayLike) -> tuple[np.ndarray, FloatArray]:
        """Return the element under each position and the shape values N there.

        Args:
            x: positions [m], shape (...), within the track.

        Returns:
            element, which is its first rail node, shape (...); values of (w1, theta1, w2, theta2), shape (..., 4).
        """
        position = np.asarray(x, dtype=np.float64)
        slack = self.length * 1e-12
        if (position < self.begin).any() or (position > self.end + slack).any() or np.isnan(position).any():
            raise ValueError(f"x = {x!r}: must be from {self.begin:g} to {self.end:g} [m]")
        if self.imported is not None:
            element, _, shape = self.imported.rail.place(position.ravel())
            return element.reshape(position.shape), shape.reshape(*position.shape, 4)
        count, a = self.element_count, self.element_length
        element = np.clip(np.floor(position / a).astype(np.int64), 0, count - 1)
        return element, hermite(position / a - element, a)

    def spans(self, element: np.ndarray) -> tuple[FloatArray, FloatArray]:
        """Return where elements begin and how long they are [m], shape of `element` each."""
        if self.imported is None:
            return element * self.element_length, np.full(element.shape, self.element_length)
        x = self.imported.rail.x
        return x[element], x[element + 1] - x[element]

    def layer_rows(self, element: np.ndarray, layer: str = "rail") -> np.ndarray:
        """Return the rows of (w1, theta1, w2, theta2) of a layer at elements, shape (element, 4)."""
        if self.imported is not None:
            first = self.imported.rail.row.astype(np.int64)
            near, far = first[element], first[element + 1]
        else:
            near = element * self.node_dofs + self.layers[layer][0]
            far = near + self.node_dofs
        return np.stack([near, near + 1, far, far + 1], axis=1)

    def describe_rows(self) -> list[tuple[str, str]]:
        """Return the track's facts as (label, text)."""
        rails = {1: "half (one rail)", 2: "whole (two rails)", None: "half or whole"}[self.rails]
        rows = [
            ("track", self.name if not self.source else f"{self.name} ({self.source})"),
            ("track rails", rails),
            ("track length", self._reach() if self.window is None else f"endless, {self.length:g} m stepped"),
        ]
        if self.kind == "rigid":
            return rows
        if self.imported is not None:
            return rows + self.imported.describe_rows(self.rail_EI)
        free = int(self.free.sum())
        rows += [
            ("track elements", f"{self.element_count} of {self.element_length:g} m, {self.period} per period"),
            ("track dofs", f"{self.pinned.size}, {free} free; layers {', '.join(self.layers)}"),
        ]
        if isinstance(self.parameters, SlabParameters):
            rows.append(("mortar and subgrade", f"given per {self.parameters.per}"))
        return rows

    def _reach(self) -> str:
        return f"{self.length:g} m" + ("" if self.imported is None else f", from x = {self.begin:g} to {self.end:g} m")
