"""The [vehicle] table: what a user may write, completed from the catalogue, built."""

from typing import TYPE_CHECKING, Annotated, Any

from tbatch.physics.catalogue.vehicles import COACHES, COLUMNS
from tbatch.physics.coach import CoachParameters
from tbatch.physics.column import ColumnParameters
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Count, Quantity, Word
from tbatch.scenario.section import Section, Suspension, changes, complete, refuse_foreign

if TYPE_CHECKING:
    from tbatch.physics.vehicle import Vehicle

WHEEL_RADIUS = Quantity("m", 0.1, 2.0)

_MASS = Quantity("kg", 1e-3, 1e7)
_INERTIA = Quantity("kg*m^2", 1e-3, 1e10)
_HALF_DISTANCE = Quantity("m", 0.1, 100.0)
_COLUMN_ONLY = {"wheel_mass"}
_COACH_ONLY = {"carbody_inertia", "bogie_inertia", "wheelset_mass", "bogie_half_distance", "axle_half_distance"}
_NUMBERS = {
    "coach": ("carbody_mass", "bogie_mass", *sorted(_COACH_ONLY), "primary", "secondary", "wheel_radius", "rails"),
    "column": ("carbody_mass", "bogie_mass", *_COLUMN_ONLY, "primary", "secondary", "wheel_radius", "rails"),
}


def vehicle_models() -> tuple[str, ...]:
    """Return what ``vehicle.model`` accepts: catalogue names, then the kinds."""
    return (*COACHES, *COLUMNS, *_NUMBERS)


class VehicleSection(Section):
    """The vehicle: a catalogue set, a catalogue set with some numbers changed, or all numbers of a coach or column.

    The numbers are those of the model as built: both sides summed in a whole model, per axle and per bogie.
    """

    model: Annotated[str | None, Word(vehicle_models)] = None
    """A catalogue name, or "coach" or "column" with all numbers given."""
    carbody_mass: Annotated[float | None, _MASS] = None
    """Carbody mass [kg]."""
    carbody_inertia: Annotated[float | None, _INERTIA] = None
    """Carbody pitch inertia [kg m2]."""
    bogie_mass: Annotated[float | None, _MASS] = None
    """Mass of one bogie [kg]."""
    bogie_inertia: Annotated[float | None, _INERTIA] = None
    """Pitch inertia of one bogie [kg m2]."""
    wheelset_mass: Annotated[float | None, _MASS] = None
    """Mass of one wheelset of a coach [kg]."""
    wheel_mass: Annotated[float | None, _MASS] = None
    """Mass of a column's wheel [kg]."""
    primary: Suspension | None = None
    """Primary suspension, per axle."""
    secondary: Suspension | None = None
    """Secondary suspension, per bogie."""
    bogie_half_distance: Annotated[float | None, _HALF_DISTANCE] = None
    """Half the distance of the bogie centres [m]."""
    axle_half_distance: Annotated[float | None, _HALF_DISTANCE] = None
    """Half the distance of the axles of a bogie [m]."""
    wheel_radius: Annotated[float | None, WHEEL_RADIUS] = None
    """Wheel radius [m]."""
    rails: Annotated[int | None, Count(1, 2)] = None
    """1: half model, one rail; 2: whole model. It labels the numbers, it never rescales them."""
    count: Annotated[int, Count(1, 1)] = 1
    """Number of vehicles in the train; only 1 so far."""

    @property
    def kind(self) -> str:
        """Kind of vehicle, "coach" or "column"; empty if neither the model nor the keys say it."""
        if self.model in COACHES or self.model in COLUMNS:
            return "coach" if self.model in COACHES else "column"
        if self.model is not None:
            return self.model
        if self.model_fields_set & _COACH_ONLY:
            return "coach"
        return "column" if self.model_fields_set & _COLUMN_ONLY else ""

    @property
    def offsets(self) -> tuple[float, ...]:
        """Distance of each wheel of a completed section behind wheel 1 [m]."""
        if self.kind == "column" or self.axle_half_distance is None or self.bogie_half_distance is None:
            return ColumnParameters.wheel_offsets
        axles, bogies = 2.0 * self.axle_half_distance, 2.0 * self.bogie_half_distance
        return 0.0, axles, bogies, bogies + axles


def complete_vehicle(section: VehicleSection, findings: Findings) -> VehicleSection:
    """Return the table with all numbers of its vehicle.

    Args:
        section: The table as read.
        findings: Takes what is missing or does not belong.
    """
    kind = section.kind
    if not kind:
        accepted = ", ".join(f'"{name}"' for name in vehicle_models()) + "; or the numbers of a coach or column"
        findings.refuse(("vehicle", "model"), "is missing", accepted=accepted)
        return section
    named = section.model not in (None, *_NUMBERS)
    what = f"a {kind}" + (f' such as "{section.model}"' if named else "")
    refuse_foreign(section, "vehicle", {"model", "count", *_NUMBERS[kind]}, what, findings)
    parameters: type = CoachParameters if kind == "coach" else ColumnParameters
    section = complete(section, "vehicle", parameters, _entry(section), findings).model_copy(
        update={"model": section.model or kind}
    )
    if kind == "coach" and section.axle_half_distance and section.bogie_half_distance:
        if section.axle_half_distance >= section.bogie_half_distance:
            findings.refuse(
                ("vehicle", "axle_half_distance"),
                "is not below bogie_half_distance: the bogies would overlap",
                value=section.axle_half_distance,
                accepted=f"0.1 to below {section.bogie_half_distance:g} m",
            )
    return section


def build_vehicle(section: VehicleSection) -> "Vehicle":
    """Return the vehicle of a completed table."""
    from tbatch.physics.vehicle import Vehicle

    numbers = changes(section, _entry(section), _NUMBERS[section.kind])
    name = section.model if _entry(section) else None
    return Vehicle.coach(name, **numbers) if section.kind == "coach" else Vehicle.column(name, **numbers)


def _entry(section: VehicleSection) -> Any:
    return COACHES.get(section.model or "") or COLUMNS.get(section.model or "")
