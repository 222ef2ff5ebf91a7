"""Plotted lines: series that share their times as one entity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from tbatch.view import palette
from tbatch.view.record import Array

GRAIN = 2.0**-12  # forces Q/Q0 are plotted in whole multiples of it
FINENESS = 2.0**12  # grains in the largest value of any other plot, at least: pixels of a large screen


def send_series(
    stream: rr.RecordingStream,
    entity: str,
    looks: Sequence[tuple[str, palette.Colour]],
    times: Sequence[rr.TimeColumn],
    values: Array,
    grain: float | None = None,
) -> None:
    """Send series that share their times as one entity: a third of the size of one entity each."""
    names, colours = [name for name, _ in looks], [colour for _, colour in looks]
    count = len(looks)
    # MinMax, or the viewer averages the samples of a pixel and a separation vanishes (rerun 0.41 default).
    lines = rr.SeriesLines(names=names, colors=colours, widths=[1.3] * count, aggregation_policy="MinMax")
    stream.log(entity, lines, static=True, strict=True)
    short = _shortened(values, grain or _grain(values))
    columns = rr.Scalars.columns(scalars=short.ravel()).partition(np.full(len(values), count))
    stream.send_columns(entity, times, columns, strict=True)


def _grain(values: Array) -> float:
    """A power of two that no eye tells from nothing beside the largest of the values."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return 2.0 ** np.ceil(np.log2(largest / FINENESS / 2.0)) if largest > 0.0 else 1.0


def _shortened(values: Array, grain: float) -> Array:
    """Round to whole multiples of a grain, away from zero so that only zero is zero: short fractions pack better."""
    scaled = np.asarray(values, float) / grain
    return np.copysign(np.ceil(np.abs(scaled)), scaled) * grain
