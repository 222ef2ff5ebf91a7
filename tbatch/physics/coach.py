"""The 10-dof coach: carbody and two bogies that bounce and pitch, four wheelsets that bounce."""

from dataclasses import dataclass
from typing import ClassVar

from tbatch.physics.lumped import Body, Link, assemble
from tbatch.physics.quantities import FloatArray, positive, rail_count, spring_damper

CARBODY_OVERHANG = 3.5
"""carbody beyond each bogie centre, for drawing [m]"""
BOGIE_OVERHANG = 0.6
"""bogie frame beyond each axle, for drawing [m]"""


@dataclass(frozen=True)
class CoachParameters:
    """The numbers of a coach, those of the model as built: both sides summed in a whole one."""

    carbody_mass: float
    """Mc [kg]"""
    carbody_inertia: float
    """Jc, pitch [kg m2]"""
    bogie_mass: float
    """Mt, one bogie [kg]"""
    bogie_inertia: float
    """Jt, pitch, one bogie [kg m2]"""
    wheelset_mass: float
    """Mw, one wheelset [kg]"""
    primary: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) per axle"""
    secondary: tuple[float, float]
    """(stiffness [N/m], damping [N s/m]) per bogie"""
    bogie_half_distance: float
    """lc, half the distance of the bogie centres [m]"""
    axle_half_distance: float
    """lt, half the distance of the axles of a bogie [m]"""
    wheel_radius: float | None = None
    """r [m], where known"""
    rails: int | None = 2
    source: str = ""

    wheel_dofs: ClassVar[tuple[int, ...]] = (6, 7, 8, 9)
    dof_names: ClassVar[tuple[str, ...]] = (
        "carbody z",
        "carbody pitch",
        "bogie 1 z",
        "bogie 1 pitch",
        "bogie 2 z",
        "bogie 2 pitch",
        "wheelset 1",
        "wheelset 2",
        "wheelset 3",
        "wheelset 4",
    )

    def __post_init__(self) -> None:
        """Check the numbers."""
        for field, unit in (
            ("carbody_mass", "kg"),
            ("carbody_inertia", "kg m2"),
            ("bogie_mass", "kg"),
            ("bogie_inertia", "kg m2"),
            ("wheelset_mass", "kg"),
            ("bogie_half_distance", "m"),
            ("axle_half_distance", "m"),
        ):
            object.__setattr__(self, field, positive(f"vehicle.{field}", getattr(self, field), unit))
        for field in ("primary", "secondary"):
            value = spring_damper(f"vehicle.{field}", getattr(self, field), stiffness_above_zero=True)
            object.__setattr__(self, field, value)
        if self.wheel_radius is not None:
            object.__setattr__(self, "wheel_radius", positive("vehicle.wheel_radius", self.wheel_radius, "m"))
        if rail_count("vehicle.rails", self.rails) is None:
            raise ValueError("vehicle.rails = None: must be 1 (half model) or 2 (whole model)")

    @property
    def wheel_offsets(self) -> tuple[float, ...]:
        """Distance of each wheelset behind the first [m]."""
        lc, lt = self.bogie_half_distance, self.axle_half_distance
        return 0.0, 2.0 * lt, 2.0 * lc, 2.0 * (lc + lt)

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (M, C, K), shape (dof, dof).

        Pitch is positive nose-down: a point at a distance ahead of a body's centre is at z + distance * pitch.
        """
        lc, lt = self.bogie_half_distance, self.axle_half_distance
        bogie = (self.bogie_mass, self.bogie_inertia)
        masses = (self.carbody_mass, self.carbody_inertia, *bogie, *bogie, *[self.wheelset_mass] * 4)
        links = [
            Link({0: 1.0, 1: +lc, 2: -1.0}, *self.secondary),
            Link({0: 1.0, 1: -lc, 4: -1.0}, *self.secondary),
            Link({2: 1.0, 3: +lt, 6: -1.0}, *self.primary),
            Link({2: 1.0, 3: -lt, 7: -1.0}, *self.primary),
            Link({4: 1.0, 5: +lt, 8: -1.0}, *self.primary),
            Link({4: 1.0, 5: -lt, 9: -1.0}, *self.primary),
        ]
        return assemble(masses, links)

    def bodies(self) -> tuple[Body, ...]:
        """Return what a side view draws. The lengths of carbody and bogies are typical ones."""
        lc, lt = self.bogie_half_distance, self.axle_half_distance
        diameter = 2.0 * (self.wheel_radius or 0.46)
        bogie_length = 2.0 * (lt + BOGIE_OVERHANG)
        return (
            Body("carbody", 0, 1, lc + lt, 2.0 * (lc + CARBODY_OVERHANG)),
            Body("bogie", 2, 3, lt, bogie_length),
            Body("bogie", 4, 5, 2.0 * lc + lt, bogie_length),
            *(
                Body("wheelset", dof, None, offset, diameter)
                for dof, offset in zip(self.wheel_dofs, self.wheel_offsets, strict=True)
            ),
        )
