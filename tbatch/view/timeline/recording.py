"""What a recording holds: the histories of one run as columns, on two timelines."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr

from tbatch.view import palette
from tbatch.view.deflection import under_wheels
from tbatch.view.record import Array, RunRecord
from tbatch.view.scene import body_names, build_scene
from tbatch.view.sheet import run_sheet
from tbatch.view.thinning import Samples, extremes, spaced_samples
from tbatch.view.timeline import side_view
from tbatch.view.timeline.charts import send_charts
from tbatch.view.timeline.clock import Clock
from tbatch.view.timeline.contact import send_events, send_lane, send_marks
from tbatch.view.timeline.dashboard import dashboard
from tbatch.view.timeline.file import recording_file
from tbatch.view.timeline.layout import POINTS_MAX
from tbatch.view.timeline.series import (
    FORCE_DENSITY,
    GRAIN,
    MOTION_DENSITY,
    contact_changes,
    plotted_samples,
    send_range,
    send_series,
)

MOTION_INTERVAL, MOTION_TRAVEL = 0.5e-3, 0.02
"""Least time [s] and way [m] between samples of slower motions; extremes are taken of twice as much."""
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
        forces = _histories(stream, record, clock)
        _contact(stream, record, clock, {"force", forces})
        side_view.send(stream, record, scene, clock)
        charts = send_charts(stream, record, scene, clock)
        stream.send_blueprint(dashboard(record, charts, forces=forces), make_active=True, make_default=True)
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


def _histories(stream: rr.RecordingStream, record: RunRecord, clock: Clock) -> str:
    """Send what is plotted.

    Returns:
        The entity that shows the forces of the whole run: a thinner one where there are too many samples for a view.
    """
    n = record.samples
    time, position = np.asarray(record.time[:n]), np.asarray(record.position[:n])
    fewer = spaced_samples(time, position, interval=MOTION_INTERVAL, travel=MOTION_TRAVEL)
    slow = fewer[::2]
    wheels = [(f"wheel {j + 1}", palette.wheel_colour(j)) for j in range(record.wheel_count)]
    force = record.force_ratio[:n]
    kept = plotted_samples(record, force, kept=contact_changes(force), density=FORCE_DENSITY)
    send_series(stream, "force", wheels, clock.at(kept), force[kept], GRAIN)
    send_range(stream, "force", clock, record, np.append(force.ravel(), FORCES_SHOWN))
    overview = "force" if kept.size * record.wheel_count <= POINTS_MAX else "force_overview"
    if overview != "force":
        blocks = np.arange(0, n, -(-2 * force.size // POINTS_MAX))
        at, rows = extremes(force, blocks)
        send_series(stream, overview, wheels, clock.at(at), rows, GRAIN)
    for layer, given, samples in (
        ("rail", record.rail_under_wheel, fewer),
        ("slab", record.slab_under_wheel, slow),
    ):
        if given is not None:
            samples = plotted_samples(record, np.asarray(given)[:n], density=MOTION_DENSITY)
        _deflection(stream, layer, wheels, clock, record, samples, under_wheels(record, samples, layer))
    if record.irregularity is not None:
        level = np.asarray(record.irregularity)[:n]
        kept = plotted_samples(record, level, density=MOTION_DENSITY)
        send_series(stream, "irregularity", wheels, clock.at(kept), 1e3 * level[kept])
    sprung = [body for body in record.bodies if body.kind != "wheelset"]
    dofs = [body.vertical_dof for body in sprung]
    looks = list(zip(body_names(sprung), palette.body_colours(len(sprung)), strict=True))
    if dofs and record.vehicle is not None:
        motion = np.asarray(record.vehicle)[:n, dofs]
        kept = plotted_samples(record, motion, density=MOTION_DENSITY)
        send_series(stream, "displacement", looks, clock.at(kept), 1e3 * motion[kept])
    if dofs and record.vehicle_acceleration is not None:
        at, rows = extremes(np.asarray(record.vehicle_acceleration)[:n, dofs], slow)
        send_series(stream, "acceleration", looks, clock.at(at), rows)
    unsprung = [body.vertical_dof for body in record.bodies if body.kind == "wheelset"]
    if len(unsprung) == record.wheel_count and record.vehicle_acceleration is not None:
        at, rows = extremes(np.asarray(record.vehicle_acceleration)[:n, unsprung], slow)
        send_series(stream, "wheel_acceleration", wheels, clock.at(at), rows)
    return overview


def _deflection(
    stream: rr.RecordingStream,
    layer: str,
    wheels: Sequence[tuple[str, palette.Colour]],
    clock: Clock,
    record: RunRecord,
    samples: Samples,
    under: Array | None,
) -> None:
    """Send the deflection of a layer under the wheels [m], shape (sample, wheel); nothing where it is not known."""
    if under is not None:
        send_series(stream, f"{layer}_deflection", wheels, clock.at(samples), 1e3 * under)
        send_range(stream, f"{layer}_deflection", clock, record, 1e3 * under)


def _contact(stream: rr.RecordingStream, record: RunRecord, clock: Clock, plots: Collection[str]) -> None:
    """Send the contact lanes, the log of events, and a mark on the plots of forces for each."""
    ends = float(record.time[0]), float(record.time[record.samples - 1])
    for j in range(record.wheel_count):
        mine = [event for event in record.events if event.wheel == j]
        send_lane(stream, f"wheel_{j + 1}", mine, clock, ends=ends)
    colours = [palette.wheel_colour(event.wheel) for event in record.events]
    last = "diverged" if record.properties.get("status") == "diverged" else "end"
    send_events(stream, record.events, clock, ends=ends, colours=colours, last=last)
    for plot in sorted(plots):
        send_marks(stream, plot, record.events, clock)
