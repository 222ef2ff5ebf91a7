"""Defects: local shapes of the running surface, with breaks where they begin and end."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.partition import Piece, points

FloatArray = NDArray[np.float64]

VALUE_ERROR = 1e-9
"""largest error of a known shape on its spline [m]"""


def wave_spacing(wavenumber: float, amplitude: float, error: float = VALUE_ERROR) -> float:
    """The largest distance between knots at which a splined cosine stays within a value error [m].

    A cubic spline through a cosine of angular wavenumber ω on knots h apart is wrong by a (ωh)⁴/384 at most.
    """
    if wavenumber == 0.0 or amplitude == 0.0:
        return math.inf
    return (384.0 * error / abs(amplitude)) ** 0.25 / (2.0 * math.pi * wavenumber)


@dataclass(frozen=True, eq=False)
class Flat:
    """A rounded wheel flat or dip: r = ½ d (1 - cos 2πs/l) for 0 ≤ s = x - at ≤ l."""

    depth: float
    """d, positive for a dip [m]"""
    length: float
    """l [m]"""
    at: float
    """x where it begins [m]"""
    period = math.inf
    shortest_wavelength = math.inf
    everywhere = True

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, value in (("depth", self.depth), ("length", self.length), ("at", self.at)):
            if not math.isfinite(value):
                raise ValueError(f"{name} = {value!r}: accepted for a flat is a finite number [m]")
        if self.length <= 0.0:
            raise ValueError(f"length = {self.length!r}: accepted for a flat is a length above 0 m")

    def __call__(self, x: FloatArray) -> FloatArray:
        """The shape at any points [m]."""
        s = np.clip((x - self.at) / self.length, 0.0, 1.0)
        return 0.5 * self.depth * (1.0 - np.cos(2.0 * np.pi * s))

    def pieces(self, low: float, high: float) -> list[Piece]:
        """Nothing, the shape, nothing."""
        spacing = min(wave_spacing(1.0 / self.length, 0.5 * self.depth), self.length / 16.0)
        end = self.at + self.length
        cuts = [(-math.inf, self.at, math.inf), (self.at, end, spacing), (end, math.inf, math.inf)]
        return [Piece(max(a, low), min(b, high), h) for a, b, h in cuts if a < high and b > low]

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The shape at ``low + width * j``, j = 0 ... count [m]."""
        return self(points(low, width, count))
