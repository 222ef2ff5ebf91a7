"""The 3-dof column: carbody, bogie and wheel above one another."""

from dataclasses import dataclass
from typing import ClassVar

from tbatch.physics.lumped import Body, Link, assemble
from tbatch.physics.quantities import FloatArray, positive, rail_count, spring_damper


@dataclass(frozen=True)
class ColumnParameters:
    """The numbers of a column, those of the model as built."""

    carbody_mass: float
    """[kg]"""
    bogie_mass: float
    """[kg]"""
    wheel_mass: float
    """[kg]"""
    secondary: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) between carbody and bogie"""
    primary: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) between bogie and wheel"""
    wheel_radius: float | None = None
    """[m], where known"""
    rails: int | None = 1
    source: str = ""

    wheel_dofs: ClassVar[tuple[int, ...]] = (2,)
    wheel_offsets: ClassVar[tuple[float, ...]] = (0.0,)
    dof_names: ClassVar[tuple[str, ...]] = ("carbody", "bogie", "wheel")

    def __post_init__(self) -> None:
        """Check the numbers."""
        for field in ("carbody_mass", "bogie_mass", "wheel_mass"):
            object.__setattr__(self, field, positive(f"vehicle.{field}", getattr(self, field), "kg"))
        for field in ("primary", "secondary"):
            value = spring_damper(f"vehicle.{field}", getattr(self, field), stiffness_above_zero=True)
            object.__setattr__(self, field, value)
        if self.wheel_radius is not None:
            object.__setattr__(self, "wheel_radius", positive("vehicle.wheel_radius", self.wheel_radius, "m"))
        if rail_count("vehicle.rails", self.rails) is None:
            raise ValueError("vehicle.rails = None: must be 1 (half model) or 2 (whole model)")

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (M, C, K), shape (dof, dof)."""
        links = [Link({0: 1.0, 1: -1.0}, *self.secondary), Link({1: 1.0, 2: -1.0}, *self.primary)]
        return assemble((self.carbody_mass, self.bogie_mass, self.wheel_mass), links)

    def bodies(self) -> tuple[Body, ...]:
        """Return what a side view draws: the column stands for a part of a coach, so its lengths are symbols."""
        return (
            Body("carbody", 0, None, 0.0, 4.0),
            Body("bogie", 1, None, 0.0, 2.0),
            Body("wheelset", 2, None, 0.0, 2.0 * (self.wheel_radius or 0.46)),
        )
