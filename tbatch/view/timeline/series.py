"""Plotted lines: series that share their times as one entity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from tbatch.view import palette
from tbatch.view.record import Array
from tbatch.view.thinning import Samples, curve_samples, spaced_samples
from tbatch.view.timeline.clock import Clock, Timed

RANGES = "range"  # entity above those of all ranges
RANGE_INTERVAL, RANGE_TRAVEL = 4e-3, 0.3  # least time [s] and way [m] between samples of a range
GRAIN = 2.0**-12  # forces Q/Q0 are plotted in whole multiples of it, or of less
FINENESS = 2.0**12  # grains in the range of a plot, at least: pixels of a large screen
TOLERANCE = 2.0**-11  # of its range: what a line between samples of a plot may miss
FORCE_DENSITY, MOTION_DENSITY = 160.0, 100.0
"""Most samples to a metre of forces and of slower motions [1/m]: they hold a recording's size at any speed."""
FEW_SAMPLES = 2000  # a short run may have as many, whatever its length
GAP_TIME, GAP_TRAVEL = 10e-3, 0.05  # between samples of a plot is no more than the longer: close-ups are not empty


def send_series(
    stream: rr.RecordingStream,
    entity: str,
    looks: Sequence[tuple[str, palette.Colour]],
    times: Sequence[rr.TimeColumn],
    values: Array,
    grain: float | None = None,
) -> None:
    """Send series that share their times as one entity: a third of the size of one entity each.

    Args:
        stream: The recording.
        entity: Where to.
        looks: Name and colour of each series.
        times: Of the rows.
        values: Rows, shape (row, series).
        grain: Values are rounded to whole multiples of it, or of less where their range is small.
    """
    names, colours = [name for name, _ in looks], [colour for _, colour in looks]
    count = len(looks)
    # MinMax, or the viewer averages the samples of a pixel and a separation vanishes (rerun 0.41 default).
    lines = rr.SeriesLines(names=names, colors=colours, widths=[1.3] * count, aggregation_policy="MinMax")
    stream.log(entity, lines, static=True, strict=True)
    short = _shortened(values, min(grain or np.inf, _grain(values)))
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


def plotted_samples(run: Timed, values: Array, *, kept: Samples | None = None, density: float) -> Samples:
    """Pick the samples that plot curves: turning points, and what a line between samples would miss.

    Args:
        run: The run.
        values: Its curves, shape (n, series).
        kept: Samples that are picked in any case.
        density: Most samples to a metre beside those; curves that need more are drawn with a larger tolerance [1/m].
    """
    n = run.samples
    time, position = np.asarray(run.time[:n]), np.asarray(run.position[:n])
    regular = spaced_samples(time, position, interval=GAP_TIME, travel=GAP_TRAVEL)
    if kept is not None:
        regular = np.union1d(regular, kept)
    tolerance = TOLERANCE * float(np.ptp(values))
    if not tolerance > 0.0:
        return regular
    most = max(int(density * float(position[-1] - position[0])), FEW_SAMPLES)
    return curve_samples(time, values, regular, tolerance=tolerance, most=most)[0]


def contact_changes(force: Array) -> Samples:
    """The samples before and after each loss of contact and each landing, of forces of shape (n, wheel)."""
    changed = np.flatnonzero(np.diff(force == 0.0, axis=0).any(axis=1))
    return np.union1d(changed, changed + 1)


def _grain(values: Array) -> float:
    """A power of two that no eye tells from nothing beside the range of the values."""
    span = float(np.ptp(values)) or float(np.max(np.abs(values), initial=0.0))
    return 2.0 ** np.ceil(np.log2(span / FINENESS / 2.0)) if span > 0.0 else 1.0


def _shortened(values: Array, grain: float) -> Array:
    """Round to whole multiples of a grain, away from zero so that only zero is zero: short fractions pack better."""
    scaled = np.asarray(values, float) / grain
    return np.copysign(np.ceil(np.abs(scaled)), scaled) * grain
