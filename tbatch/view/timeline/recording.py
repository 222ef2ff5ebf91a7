"""What a recording holds: the histories of one run as columns, on two timelines."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr

from tbatch.view import palette
from tbatch.view.deflection import under_wheels
from tbatch.view.record import Array, RunRecord, Separation
from tbatch.view.scene import body_names, build_scene
from tbatch.view.sheet import run_sheet
from tbatch.view.thinning import extremes, spaced_samples
from tbatch.view.timeline import side_view
from tbatch.view.timeline.charts import send_charts
from tbatch.view.timeline.clock import Clock
from tbatch.view.timeline.dashboard import POINTS_MAX, dashboard, force_overview

APPLICATION = "tbatch"
GRAIN = 2.0**-12  # forces Q/Q0 are plotted in whole multiples of it
FINENESS = 2.0**12  # grains in the largest value of any other plot, at least: pixels of a large screen
MOTION_INTERVAL, MOTION_TRAVEL = (
    0.5e-3,
    0.02,
)  # least time [s] and way [m] of slower motions; the slowest have half as many


def _partial(path: Path) -> Path:
    """Where to write until all is written: beside the file, or elsewhere where its name is no UTF-8.

    The recording library (rerun 0.41) takes UTF-8 alone; in the locale "C" any other letter of a path is a surrogate.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return Path(tempfile.mkdtemp(prefix="tbatch-")) / "run.rrd"
    return path.with_name(f".{path.name}.partial")


@contextmanager
def _heeded() -> Iterator[None]:
    """Writes the file that was asked for even where RERUN=off silences what a program shows while it runs."""
    silenced = os.environ.pop("RERUN", None)
    try:
        yield
    finally:
        if silenced is not None:
            os.environ["RERUN"] = silenced


def write(record: RunRecord, path: Path) -> Path:
    """Write the recording to a temporary name, then move it into place."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = _partial(path)
    scene = build_scene(record)
    clock = Clock(record)
    try:
        # Fixed ids and no start time: a run written twice is the same recording.
        identity = f"{record.campaign}-{record.name}" if record.campaign else record.name
        with _heeded(), rr.RecordingStream(APPLICATION, recording_id=identity, send_properties=False) as stream:
            stream.save(partial)
            stream.set_log_time_enabled(False)
            stream.send_recording_name(record.name)
            if record.properties:
                stream.send_property("run", _properties(record))
            stream.log("sheet", rr.TextDocument(run_sheet(record), media_type="text/markdown"), static=True)
            _histories(stream, record, clock)
            _contact(stream, record, clock)
            side_view.send(stream, record, scene, clock)
            charts = send_charts(stream, record, scene, clock)
            stream.send_blueprint(dashboard(record, scene, charts), make_active=True, make_default=True)
        shutil.move(partial, path)
    finally:
        partial.unlink(missing_ok=True)
        if partial.parent != path.parent:
            partial.parent.rmdir()
    return path


class _Cell:
    """One property's value as a batch of its own type.

    rr.AnyValues would fix a name's type for the whole process by the first value seen, and refuse 1.5 after 1
    (rerun 0.41).
    """

    def __init__(self, value: Any) -> None:
        self._value = value.item() if isinstance(value, np.generic) else value

    def as_arrow_array(self) -> pa.Array:
        return pa.array([self._value])


def _properties(record: RunRecord) -> list[rr.DescribedComponentBatch]:
    """Properties as the plain kinds that become columns of the viewer's table of runs."""
    return [
        rr.DescribedComponentBatch(_Cell(value), rr.ComponentDescriptor(name))
        for name, value in record.properties.items()
    ]


def _histories(stream: rr.RecordingStream, record: RunRecord, clock: Clock) -> None:
    """Send what is plotted: forces at every sample, slower motions at fewer."""
    n = record.samples
    time, position = np.asarray(record.time[:n]), np.asarray(record.position[:n])
    every = np.arange(n)
    fewer = spaced_samples(time, position, interval=MOTION_INTERVAL, travel=MOTION_TRAVEL)
    slow = fewer[::2]
    wheels = [(f"wheel {j + 1}", palette.wheel_colour(j)) for j in range(record.wheel_count)]
    force = record.force_ratio[:n]
    _series(stream, "force", wheels, clock.at(every), force, GRAIN)
    overview = force_overview(record)
    if overview != "force":
        blocks = np.arange(0, n, -(-2 * force.size // POINTS_MAX))
        at, rows = extremes(force, blocks)
        _series(stream, overview, wheels, clock.at(at), rows, GRAIN)
    under = under_wheels(record, fewer)
    if under is not None:
        _series(stream, "rail_deflection", wheels, clock.at(fewer), 1e3 * under)
    slab = under_wheels(record, slow, "slab")
    if slab is not None:
        _series(stream, "slab_deflection", wheels, clock.at(slow), 1e3 * slab)
    if record.irregularity is not None:
        _series(stream, "irregularity", wheels, clock.at(fewer), 1e3 * record.irregularity[fewer])
    sprung = [body for body in record.bodies if body.kind != "wheelset"]
    dofs = [body.vertical_dof for body in sprung]
    looks = list(zip(body_names(sprung), palette.body_colours(len(sprung)), strict=True))
    if dofs and record.vehicle is not None:
        _series(stream, "displacement", looks, clock.at(slow), 1e3 * record.vehicle[slow][:, dofs])
    if dofs and record.vehicle_acceleration is not None:
        at, rows = extremes(np.asarray(record.vehicle_acceleration)[:n, dofs], slow)
        _series(stream, "acceleration", looks, clock.at(at), rows)
    unsprung = [body.vertical_dof for body in record.bodies if body.kind == "wheelset"]
    if len(unsprung) == record.wheel_count and record.vehicle_acceleration is not None:
        at, rows = extremes(np.asarray(record.vehicle_acceleration)[:n, unsprung], slow)
        _series(stream, "wheel_acceleration", wheels, clock.at(at), rows)


def _series(
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


def _contact(stream: rr.RecordingStream, record: RunRecord, clock: Clock) -> None:
    """Send the contact lanes, and every separation as a line of text and a mark on the force plot."""
    last = float(record.time[record.samples - 1])
    for j in range(record.wheel_count):
        mine = [event for event in record.events if event.wheel == j]
        changes: list[tuple[float, str]] = [(float(record.time[0]), "contact")]
        for event in mine:
            changes.append((event.start, "separated"))
            if event.end < last or not event.censored:
                changes.append((event.end, "contact"))
        states = dict(sorted(changes, key=lambda change: change[0]))  # the later of two at one time wins
        look = rr.StateConfiguration(
            values=["contact", "separated"],
            labels=[" ", "off"],  # an empty one is replaced by the value (rerun 0.41)
            colors=[palette.CONTACT, palette.WARNING],
        )
        entity = f"contact/wheel_{j + 1}"
        stream.log(entity, look, static=True, strict=True)
        columns = rr.StateChange.columns(state=list(states.values()))
        stream.send_columns(entity, clock.when(list(states)), columns, strict=True)
    _events(stream, record, clock)


def _events(stream: rr.RecordingStream, record: RunRecord, clock: Clock) -> None:
    """Send the start, every separation and the end as lines of text, and a mark on the force plot for each."""
    ends = [float(record.time[0]), float(record.time[record.samples - 1])]
    count = len(record.events)
    total = "no separation" if not count else f"{count} separation{'s' if count > 1 else ''}"
    text = rr.TextLog.columns(text=["start", f"end: {total}"], level=["INFO"] * 2, color=[palette.RAIL] * 2)
    stream.send_columns("events", clock.when(ends), text, strict=True)
    if not count:
        return
    starts = [event.start for event in record.events]
    text = rr.TextLog.columns(
        text=[_sentence(event) for event in record.events],
        level=["WARN"] * count,
        color=[palette.wheel_colour(event.wheel) for event in record.events],
    )
    stream.send_columns("events", clock.when(starts), text, strict=True)
    mark = rr.SeriesPoints(colors=[palette.WARNING], markers=["diamond"], marker_sizes=[4.0], names=["separation"])
    times = sorted(set(starts))
    for plot in {"force", force_overview(record)}:
        entity = f"{plot}/separation"
        stream.log(entity, mark, static=True, strict=True)
        marks = rr.Scalars.columns(scalars=np.zeros(len(times)))
        stream.send_columns(entity, clock.when(times), marks, strict=True)


def _sentence(event: Separation) -> str:
    """One separation in words."""
    length = 1e3 * (event.end - event.start)
    parts = [f"{event.start:.4f} s  wheel {event.wheel + 1} off {length:.1f} ms at {event.position:.2f} m"]
    if np.isfinite(event.gap):
        parts.append(f"gap {1e3 * event.gap:.2f} mm")
    if np.isfinite(event.landing_force) and event.landing_force > 0:
        parts.append(f"landing {1e-3 * event.landing_force:.0f} kN")
    if event.censored:
        parts.append("cut off")
    return ", ".join(parts)
