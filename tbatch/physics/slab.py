"""The three-layer slab track: rail - fasteners - slab - CA mortar - base plate - subgrade."""

from dataclasses import dataclass
from math import ceil
from typing import ClassVar

import numpy as np

from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.elements import beam_stiffness, consistent_bed
from tbatch.physics.quantities import FloatArray, beam_section, non_negative, one_of, pair, positive, rail_count
from tbatch.physics.quantities import spring_damper as accept_spring_damper

BED_UNITS = ("fastener", "metre")


@dataclass(frozen=True)
class SlabParameters:
    """The numbers of a slab track, those of the model as built: both rails summed in a whole one.

    Fasteners act at their seats, at x = 0, bay, 2 bay, ...; mortar and subgrade are continuous beds. Slab and base
    plate are continuous beams without joints.
    """

    bay: float
    """fastener spacing [m]"""
    rail: tuple[float, float]
    """(EI [N m2], mass [kg/m])"""
    fastener: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) of a seat"""
    slab: tuple[float, float]
    """(EI [N m2], mass [kg/m])"""
    mortar: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) per fastener spacing or per metre"""
    base: tuple[float, float]
    """(EI [N m2], mass [kg/m])"""
    subgrade: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) per fastener spacing or per metre"""
    per: str = "fastener"
    """what mortar and subgrade are given per: 'fastener' (spacing) or 'metre'"""
    rayleigh: tuple[float, float] = (0.0, 0.0)
    """(alpha [1/s], beta [s]): alpha M + beta K is added to the damping"""
    rails: int | None = 2
    source: str = ""

    layers: ClassVar[dict[str, tuple[int, int]]] = {"rail": (0, 1), "slab": (2, 3), "base": (4, 5)}

    def __post_init__(self) -> None:
        """Check the numbers."""
        object.__setattr__(self, "bay", positive("track.bay", self.bay, "m"))
        one_of("track.per", self.per, BED_UNITS)
        for field in ("rail", "slab", "base"):
            object.__setattr__(self, field, beam_section(f"track.{field}", getattr(self, field)))
        for field in ("fastener", "mortar", "subgrade"):
            per = "" if field == "fastener" else f" per {self.per}"
            object.__setattr__(self, field, accept_spring_damper(f"track.{field}", getattr(self, field), per=per))
        object.__setattr__(self, "rayleigh", accept_rayleigh(self.rayleigh))
        if rail_count("track.rails", self.rails) is None:
            raise ValueError("track.rails = None: must be 1 (half model) or 2 (whole model)")

    def bay_count(self, length: float) -> int:
        """Return the number of whole bays that cover `length` [m]."""
        # Seven bays of 0.65 m are 4.55 m, although 4.55 / 0.65 is a little above 7 in floating point.
        return max(1, ceil(length / self.bay * (1.0 - 1e-12)))

    def bed(self, field: str) -> tuple[float, float]:
        """Return (stiffness [N/m2], damping [N s/m2]) per metre of 'mortar' or 'subgrade'."""
        stiffness, damping = getattr(self, field)
        share = self.bay if self.per == "fastener" else 1.0
        return stiffness / share, damping / share

    def matrices(self, bays: int, elements_per_bay: int) -> tuple[BlockTridiagonal, ...]:
        """Return (M, C, K) of the track with free ends, without the Rayleigh terms."""
        length = self.bay / elements_per_bay
        count = bays * elements_per_bay
        mortar, subgrade = self.bed("mortar"), self.bed("subgrade")
        mass, damping, stiffness = np.zeros((3, 12, 12))
        for layer in self.layers:
            EI, per_metre = getattr(self, layer)
            _add(stiffness, beam_stiffness(length, EI), {layer: 1.0})
            _add(mass, consistent_bed(length, per_metre), {layer: 1.0})
        for which, matrix in ((0, stiffness), (1, damping)):
            _add(matrix, consistent_bed(length, mortar[which]), {"slab": 1.0, "base": -1.0})
            _add(matrix, consistent_bed(length, subgrade[which]), {"base": 1.0})
        M, C, K = (BlockTridiagonal.from_elements(matrix, count) for matrix in (mass, damping, stiffness))
        stretch = np.array([1.0, 0.0, -1.0, 0.0, 0.0, 0.0])
        for which, chain in ((0, K), (1, C)):
            chain.diagonal[::elements_per_bay] += self.fastener[which] * np.outer(stretch, stretch)
        return M, C, K


def accept_rayleigh(value: object) -> tuple[float, float]:
    """Return `value` as (alpha, beta), each zero or more."""
    alpha, beta = pair("track.rayleigh", value, ("alpha", "beta"))
    return non_negative("track.rayleigh alpha", alpha, "1/s"), non_negative("track.rayleigh beta", beta, "s")


def _add(matrix: FloatArray, part: FloatArray, stretch: dict[str, float]) -> None:
    """Add a beam element's matrix `part` (4, 4) between layers to the 12-dof `matrix`, by the sign of each layer."""
    for row_layer, row_sign in stretch.items():
        for column_layer, column_sign in stretch.items():
            rows, columns = _element_dofs(row_layer), _element_dofs(column_layer)
            matrix[np.ix_(rows, columns)] += row_sign * column_sign * part


def _element_dofs(layer: str) -> list[int]:
    """Return the dofs (w1, theta1, w2, theta2) of a layer in the 12-dof element, first node first."""
    w, theta = SlabParameters.layers[layer]
    return [w, theta, 6 + w, 6 + theta]
