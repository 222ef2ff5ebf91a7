"""Level: a measured running surface, points of chainage and level joined by a cubic spline."""

import math
import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.partition import Piece, points
from tbatch.physics.profile import Profile

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

FloatArray = NDArray[np.float64]

_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}
_VALUE_ERROR = 1e-8  # m, of the profile against the spline through the points
_FINEST = 64  # knots of the profile per point of the file, at most


@dataclass(frozen=True, eq=False)
class Level:
    """A measured level: the C² cubic spline (not-a-knot) through its points. It has no value beyond them."""

    x: FloatArray
    """chainage, strictly increasing [m], shape (point,)"""
    r: FloatArray
    """level, positive where the rail is lower [m], shape (point,)"""
    period = math.inf
    everywhere = False
    _spline: "CubicSpline" = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the points and fit the spline."""
        x, r = np.array(self.x, dtype=np.float64), np.array(self.r, dtype=np.float64)
        if x.ndim != 1 or x.shape != r.shape or x.size < 4:
            raise ValueError(f"x, r have shapes {x.shape}, {r.shape}: accepted are two vectors of at least 4 points")
        if not (np.isfinite(x).all() and np.isfinite(r).all()):
            raise ValueError("x, r of a measured level have a value that is not finite [m]")
        backward = np.flatnonzero(np.diff(x) <= 0.0)
        if backward.size:
            i = int(backward[0])
            raise ValueError(f"x of a measured level must increase: x[{i + 1}] = {x[i + 1]:g} m follows {x[i]:g} m")
        for name, value in (("x", x), ("r", r)):
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        from scipy.interpolate import CubicSpline  # 0.15 s, which a scenario without a measured level need not wait

        object.__setattr__(self, "_spline", CubicSpline(self.x, self.r))

    @property
    def shortest_wavelength(self) -> float:
        """The shortest wavelength that points at this distance can show [m]."""
        return 2.0 * float(np.median(np.diff(self.x)))

    def _check(self, low: float, high: float) -> None:
        # An interval's round-off is no reason to refuse a span that ends where the data end.
        margin = 1e-9
        if low < self.x[0] - margin or high > self.x[-1] + margin:
            raise ValueError(
                f"measured level is asked for x = {low:.6g} ... {high:.6g} m, but its points reach"
                f" from {self.x[0]:.6g} to {self.x[-1]:.6g} m"
            )

    def __call__(self, x: FloatArray) -> FloatArray:
        """The spline at any points between the first and the last of the file [m]."""
        if x.size:
            self._check(float(x.min()), float(x.max()))
        return self._spline(x)

    def pieces(self, low: float, high: float) -> list[Piece]:
        """One piece, if the points reach that far, with knots so dense that they follow the spline through them."""
        self._check(low, high)
        typical = float(np.median(np.diff(self.x)))
        per_point = 4
        while True:
            spacing = typical / per_point
            # Off the ends by odd fractions, so that knots which happen to fall on the points do not flatter the test.
            shift = min(spacing, 0.1 * (high - low))
            test = Piece(low + 0.37 * shift, high - 0.21 * shift, spacing)
            x = points(test.low, 0.5 * test.width, 2 * test.intervals)[1::2]
            error = np.abs(Profile.from_pieces([test], self.on_grid)(x) - self._spline(x))
            worst = int(np.argmax(error))
            if error[worst] > _VALUE_ERROR and per_point < _FINEST:
                per_point *= 2
                continue
            if error[worst] > _VALUE_ERROR:
                warnings.warn(
                    f"measured level near x = {x[worst]:.4f} m changes faster than its typical spacing of"
                    f" {typical:.4g} m resolves: its profile is {error[worst] * 1e6:.3g} um off the spline through the"
                    f" points (wanted {_VALUE_ERROR * 1e6:g} um)",
                    stacklevel=2,
                )
            return [Piece(low, high, spacing)]

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The spline at ``low + width * j``, j = 0 ... count [m]."""
        return self(points(low, width, count))


def read_level(path: str | Path, *, unit: str = "mm", up: bool = False) -> tuple[FloatArray, FloatArray]:
    """Read a measured level from a text file of two columns, chainage in m and level.

    Columns are separated by blanks, tabs, commas or semicolons (with semicolons a decimal comma is understood). Blank
    lines, what follows a ``#`` and one heading line are skipped.

    Args:
        path: the file.
        unit: unit of the level: m, cm, mm, um.
        up: whether the file counts the level positive upwards; r is positive where the rail is lower.

    Returns:
        The chainage x [m] and r [m], both shape (point,).
    """
    if unit not in _UNITS:
        raise ValueError(f"unit = {unit!r}: accepted for the level of a measured file are m, cm, mm, um")
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a text file (UTF-8): {error.reason}") from error
    rows: list[tuple[float, float]] = []
    first_line = True
    for number, line in enumerate(lines, start=1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        if ";" in text:
            words = [w.strip().replace(",", ".") for w in text.split(";")]
        else:
            words = re.split(r"\s*,\s*|\s+", text)
        values = [value for value in map(_number, words) if value is not None]
        is_heading = first_line and not values
        first_line = False
        if is_heading:
            continue
        if len(values) < len(words):
            raise ValueError(f"{path}, line {number}: {text!r} is not two numbers, chainage [m] and level")
        if len(values) != 2:
            raise ValueError(f"{path}, line {number}: {len(values)} columns, accepted are two: chainage [m] and level")
        if not all(math.isfinite(v) for v in values):
            raise ValueError(f"{path}, line {number}: {text!r} is not finite")
        if rows and values[0] <= rows[-1][0]:
            raise ValueError(
                f"{path}, line {number}: chainage {values[0]:g} m does not lie beyond the point before"
                f" ({rows[-1][0]:g} m)"
            )
        rows.append((values[0], values[1]))
    if len(rows) < 4:
        raise ValueError(f"{path}: {len(rows)} points, at least 4 are needed")
    x, level = np.array(rows).T
    return x.copy(), (-_UNITS[unit] if up else _UNITS[unit]) * level


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None
