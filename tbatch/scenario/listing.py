"""What there is to choose from: vehicles, tracks, spectra and scenarios."""

from tbatch.physics.catalogue.spectra import SPECTRA
from tbatch.physics.catalogue.tracks import SLAB_TRACKS, WINKLER_TRACKS
from tbatch.physics.catalogue.vehicles import COACHES, COLUMNS
from tbatch.scenario.errors import did_you_mean
from tbatch.scenario.source import shipped_scenarios

KINDS = ("vehicles", "tracks", "spectra", "scenarios")


def list_catalogue(kind: str) -> list[tuple[str, str]]:
    """Return the names of a kind, each with one line that says what it is and where it is from.

    Args:
        kind: "vehicles", "tracks", "spectra" or "scenarios".
    """
    if kind == "vehicles":
        coaches = [
            (name, f"coach, 10 dofs, {_mass(entry.carbody_mass)}: {entry.source}") for name, entry in COACHES.items()
        ]
        columns = [
            (name, f"column, 3 dofs, {_mass(entry.carbody_mass)}: {entry.source}") for name, entry in COLUMNS.items()
        ]
        return coaches + columns
    if kind == "tracks":
        slabs = [(name, f"three-layer slab track, bays of {t.bay:g} m: {t.source}") for name, t in SLAB_TRACKS.items()]
        beds = [(name, f"beam on a continuous bed: {t.source}") for name, t in WINKLER_TRACKS.items()]
        return slabs + beds
    if kind == "spectra":
        return [(name, f"{s.source}; {s.band[0]:.3g} to {s.band[1]:.3g} m") for name, s in SPECTRA.items()]
    if kind == "scenarios":
        return [(name, _headline(path.read_text(encoding="utf-8"))) for name, path in shipped_scenarios().items()]
    raise ValueError(f"list {kind!r}: accepted are {', '.join(KINDS)}{did_you_mean(kind, KINDS)}")


def _mass(kilograms: float) -> str:
    return f"carbody {kilograms / 1000.0:.4g} t"


def _headline(text: str) -> str:
    """Return the first comment line of a scenario."""
    first = text.lstrip().split("\n", 1)[0]
    return first.removeprefix("#").strip() if first.startswith("#") else ""
