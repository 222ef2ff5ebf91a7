"""The dashboard inside a recording: which views, where, over which stretch of time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint import encodings

from tbatch.view import palette
from tbatch.view.deflection import under_wheels
from tbatch.view.record import Array, RunRecord
from tbatch.view.scene import BASE_DEPTH, ROOF, Scene
from tbatch.view.timeline.canvas import Canvas
from tbatch.view.timeline.clock import CHAINAGE, TIME
from tbatch.view.timeline.side_view import ORIGIN

View = rrb.View | rrb.Container
WINDOW_TIME = 0.05  # shown before and after the cursor in close-ups [s]
LEGEND = rrb.PlotLegend(corner=rrb.Corner2D.LeftTop)  # runs begin calmly: little is hidden
NO_LEGEND = rrb.PlotLegend(visible=False)
SLOW_MOTION = 0.05  # simulated seconds played in a second
FORCE_TOP = 3.0  # least top of the Q/Q0 axis
POINTS_MAX = 2_000_000  # in one view: the software renderer needs half a minute for eight times as many
VIEW_HEIGHT = 0.5206  # tangent of half the viewer's angle of view (55 degrees upright, rerun 0.41)


def dashboard(record: RunRecord, scene: Scene, charts: Mapping[str, Canvas]) -> rrb.Blueprint:
    """Lay out the views of one run; views that have nothing to show are left out."""
    n = record.samples
    top = max(FORCE_TOP, 1.05 * float(np.max(record.force_ratio[:n])))
    force_axis = rrb.ScalarAxis(range=(-0.05 * top, top), zoom_lock=True)
    whole, window = _whole(), _window(record)
    lanes_share = 0.47 + 0.36 * record.wheel_count

    forces = _plot(force_overview(record), "Contact force Q/Q0, whole run", axis_y=force_axis, axis_x=whole)
    left: list[tuple[float, View]] = [(3.2, _pictures(scene, charts)), (2.0, forces), (lanes_share, _lanes(whole))]
    motions = _motions(record, whole)
    if motions:
        left.append((1.9, rrb.Tabs(*motions)))

    name = f"Q/Q0, ±{1e3 * WINDOW_TIME:.0f} ms"
    close = _plot("force", name, axis_y=force_axis, time_ranges=window, plot_legend=NO_LEGEND)
    right: list[tuple[float, View]] = [(1.9, close)]
    layers = _layers(record, scene, window)
    if layers:
        right.append((1.4, rrb.Tabs(*layers)))
    right += [(1.5, _events()), (2.2, rrb.TextDocumentView(origin="/sheet", name="Run sheet"))]

    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(*(view for _, view in left), row_shares=[share for share, _ in left]),
            rrb.Vertical(*(view for _, view in right), row_shares=[share for share, _ in right]),
            column_shares=[2.1, 1],
        ),
        # Paused, or the viewer starts playing at once; slow motion of the same speed on both timelines.
        rrb.TimePanel(
            state="collapsed",
            timeline=TIME,
            play_state="paused",
            playback_speed=SLOW_MOTION,
            fps=1e3 * record.speed,
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )


def _pictures(scene: Scene, charts: Mapping[str, Canvas]) -> View:
    """The side view, and behind it what is looked at less often."""
    tabs: list[View] = [_side_view(scene)]
    if "track" in charts:
        tabs.append(charts["track"].view("Deflection along the track [mm], seen from wheel 1 [m]"))
    spectra = {"force_spectrum": "Contact force [kN²/Hz]", "irregularity_spectrum": "Irregularity [mm²/Hz]"}
    drawn = [charts[name].view(title) for name, title in spectra.items() if name in charts]
    if drawn:
        tabs.append(rrb.Horizontal(*drawn, name="Spectra"))
    return rrb.Tabs(*tabs) if len(tabs) > 1 else tabs[0]


def _motions(record: RunRecord, whole: rrb.TimeAxis) -> list[View]:
    """What is plotted over the whole run below the forces."""
    tabs: list[View] = []
    if record.irregularity is not None:
        level = 1e3 * record.irregularity[: record.samples]
        low, high = _span(level)  # a low plot shows few numbers on its axis: say the range in words
        name = f"Irregularity under the wheels [mm], dip positive: {low:.2f} to {high:.2f}"
        tabs.append(_plot("irregularity", name, axis_y=_axis(level), axis_x=whole, plot_legend=NO_LEGEND))
    sprung = any(body.kind != "wheelset" for body in record.bodies)
    wheelsets = sum(body.kind == "wheelset" for body in record.bodies)
    if sprung and record.vehicle is not None:
        tabs.append(_plot("displacement", "Vehicle [mm], down positive", axis_x=whole))
    if sprung and record.vehicle_acceleration is not None:
        tabs.append(_plot("acceleration", "Acceleration of carbody and bogies [m/s²]", axis_x=whole))
    if wheelsets == record.wheel_count and record.vehicle_acceleration is not None:
        name = "Acceleration of the wheels [m/s²]"
        tabs.append(_plot("wheel_acceleration", name, axis_x=whole, plot_legend=NO_LEGEND))
    return tabs


def _layers(record: RunRecord, scene: Scene, window: list[rr.VisibleTimeRange]) -> list[View]:
    """Deflections under the wheels, round the cursor."""
    tabs: list[View] = []
    for layer in ("rail", "slab"):
        under = under_wheels(record, scene.frames, layer)
        if under is not None:
            name = f"{layer.capitalize()} under the wheels [mm]"
            axis = _axis(1e3 * under)
            entity = f"{layer}_deflection"
            tabs.append(_plot(entity, name, axis_y=axis, time_ranges=window, plot_legend=NO_LEGEND))
    return tabs


def force_overview(record: RunRecord) -> str:
    """Name the entity that shows the forces of the whole run: a thinned one where there are too many."""
    return "force" if record.samples * record.wheel_count <= POINTS_MAX else "force_overview"


def _plot(entity: str, name: str, *, plot_legend: rrb.PlotLegend = LEGEND, **options: Any) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(origin=f"/{entity}", name=name, plot_legend=plot_legend, **options)


def _span(values: Array) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))


def _axis(values: Array) -> rrb.ScalarAxis:
    """Span the values with a little room."""
    low, high = _span(values)
    room = 0.05 * (high - low) or 0.1
    return rrb.ScalarAxis(range=(low - room, high + room))


def _whole() -> rrb.TimeAxis:
    """Span the whole run: by default the viewer shows a limited stretch round the cursor.

    Open ends hold on both timelines; a range of seconds would be nonsense on the chainage (rerun 0.41).
    """
    boundary = rr.TimeRangeBoundary.infinite
    return rrb.TimeAxis(view_range=rr.TimeRange(start=boundary(), end=boundary()))


def _window(record: RunRecord) -> list[rr.VisibleTimeRange]:
    """Span a little round the cursor, on either timeline."""
    travel = max(round(1e3 * record.speed * WINDOW_TIME), 1)
    boundary = rr.TimeRangeBoundary.cursor_relative
    return [
        rr.VisibleTimeRange(TIME, start=boundary(seconds=-WINDOW_TIME), end=boundary(seconds=WINDOW_TIME)),
        rr.VisibleTimeRange(CHAINAGE, start=boundary(seq=-travel), end=boundary(seq=travel)),
    ]


def _lanes(whole: rrb.TimeAxis) -> rrb.StateTimelineView:
    return rrb.StateTimelineView(origin="/contact", name="Contact", time_view=whole)


def _events() -> rrb.TextLogView:
    kind = encodings.TextLogColumnKind
    body = [encodings.TextLogColumn(kind.Body)]
    return rrb.TextLogView(
        origin="/events",
        name="Separations: click a time to go there",
        columns=rrb.TextLogColumns(text_log_columns=body),
    )


def _side_view(scene: Scene) -> rrb.Spatial3DView:
    """Look at the vehicle squarely from the side, from near enough that it fills a wide, low view."""
    low, high = -BASE_DEPTH - 1.9, ROOF + 0.6
    centre = [0.5 * (scene.reach[0] + scene.reach[1]), 0.0, 0.5 * (low + high)]
    distance = max(0.5 * (high - low), 0.14 * (scene.reach[1] - scene.reach[0])) / VIEW_HEIGHT
    return rrb.Spatial3DView(
        origin=f"/{ORIGIN}",
        name=f"Side view, running to the right. Displacements and irregularity × {scene.exaggeration}",
        background=rrb.Background(color=palette.GROUND, kind=rrb.BackgroundKind.SolidColor),
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=[centre[0], -distance, centre[2]],
            look_target=centre,
            eye_up=[0, 0, 1],
        ),
    )
