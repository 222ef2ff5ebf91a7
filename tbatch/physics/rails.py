"""Half and whole models: one rail or two, never mixed."""

from typing import Protocol


class Railed(Protocol):
    """Anything that says how many rails its numbers stand for."""

    @property
    def rails(self) -> int | None:
        """1 (half), 2 (whole) or None (either)."""
        ...

    @property
    def name(self) -> str:
        """Name for messages."""
        ...


def common_rails(vehicle: Railed, track: Railed) -> int:
    """Return the rails of the model of `vehicle` on `track`: 1 (half) or 2 (whole).

    Where only one of the two says it, that one decides; where neither does, the model is a half one, so that a contact
    law given by wheel radius is that of one wheel. Different ones are refused: the factor two between them is in every
    mass, stiffness and force, and nothing here rescales.
    """
    if vehicle.rails is not None and track.rails is not None and vehicle.rails != track.rails:
        raise ValueError(
            f"vehicle {vehicle.name!r} has rails = {vehicle.rails} ({_word(vehicle.rails)}) but track {track.name!r} "
            f"has rails = {track.rails} ({_word(track.rails)}): both must be half or both whole"
        )
    return vehicle.rails or track.rails or 1


def _word(rails: int) -> str:
    return "half model" if rails == 1 else "whole model"
