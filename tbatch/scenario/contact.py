"""The [contact] table: what a user may write, completed, built."""

from typing import TYPE_CHECKING, Annotated

from tbatch.physics.contact import LAWS, PROFILES, TYPICAL_WHEEL_RADIUS
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Flag, Quantity, Word
from tbatch.scenario.section import Section
from tbatch.scenario.vehicle import WHEEL_RADIUS

if TYPE_CHECKING:
    from tbatch.physics.contact import Contact


class ContactSection(Section):
    """The wheel-rail contact."""

    law: Annotated[str, Word(LAWS)] = "hertz"
    """F = K_H max(δ, 0)^1.5; F = k_c max(δ, 0); or F = max(P0 + k_c (δ - δ0), 0)."""
    profile: Annotated[str | None, Word(tuple(PROFILES))] = None
    """Tread profile, "worn" by default, for a Hertz constant by wheel radius."""
    wheel_radius: Annotated[float | None, WHEEL_RADIUS] = None
    """Wheel radius [m]; the vehicle's by default."""
    constant: Annotated[float | None, Quantity("N/m^1.5", 1e6, 1e15)] = None
    """Hertz constant of a wheel dof [N/m^1.5], instead of radius and profile."""
    stiffness: Annotated[float | None, Quantity("N/m", 1e3, 1e13)] = None
    """Stiffness of a wheel dof [N/m], linear and affine; by default Hertz's tangent at the static load."""
    local_compliance: Annotated[bool, Flag()] = True
    """Whether the rail's deflection between the nodes of the loaded element acts in series with the contact."""


def complete_contact(section: ContactSection, vehicle_radius: float | None, findings: Findings) -> ContactSection:
    """Return the table with all numbers its law uses.

    Args:
        section: The table as read.
        vehicle_radius: The vehicle's wheel radius [m], None if it has none.
        findings: Takes keys that contradict one another.
    """
    if section.law == "hertz" and section.stiffness is not None:
        findings.refuse(
            ("contact", "stiffness"),
            'does not belong to the law "hertz"',
            value=section.stiffness,
            accepted='constant [N/m^1.5] with "hertz"; stiffness [N/m] with "linear" or "affine"',
        )
    given = "stiffness" if section.law == "linear" and section.stiffness is not None else "constant"
    if getattr(section, given) is None:
        radius = section.wheel_radius or vehicle_radius or TYPICAL_WHEEL_RADIUS
        return section.model_copy(update={"profile": section.profile or "worn", "wheel_radius": radius})
    for name in ("wheel_radius", "profile", "constant"):
        if name != given and getattr(section, name) is not None:
            findings.refuse(
                ("contact", name),
                f"has no effect beside contact.{given}",
                value=getattr(section, name),
                accepted=f"either {given}, or wheel_radius and profile",
            )
    return section


def build_contact(section: ContactSection) -> "Contact":
    """Return the contact law of a completed table."""
    from tbatch.physics.contact import Contact

    return Contact(section.law, section.wheel_radius, section.profile or "worn", section.constant, section.stiffness)
