"""Keys that are known but not yet available: taken out of a document before it is checked, each with a refusal."""

from typing import Any

from tbatch.scenario.errors import Problem, shown

DEFECT_KINDS = ("chord-flat", "periodic-flat", "joint", "weld", "settlement", "corrugation")

_KEYS: dict[tuple[str, ...], str] = {
    ("vehicle", "coach_pitch"): "leave it out; one vehicle is run",
    ("track", "sections"): "leave it out; the track is the same along the line",
}


def take_out_later(document: dict[str, Any]) -> list[Problem]:
    """Remove from a document what is not yet available, and return a problem for each.

    Args:
        document: The parsed scenario; it is changed.
    """
    problems = []
    for path, accepted in _KEYS.items():
        table = _at(document, path[:-1])
        if isinstance(table, dict) and path[-1] in table:
            value = table.pop(path[-1])
            told = None if isinstance(value, dict | list) else shown(value)
            problems.append(Problem(path, "is not yet available", told, accepted))
    track = document.get("track")
    if isinstance(track, dict) and isinstance(track.get("model"), str) and "ballast" in track["model"]:
        told = shown(track.pop("model"))
        problems.append(
            Problem(("track", "model"), "is a ballasted track: not yet available", told, "another track.model")
        )
    vehicle = document.get("vehicle")
    if isinstance(vehicle, dict) and type(count := vehicle.get("count")) is int and count > 1:
        del vehicle["count"]
        problems.append(Problem(("vehicle", "count"), "vehicles are not yet available", shown(count), "1"))
    roughness = document.get("irregularity")
    defects = roughness.get("defect") if isinstance(roughness, dict) else None
    if not isinstance(defects, list):
        return problems
    for index, defect in enumerate(defects):
        if isinstance(defect, dict) and defect.get("kind") in DEFECT_KINDS:
            place = ("irregularity", "defect", index, "kind")
            problems.append(Problem(place, "is not yet available", shown(defect["kind"]), '"flat"'))
            defects[index] = {"kind": "flat", "at": 0.0, "depth": 0.0, "length": 1.0}  # its other keys are not ours
    return problems


def _at(document: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        document = document.get(key) if isinstance(document, dict) else None
    return document
