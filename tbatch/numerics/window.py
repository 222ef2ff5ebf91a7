"""The window that is stepped in place of an endless track, and how long it must be.

When the vehicle has advanced one period, the state moves back by one period, zeros enter at the front, and K̂ stays
what it was. The shift is exact; the window's pinned ends are not. What they send back is measured on the track itself:
a pulse in the middle of a line, against a line of twice the length.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tbatch.numerics.scipy_track import ScipyTrack
from tbatch.numerics.two_step import TwoStep
from tbatch.physics.line import Line

MARGINS = (10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0, 360.0)
"""Lengths of track beyond the outer wheels that are tried [m]."""
PULSE = 2.6e-3
"""Length of the half-sine pulse [s]: half a period of a wheel on its contact spring."""
LISTENED = 0.25
"""Time during which an echo counts [s]."""
STEP = 2e-4
"""Step of the measurement [s]."""


@dataclass(frozen=True)
class Window:
    """How the stepped line follows the vehicle; a finite line stays where it is."""

    period: float
    """The line moves by this much at a time [m]; 0 for a finite line."""
    period_elements: int
    """The same in elements."""
    home: float
    """Where wheel 1 stands on the line when it moves on [m]; inf for a finite line."""
    margin: float
    """Length of line beyond the outer wheels [m]."""
    echo: float
    """Largest echo of a pulse from the line's ends, relative to the pulse's own peak [-]."""

    @classmethod
    def fixed(cls) -> "Window":
        """The window of a finite line."""
        return cls(period=0.0, period_elements=0, home=np.inf, margin=0.0, echo=0.0)

    def passed(self, position: float) -> int:
        """Periods that the line must have moved by for wheel 1 at x = `position` [m]."""
        return 0 if self.period == 0.0 else int(np.floor((position - self.home) / self.period)) + 1


@lru_cache(maxsize=8)
def make_window(track: Line, wheelbase: float, tolerance: float) -> tuple[Line, Window]:
    """The line that is stepped in place of an endless track; the last few stay known, as the measurement takes seconds.

    Args:
        track: The endless track.
        wheelbase: Distance of the last wheel behind the first [m].
        tolerance: Largest echo accepted, relative to the pulse [-].

    Returns:
        The line and how it follows the vehicle. The echo is the largest difference that the ends make to the deflection
        under the pulse, relative to its peak.

    Raises:
        ValueError: If no margin up to the longest tried is enough.
    """
    if track.window is None:
        raise ValueError("track: only an endless one has a window")
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"window_tolerance = {tolerance!r}: a number between 0 and 1 (exclusive) is required")
    echo = np.inf
    responses: dict[float, np.ndarray] = {}
    for margin in MARGINS:
        # Twice one margin is often another.
        for length in (margin, 2.0 * margin):
            if length not in responses:
                responses[length] = _pulse_response(track, length)
        near, far = responses[margin], responses[2.0 * margin]
        echo = float(np.abs(near - far).max() / np.abs(far).max())
        if echo <= tolerance:
            break
    else:
        raise ValueError(
            f"window_tolerance = {tolerance:g}: the ends still send back {echo:.2g} of a pulse at {MARGINS[-1]:g} m "
            "beyond the wheels; more damping or a larger tolerance is needed"
        )
    period = track.period * track.element_length
    line = track.window(2.0 * margin + wheelbase + period)
    return line, Window(period, track.period, margin + wheelbase + period, margin, echo)


def _pulse_response(track: Line, margin: float) -> np.ndarray:
    """Deflection under a half-sine pulse on a seat, with `margin` of track to either side [m per N], shape (step,)."""
    assert track.window is not None
    period = track.period * track.element_length
    to_side = int(np.ceil(margin / period))
    line = track.window(2 * to_side * period)
    solver = ScipyTrack(line, TwoStep(STEP))
    row = to_side * track.period * line.node_dofs
    size = line.node_count * line.node_dofs
    u, v, load = np.zeros(size), np.zeros(size), np.zeros(size)
    response = []
    for n in range(round(LISTENED / STEP)):
        forces = [_pulse(time) for time in (n * STEP, (n + solver.scheme.splitting) * STEP, (n + 1) * STEP)]
        first, second = load.copy(), load.copy()
        first[row], second[row] = forces[0] + forces[1], forces[2]
        u, v = solver.advance(u, v, first, second)
        response.append(u[row])
    return np.array(response)


def _pulse(time: float) -> float:
    return float(np.sin(np.pi * time / PULSE)) if 0.0 < time < PULSE else 0.0
