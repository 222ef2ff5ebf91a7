"""What the step of a scenario must resolve, and the warning where it does not."""

from typing import TYPE_CHECKING

from tbatch.scenario.contact import build_contact
from tbatch.scenario.document import Document
from tbatch.scenario.errors import Findings
from tbatch.scenario.measured import MeasuredLevel
from tbatch.scenario.vehicle import build_vehicle

if TYPE_CHECKING:
    from tbatch.numerics.step_advice import Resolution
    from tbatch.physics.static import RigidRest
    from tbatch.physics.vehicle import Vehicle


def resolutions_of(
    document: Document, vehicle: "Vehicle", rest: "RigidRest", level: MeasuredLevel | None = None
) -> list["Resolution"]:
    """Return what the step of a scenario must resolve at its highest speed, the most demanding first.

    Args:
        document: The scenario.
        vehicle: Its vehicle.
        rest: The vehicle at rest on a rigid rail.
        level: Its measured level, if it has one.
    """
    from tbatch.numerics.step_advice import resolutions

    irregularity = document.irregularity
    waves = [1.0 / wave.wavenumber for wave in irregularity.cosines if wave.wavenumber]
    if irregularity.wavelengths is not None:
        waves.append(irregularity.wavelengths[0])
    if level is not None:
        # Between its points a level is a smooth curve; two spacings are the shortest wave that it can hold.
        waves.append(2.0 * float((level.x[1:] - level.x[:-1]).min()))
    flats = tuple(defect.length for defect in irregularity.defect)
    return resolutions(vehicle, rest, max(document.speed.range), flats=flats, waves=tuple(waves))


def warn_of_step(document: Document, level: MeasuredLevel | None, findings: Findings) -> None:
    """Note what the step does not resolve, and the step that would.

    Args:
        document: The scenario.
        level: Its measured level, if it has one.
        findings: Takes the warnings.
    """
    from tbatch.physics.static import rest_on_rigid_rail

    try:
        vehicle = build_vehicle(document.vehicle)
        rest = rest_on_rigid_rail(vehicle, build_contact(document.contact), vehicle.rails or document.track.rails or 1)
    except (ValueError, ArithmeticError):
        return  # said when the model is built
    step = document.integration.step
    for one in resolutions_of(document, vehicle, rest, level):
        if not one.resolved(step):
            findings.warn(
                f"integration.step: {step * 1e3:g} ms takes {one.steps(step):.2g} steps over the {one.what}"
                f" ({one.time * 1e3:.3g} ms), {one.needed} are needed: {_rounded_down(one.longest_step) * 1e3:g} ms"
            )


def _rounded_down(step: float) -> float:
    """Return a step to two digits, not above it [s]."""
    from math import floor, log10

    unit = 10.0 ** (floor(log10(step)) - 1)
    return floor(step / unit * (1.0 + 1e-9)) * unit
