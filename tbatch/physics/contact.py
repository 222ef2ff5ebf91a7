"""Wheel-rail contact laws: Hertz, linear and affine, none of which can pull.

With F the force, δ the overlap of wheel and rail, P0 the static load and δ0 the overlap at rest:

    hertz    F = K_H max(δ, 0)^1.5          = (max(δ, 0) / G)^1.5
    linear   F = k_c max(δ, 0)              separates at δ = 0
    affine   F = max(P0 + k_c (δ - δ0), 0)  Hertz's tangent where it touches: separates at δ0 - P0/k_c
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.quantities import FloatArray, one_of, positive, rail_count

LAWS = ("hertz", "linear", "affine")
PROFILES = {"worn": (3.86e-8, -0.115), "conical": (4.57e-8, -0.149)}
"""G = factor * wheel_radius**power [m/N^(2/3)], wheel radius in m, for one wheel on one rail"""
TYPICAL_WHEEL_RADIUS = 0.4575
"""wheel radius [m] where neither the contact nor the vehicle says one"""


@dataclass(frozen=True, eq=False)
class ContactConstants:
    """One law for all: F = stiffness * max(δ - separation, 0) ** exponent."""

    stiffness: FloatArray
    """K_H [N/m^1.5] or k_c [N/m], shape (wheel,)"""
    exponent: float
    """1.5 for Hertz, 1.0 for the linear and affine laws"""
    approach: FloatArray
    """overlap δ0 at the static load [m], shape (wheel,)"""
    separation: FloatArray
    """overlap δ_sep at and below which the wheel is separated [m], shape (wheel,)"""

    def force(self, overlap: ArrayLike) -> FloatArray:
        """Return the contact forces [N] at the overlaps δ [m], shape (..., wheel)."""
        return self.stiffness * np.maximum(np.asarray(overlap) - self.separation, 0.0) ** self.exponent


@dataclass(frozen=True)
class Contact:
    """A contact law, before it knows the static load and whether the model is half or whole.

    `wheel_radius` and `profile` give one wheel's Hertz law, which is multiplied by the model's rails; `constant` and
    `stiffness` are per wheel dof, as given. Where neither `wheel_radius` nor `constant` is given, the vehicle's wheel
    radius serves, or 0.4575 m for a vehicle without one.
    """

    law: str
    wheel_radius: float | None = None
    """wheel radius [m]"""
    profile: str = "worn"
    """'worn' or 'conical' wheel tread"""
    constant: float | None = None
    """Hertz constant K_H of a wheel dof [N/m^1.5]"""
    stiffness: float | None = None
    """stiffness k_c of a wheel dof [N/m]; None is Hertz's tangent at the static load"""

    def __post_init__(self) -> None:
        """Check the numbers."""
        one_of("contact.law", self.law, LAWS)
        one_of("contact.profile", self.profile, tuple(PROFILES))
        for field, unit in (("wheel_radius", "m"), ("constant", "N/m^1.5"), ("stiffness", "N/m")):
            value = getattr(self, field)
            if value is not None:
                object.__setattr__(self, field, positive(f"contact.{field}", value, unit))
        if self.wheel_radius is not None and self.constant is not None:
            raise ValueError("contact.wheel_radius and contact.constant: give one of the two, both set the Hertz law")
        if self.law == "hertz" and self.stiffness is not None:
            raise ValueError("contact.stiffness: belongs to the laws 'linear' and 'affine', not to 'hertz'")
        if self.law == "linear" and self.stiffness is not None and self.constant is not None:
            raise ValueError("contact.stiffness and contact.constant: with a stiffness the linear law has no tangent")

    @classmethod
    def hertz(
        cls, *, wheel_radius: float | None = None, profile: str = "worn", constant: float | None = None
    ) -> "Contact":
        """Return Hertz's law, by wheel radius [m] and tread profile or by its constant K_H [N/m^1.5]."""
        return cls("hertz", wheel_radius, profile, constant)

    @classmethod
    def linear(
        cls,
        stiffness: float | None = None,
        *,
        wheel_radius: float | None = None,
        profile: str = "worn",
        constant: float | None = None,
    ) -> "Contact":
        """Return the law F = k_c max(δ, 0).

        Args:
            stiffness: k_c of a wheel dof [N/m]; None takes the tangent at the static load of the Hertz law that the
                other arguments give, as `hertz` does.
            wheel_radius: wheel radius [m] of that Hertz law.
            profile: tread profile of that Hertz law.
            constant: constant K_H [N/m^1.5] of that Hertz law.
        """
        return cls("linear", wheel_radius, profile, constant, stiffness)

    @classmethod
    def affine(
        cls,
        stiffness: float | None = None,
        *,
        wheel_radius: float | None = None,
        profile: str = "worn",
        constant: float | None = None,
    ) -> "Contact":
        """Return the law F = max(P0 + k_c (δ - δ0), 0) with δ0 Hertz's; the arguments are those of `linear`."""
        return cls("affine", wheel_radius, profile, constant, stiffness)

    def hertz_constant(self, rails: int, wheel_radius: float | None = None) -> float:
        """Return K_H of a wheel dof [N/m^1.5]; `wheel_radius` [m] serves where the contact has none."""
        _model_rails(rails)
        if self.constant is not None:
            return self.constant
        factor, power = PROFILES[self.profile]
        flexibility = factor * self._radius(wheel_radius) ** power
        return rails * flexibility**-1.5

    def static_law(self, rails: int, wheel_radius: float | None = None) -> tuple[float, float]:
        """Return (coefficient, exponent) of the law P0 = coefficient * δ0**exponent that loads at rest obey.

        The tangent of the linear law moves with the load: its rest overlap P0/k_c = (2/3) (P0/K_H)^(2/3) follows a
        power law again. The affine law rests where Hertz does, whatever its stiffness.
        """
        if self.law == "linear":
            if self.stiffness is not None:
                return self.stiffness, 1.0
            return self.hertz_constant(rails, wheel_radius) * 1.5**1.5, 1.5
        return self.hertz_constant(rails, wheel_radius), 1.5

    def resolve(self, static_load: ArrayLike, rails: int, *, wheel_radius: float | None = None) -> ContactConstants:
        """Return the law's constants for wheels with these static loads.

        Args:
            static_load: P0 [N], shape (wheel,), zero or more.
            rails: 1 for a half model, 2 for a whole one.
            wheel_radius: the vehicle's wheel radius [m], used where the contact has none of its own.
        """
        load = np.atleast_1d(np.asarray(static_load, dtype=np.float64))
        if not np.isfinite(load).all() or (load < 0.0).any():
            raise ValueError(f"static_load = {load}: each wheel's must be 0 or more [N]")
        coefficient, exponent = self.static_law(rails, wheel_radius)
        approach = (load / coefficient) ** (1.0 / exponent)
        none = np.zeros_like(load)
        if self.law == "hertz":
            return ContactConstants(np.full_like(load, coefficient), 1.5, approach, none)
        if self.stiffness is not None:
            stiffness = np.full_like(load, self.stiffness)
        else:
            unloaded = np.flatnonzero(load == 0.0)
            if unloaded.size:
                raise ValueError(
                    f"contact.stiffness: Hertz's tangent is zero at wheel {unloaded[0] + 1}, which has no static load; "
                    f"give a stiffness above 0 [N/m] or use Hertz's law"
                )
            stiffness = 1.5 * load ** (1.0 / 3.0) * self.hertz_constant(rails, wheel_radius) ** (2.0 / 3.0)
        separation = none if self.law == "linear" else approach - load / stiffness
        return ContactConstants(stiffness, 1.0, approach, separation)

    def describe_rows(
        self, constants: ContactConstants, rails: int, wheel_radius: float | None = None
    ) -> list[tuple[str, str]]:
        """Return what the law is and where its numbers come from, as (label, text)."""
        rows = [("contact law", self._words())]
        if self.constant is not None:
            rows.append(("Hertz constant", f"{self.constant:.6g} N/m^1.5 per wheel dof, as given"))
        elif self.law != "linear" or self.stiffness is None:
            radius = self._radius(wheel_radius)
            known = "" if self.wheel_radius or wheel_radius else ", assumed"
            text = f"{self.hertz_constant(rails, wheel_radius):.6g} N/m^1.5 per wheel dof"
            rows.append(("Hertz constant", f"{text} ({self.profile} profile, r = {radius:g} m{known}, times {rails})"))
        if self.law != "hertz":
            origin = "the tangent at the static load" if self.stiffness is None else "as given"
            rows.append(("contact stiffness", f"{_span(constants.stiffness, 'N/m')}, {origin}"))
        rows.append(("contact approach at rest", _span(constants.approach * 1e6, "µm")))
        if self.law == "affine":
            rows.append(("separates at an overlap of", _span(constants.separation * 1e6, "µm")))
        return rows

    def _words(self) -> str:
        return {
            "hertz": "hertz, F = K_H max(δ, 0)^1.5",
            "linear": "linear, F = k_c max(δ, 0), separates at δ = 0",
            "affine": "affine, F = max(P0 + k_c (δ - δ0), 0), separates at δ0 - P0/k_c",
        }[self.law]

    def _radius(self, vehicle_radius: float | None) -> float:
        return self.wheel_radius or vehicle_radius or TYPICAL_WHEEL_RADIUS


def _model_rails(rails: int) -> None:
    if rail_count("rails", rails) is None:
        raise ValueError("rails = None: must be 1 (half model) or 2 (whole model)")


def _span(values: FloatArray, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.6g} {unit}" if high - low <= 1e-9 * abs(high) else f"{low:.6g} to {high:.6g} {unit}"
