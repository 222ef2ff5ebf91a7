"""The rules by which separations are counted, in plain Python from a full-rate history."""

from dataclasses import dataclass

import numpy as np

LANDING_WINDOW = 5e-3


@dataclass(frozen=True)
class Separation:
    """One separation of one wheel."""

    start: int
    """First step end without contact."""
    end: int
    """First later step end with contact; the last step if there is none."""
    position: float
    """[m]."""
    gap: float
    """[m]."""
    landing_force: float
    """[N]; 0 if it did not land."""
    censored: bool


def separations(
    force: np.ndarray, overlap: np.ndarray, position: np.ndarray, *, beyond: float, separation: float, step: float
) -> list[Separation]:
    """All separations of one wheel.

    Args:
        force: F at t_0 ... t_n [N].
        overlap: δ [m].
        position: x of the wheel [m].
        beyond: The evaluated part is x > beyond [m], after t_0.
        separation: δ_sep [m].
        step: Δt [s].
    """
    last = len(force) - 1
    evaluated = [n for n in range(1, last + 1) if position[n] > beyond]
    if not evaluated:
        return []
    first, window = evaluated[0], int(LANDING_WINDOW / step + 1e-9)
    starts = [n for n in evaluated if force[n] == 0.0 and (n == first or force[n - 1] > 0.0)]
    found = []
    for number, start in enumerate(starts):
        landed = [n for n in range(start, last + 1) if force[n] > 0.0]
        end = landed[0] if landed else last
        apart = overlap[start:end] if landed else overlap[start:]
        until = min(end + window, last, starts[number + 1] - 1 if number + 1 < len(starts) else last)
        found.append(
            Separation(
                start=start,
                end=end,
                position=position[start],
                gap=max((separation - apart).max(), 0.0),
                landing_force=force[end : until + 1].max() if landed else 0.0,
                censored=not landed or (start == first and force[first - 1] == 0.0),
            )
        )
    return found
