"""A beam on a continuous viscoelastic bed; without a bed it is a plain beam."""

from dataclasses import dataclass
from math import ceil
from typing import ClassVar

from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.elements import beam_stiffness, consistent_bed
from tbatch.physics.quantities import non_negative, positive, rail_count


@dataclass(frozen=True)
class WinklerParameters:
    """The numbers of a beam on a bed, per metre, those of the model as built."""

    EI: float
    """bending stiffness [N m2]"""
    mass: float
    """[kg/m]"""
    stiffness: float
    """bed [N/m2]"""
    damping: float
    """bed [N s/m2]"""
    rails: int | None = 1
    source: str = ""

    layers: ClassVar[dict[str, tuple[int, int]]] = {"rail": (0, 1)}

    def __post_init__(self) -> None:
        """Check the numbers."""
        object.__setattr__(self, "EI", positive("track.EI", self.EI, "N m2"))
        object.__setattr__(self, "mass", positive("track.mass", self.mass, "kg/m"))
        object.__setattr__(self, "stiffness", non_negative("track.stiffness", self.stiffness, "N/m2"))
        object.__setattr__(self, "damping", non_negative("track.damping", self.damping, "N s/m2"))
        rail_count("track.rails", self.rails)

    def usual_element_count(self, length: float) -> int:
        """Return the elements of a line whose elements are a fifth of the bed's length (4 EI / k)^¼ or shorter."""
        if self.stiffness == 0.0:
            raise ValueError("track.elements: must be given for a track without a bed")
        return max(1, ceil(5.0 * length * (self.stiffness / (4.0 * self.EI)) ** 0.25))

    def matrices(self, length: float, elements: int) -> tuple[BlockTridiagonal, ...]:
        """Return (M, C, K) of a line with free ends."""
        a = length / elements
        parts = (
            consistent_bed(a, self.mass),
            consistent_bed(a, self.damping),
            beam_stiffness(a, self.EI) + consistent_bed(a, self.stiffness),
        )
        return tuple(BlockTridiagonal.from_elements(part, elements) for part in parts)
