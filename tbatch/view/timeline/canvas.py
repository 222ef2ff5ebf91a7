"""Charts that the viewer has no view for, drawn as lines and labels in the plane.

The viewer's plots run over a timeline alone and have linear axes (rerun 0.41): spectra and what is plotted along the
track are drawn here with axes of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from tbatch.view import palette
from tbatch.view.record import Array

MOST_TICKS = 8
HAIR, LINE = -0.6, -1.4  # line widths: negative ones are in points of the screen (rerun 0.41)
NUMBERS = 9.0  # from the numbers' middle to the axis [drawn units]
EDGE = 0.09  # room for the numbers, as a share of the drawn width


@dataclass(frozen=True)
class Axis:
    """One axis of a chart: its range, and where values stand on it."""

    low: float
    high: float
    length: float
    """Drawn length [drawn units]."""
    unit: str = ""
    """Written beside the last number."""
    log: bool = False
    downward: bool = False
    """Whether values increase down the page: positive displacements are downwards."""

    def place(self, values: Array | float) -> Array:
        """Distance of values from the axis's start, within its ends [drawn units]."""
        ends = np.array([self.low, self.high])
        with np.errstate(divide="ignore"):
            values, ends = (np.log10(values), np.log10(ends)) if self.log else (np.asarray(values), ends)
        return self.length * np.clip((values - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)

    def ticks(self) -> list[float]:
        """Round values along it: decades, or at most ``MOST_TICKS`` steps of 1, 2 or 5."""
        if self.log:
            decades = np.arange(np.ceil(np.log10(self.low) - 1e-9), np.floor(np.log10(self.high) + 1e-9) + 1)
            return [float(value) for value in 10.0 ** decades[:: max(1, -(-len(decades) // MOST_TICKS))]]
        rough = (self.high - self.low) / MOST_TICKS
        power = 10.0 ** np.floor(np.log10(rough))
        step = next(power * times for times in (1, 2, 5, 10) if power * times >= rough * (1 - 1e-9))
        first = np.ceil(self.low / step - 1e-9)
        return [float(step * n) + 0.0 for n in np.arange(first, np.floor(self.high / step + 1e-9) + 1)]  # + 0.0: no -0

    def written(self, value: float) -> str:
        """A tick's number; the last one bears the unit."""
        exponent = f"1e{round(np.log10(value))}" if self.log and not 1e-2 < value < 1e4 else f"{value:.4g}"
        return f"{exponent} {self.unit}" if self.unit and value == self.ticks()[-1] else exponent


@dataclass(frozen=True)
class Canvas:
    """A chart: an entity, an axis to the right and one up (or down) the page."""

    entity: str
    x: Axis
    y: Axis

    def points(self, x: Array, y: Array) -> Array:
        """Drawn places of points, last axis (right, down) [drawn units], in single precision."""
        up = self.y.place(y)
        down = up if self.y.downward else self.y.length - up
        return np.stack(np.broadcast_arrays(self.x.place(x), down), axis=-1).astype(np.float32)

    def send_axes(self, stream: rr.RecordingStream, *, above: Sequence[tuple[float, str]] = ()) -> None:
        """Send grid and numbers.

        Args:
            stream: The recording.
            above: Further marks on the upper edge, as x and text.
        """
        right, down = self.x.length, self.y.length
        strips = [[(0.0, 0.0), (right, 0.0), (right, down), (0.0, down), (0.0, 0.0)]]
        labels: list[tuple[float, float, str]] = []
        for value in self.x.ticks():
            at = float(self.x.place(value))
            strips.append([(at, 0.0), (at, down)])
            labels.append((at, down, self.x.written(value)))
        for value in self.y.ticks():
            at = float(self.points(np.array(self.x.low), np.array(value))[1])
            strips.append([(0.0, at), (right, at)])
            labels.append((-NUMBERS, at - 0.015 * down, self.y.written(value)))
        labels += [(float(self.x.place(value)), -0.09 * down, text) for value, text in above]
        grid = rr.LineStrips2D(strips, radii=HAIR, colors=palette.GRID, draw_order=-1.0)
        stream.log(f"{self.entity}/grid", grid, static=True, strict=True)
        numbers = rr.Points2D(
            [[x, y] for x, y, _ in labels],
            labels=[text for _, _, text in labels],
            show_labels=True,
            radii=0.0,
            colors=palette.MARK,
        )
        stream.log(f"{self.entity}/numbers", numbers, static=True, strict=True)

    def send_legend(self, stream: rr.RecordingStream, names: Sequence[str], colours: Sequence[palette.Colour]) -> None:
        """Send the names of curves in their colours, above the chart."""
        places = [[(0.5 + 0.07 * k) * self.x.length, -0.09 * self.y.length] for k in range(len(names))]
        legend = rr.Points2D(places, labels=list(names), show_labels=True, radii=0.0, colors=list(colours))
        stream.log(f"{self.entity}/legend", legend, static=True, strict=True)

    def send_curves(
        self, stream: rr.RecordingStream, name: str, x: Array, y: Array, colours: Sequence[palette.Colour]
    ) -> None:
        """Send curves that stay, as far as they lie within: x, shape (point,), and y, shape (point, curve)."""
        inside = (y >= self.y.low) & (y <= self.y.high)
        strips = [self.points(x[seen], column[seen]) for column, seen in zip(y.T, inside.T, strict=True)]
        lines = rr.LineStrips2D(strips, radii=LINE, colors=list(colours))
        stream.log(f"{self.entity}/{name}", lines, static=True, strict=True)

    def view(self, name: str) -> rrb.Spatial2DView:
        """A view that shows the whole chart."""
        right, down = self.x.length, self.y.length
        bounds = rrb.VisualBounds2D(
            x_range=[-EDGE * right, (1 + 0.5 * EDGE) * right], y_range=[-0.16 * down, (1 + 0.16) * down]
        )
        return rrb.Spatial2DView(
            origin=f"/{self.entity}",
            name=name,
            background=rrb.Background(color=palette.GROUND, kind=rrb.BackgroundKind.SolidColor),
            visual_bounds=bounds,
        )
