"""What a recording holds: the histories of one run as columns, on two timelines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr

from tbatch.view import palette
from tbatch.view.deflection import under_wheels
from tbatch.view.record import RunRecord
from tbatch.view.scene import body_names, build_scene
from tbatch.view.sheet import run_sheet
from tbatch.view.thinning import extremes, spaced_samples
from tbatch.view.timeline import side_view
from tbatch.view.timeline.charts import send_charts
from tbatch.view.timeline.clock import Clock
from tbatch.view.timeline.contact import send_events, send_lane, send_marks
from tbatch.view.timeline.dashboard import dashboard, force_overview
from tbatch.view.timeline.file import recording_file
from tbatch.view.timeline.layout import POINTS_MAX
from tbatch.view.timeline.series import GRAIN, send_range, send_series

MOTION_INTERVAL, MOTION_TRAVEL = 0.5e-3, 0.02
"""Least time [s] and way [m] between samples of slower motions; the slowest have half as many."""
FORCES_SHOWN = (0.0, 2.0)  # Q/Q0 that close-ups show at least


def write(record: RunRecord, path: Path) -> Path:
    """Write the recording."""
    scene = build_scene(record)
    clock = Clock(record)
    identity = f"{record.campaign}-{record.name}" if record.campaign else record.name
    with recording_file(path, identity, name=record.name) as stream:
        if record.properties:
            stream.send_property("run", _properties(record))
        stream.log("sheet", rr.TextDocument(run_sheet(record), media_type="text/markdown"), static=True)
        _histories(stream, record, clock)
        _contact(stream, record, clock)
        side_view.send(stream, record, scene, clock)
        charts = send_charts(stream, record, scene, clock)
        stream.send_blueprint(dashboard(record, charts), make_active=True, make_default=True)
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
    send_series(stream, "force", wheels, clock.at(every), force, GRAIN)
    send_range(stream, "force", clock, record, np.append(force.ravel(), FORCES_SHOWN))
    overview = force_overview(record)
    if overview != "force":
        blocks = np.arange(0, n, -(-2 * force.size // POINTS_MAX))
        at, rows = extremes(force, blocks)
        send_series(stream, overview, wheels, clock.at(at), rows, GRAIN)
    under = under_wheels(record, fewer)
    if under is not None:
        send_series(stream, "rail_deflection", wheels, clock.at(fewer), 1e3 * under)
        send_range(stream, "rail_deflection", clock, record, 1e3 * under)
    slab = under_wheels(record, slow, "slab")
    if slab is not None:
        send_series(stream, "slab_deflection", wheels, clock.at(slow), 1e3 * slab)
        send_range(stream, "slab_deflection", clock, record, 1e3 * slab)
    if record.irregularity is not None:
        send_series(stream, "irregularity", wheels, clock.at(fewer), 1e3 * record.irregularity[fewer])
    sprung = [body for body in record.bodies if body.kind != "wheelset"]
    dofs = [body.vertical_dof for body in sprung]
    looks = list(zip(body_names(sprung), palette.body_colours(len(sprung)), strict=True))
    if dofs and record.vehicle is not None:
        send_series(stream, "displacement", looks, clock.at(slow), 1e3 * record.vehicle[slow][:, dofs])
    if dofs and record.vehicle_acceleration is not None:
        at, rows = extremes(np.asarray(record.vehicle_acceleration)[:n, dofs], slow)
        send_series(stream, "acceleration", looks, clock.at(at), rows)
    unsprung = [body.vertical_dof for body in record.bodies if body.kind == "wheelset"]
    if len(unsprung) == record.wheel_count and record.vehicle_acceleration is not None:
        at, rows = extremes(np.asarray(record.vehicle_acceleration)[:n, unsprung], slow)
        send_series(stream, "wheel_acceleration", wheels, clock.at(at), rows)


def _contact(stream: rr.RecordingStream, record: RunRecord, clock: Clock) -> None:
    """Send the contact lanes, the log of events, and a mark on the force plot for each."""
    ends = float(record.time[0]), float(record.time[record.samples - 1])
    for j in range(record.wheel_count):
        mine = [event for event in record.events if event.wheel == j]
        send_lane(stream, f"wheel_{j + 1}", mine, clock, ends=ends)
    colours = [palette.wheel_colour(event.wheel) for event in record.events]
    last = "diverged" if record.properties.get("status") == "diverged" else "end"
    send_events(stream, record.events, clock, ends=ends, colours=colours, last=last)
    for plot in sorted({"force", force_overview(record)}):
        send_marks(stream, plot, record.events, clock)
