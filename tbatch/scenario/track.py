"""The [track] table: what a user may write, completed from the catalogue, built."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import ConfigDict

from tbatch.physics.catalogue.tracks import SLAB_TRACKS, WINKLER_TRACKS
from tbatch.physics.slab import BED_UNITS, SlabParameters
from tbatch.physics.winkler import WinklerParameters
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Count, Quantity, Word
from tbatch.scenario.matrices import Matrices
from tbatch.scenario.section import (
    BENDING_STIFFNESS,
    LINE_MASS,
    Beam,
    Bed,
    Rayleigh,
    Section,
    Suspension,
    changes,
    complete,
    refuse_foreign,
)

if TYPE_CHECKING:
    from tbatch.physics.track import Track

_MOST_ELEMENTS = 50_000
_SLAB_NUMBERS = ("bay", "rail", "fastener", "slab", "mortar", "base", "subgrade", "per", "rayleigh", "rails")
_WINKLER_NUMBERS = ("EI", "mass", "stiffness", "damping", "rails")
_KEYS: dict[str, tuple[str, ...]] = {
    "slab": ("elements_per_bay", *_SLAB_NUMBERS),
    "winkler": ("elements", "rayleigh", *_WINKLER_NUMBERS),
    "beam": ("elements", "EI", "mass", "rayleigh", "rails"),
    "rigid": ("rails",),
    "matrices": ("matrices", "rayleigh", "rails"),
}


def track_models() -> tuple[str, ...]:
    """Return what ``track.model`` accepts: catalogue names, then the kinds."""
    return (*SLAB_TRACKS, *WINKLER_TRACKS, *_KEYS)


class TrackSection(Section):
    """The track: a catalogue set, a catalogue set with some numbers changed, or a kind with all its numbers."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": ["model", "length"]}, {"required": ["matrices"]}]}
    )

    model: Annotated[str | None, Word(track_models)] = None
    """A catalogue name, or "slab", "winkler", "beam" or "rigid" with all numbers given; "matrices" of files."""
    length: Annotated[Any, Quantity("m", 1.0, 20e3, words=("endless",))] = None
    """Length of the line [m], a slab track rounded up to whole fastener bays; "endless" steps a window around the
    vehicle, of a slab or winkler track. Of a track from matrices the node map says it."""
    elements_per_bay: Annotated[int | None, Count(1, 64)] = None
    """Beam elements per fastener bay of a slab track, 1 by default."""
    bay: Annotated[float | None, Quantity("m", 0.1, 10.0)] = None
    """Fastener spacing of a slab track [m]."""
    rail: Beam | None = None
    """Rail of a slab track, both rails in a whole model."""
    fastener: Suspension | None = None
    """Fastener seat of a slab track, both rails in a whole model."""
    slab: Beam | None = None
    """Slab of a slab track."""
    mortar: Bed | None = None
    """CA mortar of a slab track."""
    base: Beam | None = None
    """Base plate of a slab track."""
    subgrade: Bed | None = None
    """Subgrade of a slab track."""
    per: Annotated[str | None, Word(BED_UNITS)] = None
    """What mortar and subgrade are given per: "fastener" spacing or "metre"."""
    elements: Annotated[int | None, Count(1, _MOST_ELEMENTS)] = None
    """Number of beam elements of a winkler track or a beam."""
    EI: Annotated[float | None, BENDING_STIFFNESS] = None
    """Bending stiffness of a winkler track or a beam [N m2]."""
    mass: Annotated[float | None, LINE_MASS] = None
    """Mass of a winkler track or a beam [kg/m]."""
    stiffness: Annotated[float | None, Quantity("N/m^2", 1.0, 1e13)] = None
    """Bed stiffness of a winkler track [N/m2]."""
    damping: Annotated[float | None, Quantity("N*s/m^2", 0.0, 1e10)] = None
    """Bed damping of a winkler track [N s/m2]."""
    rayleigh: Rayleigh | None = None
    """Rayleigh damping of the whole track, none by default."""
    rails: Annotated[int | None, Count(1, 2)] = None
    """1: half model, one rail; 2: whole model. It labels the numbers, it never rescales them."""
    matrices: Matrices | None = None
    """M, C and K of the track from files, instead of numbers."""

    @property
    def kind(self) -> str:
        """Kind of track: "slab", "winkler", "beam", "rigid" or "matrices"."""
        if self.matrices is not None or self.model is None:
            return "matrices"
        if self.model in SLAB_TRACKS:
            return "slab"
        return "winkler" if self.model in WINKLER_TRACKS else self.model

    @property
    def endless(self) -> bool:
        """Whether the track has no ends."""
        return bool(self.length == "endless")

    @property
    def built_length(self) -> float:
        """Length as built [m]: a completed slab track has whole bays; inf for an endless one."""
        if self.endless:
            return math.inf
        if self.kind != "slab":
            return float(self.length)
        parameters = slab_parameters(self)
        return parameters.bay_count(self.length) * parameters.bay


def complete_track(section: TrackSection, findings: Findings) -> TrackSection:
    """Return the table with all numbers of its track.

    Args:
        section: The table as read.
        findings: Takes what is missing or does not belong.
    """
    kind, before = section.kind, len(findings.problems)
    if kind == "matrices":
        return _complete_matrices(section, findings)
    what = f'the track "{section.model}"' if section.model != kind else f"a {kind} track"
    refuse_foreign(section, "track", {"model", "length", *_KEYS[kind]}, what, findings)
    if section.endless and kind not in ("slab", "winkler"):
        findings.refuse(
            ("track", "length"), f"is for slab and winkler tracks; {what} has ends", accepted="a length [m]"
        )
        return section.model_copy(update={"length": 100.0})
    if kind == "slab":
        section = complete(section, "track", SlabParameters, _entry(section), findings)
        per_bay = section.elements_per_bay or 1
        if len(findings.problems) == before and not section.endless:
            count = slab_parameters(section).bay_count(section.length) * per_bay
            if count > _MOST_ELEMENTS:
                _refuse_elements(section, "elements_per_bay", count, findings)
        return section.model_copy(update={"elements_per_bay": per_bay})
    rayleigh = section.rayleigh.numbers() if section.rayleigh else (None, None)
    section = section.model_copy(update={"rayleigh": Rayleigh(alpha=rayleigh[0] or 0.0, beta=rayleigh[1] or 0.0)})
    if kind == "winkler":
        section = complete(section, "track", WinklerParameters, _entry(section), findings)
        if section.endless:
            if section.elements is not None:
                message = "cannot be given for an endless track, which takes its usual element length"
                findings.refuse(("track", "elements"), message, accepted="nothing")
        elif section.elements is None and len(findings.problems) == before:
            numbers = {name: getattr(section, name) for name in _WINKLER_NUMBERS}
            count = WinklerParameters(**numbers).usual_element_count(section.length)
            if count > _MOST_ELEMENTS:
                _refuse_elements(section, "elements", count, findings)
            section = section.model_copy(update={"elements": count})
    elif kind == "beam":
        for name, accepted in (("elements", f"1 to {_MOST_ELEMENTS}"), ("EI", "a bending stiffness"), ("mass", "kg/m")):
            if getattr(section, name) is None:
                findings.refuse(("track", name), "is missing", accepted=accepted)
    else:
        section = section.model_copy(update={"rayleigh": None})
    return section


def missing_keys(given: Iterable[str]) -> tuple[str, ...]:
    """Return the keys that a track of numbers must have and that are not there.

    Args:
        given: The keys that are there.
    """
    given = set(given)
    return () if "matrices" in given else tuple(name for name in ("model", "length") if name not in given)


def _complete_matrices(section: TrackSection, findings: Findings) -> TrackSection:
    if section.matrices is None:
        accepted = "{ mass, stiffness, nodes } and what else belongs to them"
        findings.refuse(("track", "matrices"), "is missing", accepted=accepted)
    elif section.model not in (None, "matrices"):
        message = "stands beside track.matrices"
        findings.refuse(("track", "model"), message, value=section.model, accepted='no track.model, or "matrices"')
    else:
        refuse_foreign(section, "track", {"model", *_KEYS["matrices"]}, "a track from matrices", findings)
    alpha, beta = section.rayleigh.numbers() if section.rayleigh else (None, None)
    update = {"model": "matrices", "rayleigh": Rayleigh(alpha=alpha or 0.0, beta=beta or 0.0)}
    return section.model_copy(update=update)


def slab_parameters(section: TrackSection) -> SlabParameters:
    """Return the numbers of a completed slab track."""
    return SlabParameters(**changes(section, None, _SLAB_NUMBERS))


def build_track(section: TrackSection) -> "Track":
    """Return the track of a completed table."""
    from tbatch.physics.track import Track

    entry = _entry(section)
    name = section.model if entry else None
    if section.kind == "slab":
        numbers = changes(section, entry, _SLAB_NUMBERS)
        return Track.slab(name, length=section.length, elements_per_bay=section.elements_per_bay or 1, **numbers)
    if section.kind == "rigid":
        return Track.rigid(length=section.length, rails=section.rails)
    rayleigh: Any = section.rayleigh.numbers() if section.rayleigh else (0.0, 0.0)
    if section.kind == "winkler":
        numbers = changes(section, entry, _WINKLER_NUMBERS)
        return Track.winkler(name, length=section.length, elements=section.elements, rayleigh=rayleigh, **numbers)
    numbers = changes(section, None, ("elements", "EI", "mass", "rails"))
    return Track.beam(length=section.length, rayleigh=rayleigh, **numbers)


def _refuse_elements(section: TrackSection, key: str, count: int, findings: Findings) -> None:
    message = f"gives {count} elements over {section.length:g} m"
    findings.refuse(("track", key), message, accepted=f"at most {_MOST_ELEMENTS} elements")


def _entry(section: TrackSection) -> Any:
    return SLAB_TRACKS.get(section.model or "") or WINKLER_TRACKS.get(section.model or "")
