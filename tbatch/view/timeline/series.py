"""Plotted lines: series that share their times as one entity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from tbatch.view import palette
from tbatch.view.record import Array
from tbatch.view.thinning import spaced_samples
from tbatch.view.timeline.clock import Clock, Timed

RANGES = "range"  # entity above those of all ranges
RANGE_INTERVAL, RANGE_TRAVEL = 4e-3, 0.3  # least time [s] and way [m] between samples of a range
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


def send_range(stream: rr.RecordingStream, entity: str, clock: Clock, run: Timed, values: Array) -> None:
    """Send a run's range of values as unseen lines, so that close-ups keep one scale as the cursor moves.

    A range in the layout would be that of one run for all (rerun 0.41).

    Args:
        stream: The recording.
        entity: The plot that it is for.
        clock: Stamps the run's samples.
        run: The run.
        values: All that is plotted, any shape.
    """
    low, high = float(np.min(values)), float(np.max(values))
    room = 0.05 * (high - low) or 0.1
    n = run.samples
    time, position = np.asarray(run.time[:n]), np.asarray(run.position[:n])
    at = spaced_samples(time, position, interval=RANGE_INTERVAL, travel=RANGE_TRAVEL)
    unseen = rr.SeriesLines(
        colors=[(0, 0, 0, 0)] * 2, widths=[0.1] * 2, names=["range"] * 2, aggregation_policy="MinMax"
    )
    stream.log(f"{RANGES}/{entity}", unseen, static=True, strict=True)
    rows = np.tile([low - room, high + room], len(at))
    columns = rr.Scalars.columns(scalars=rows).partition(np.full(len(at), 2))
    stream.send_columns(f"{RANGES}/{entity}", clock.at(at), columns, strict=True)


def _grain(values: Array) -> float:
    """A power of two that no eye tells from nothing beside the largest of the values."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return 2.0 ** np.ceil(np.log2(largest / FINENESS / 2.0)) if largest > 0.0 else 1.0


def _shortened(values: Array, grain: float) -> Array:
    """Round to whole multiples of a grain, away from zero so that only zero is zero: short fractions pack better."""
    scaled = np.asarray(values, float) / grain
    return np.copysign(np.ceil(np.abs(scaled)), scaled) * grain
