"""The dashboard inside a recording: which views, where."""

from __future__ import annotations

from collections.abc import Mapping

import rerun.blueprint as rrb

from tbatch.view import palette
from tbatch.view.record import RunRecord
from tbatch.view.scene import BASE_DEPTH, ROOF, reach_of
from tbatch.view.timeline.canvas import Canvas
from tbatch.view.timeline.contact import events_view, lanes_view
from tbatch.view.timeline.layout import View, close_up, framed, plot, stacked, tabbed, whole
from tbatch.view.timeline.side_view import ORIGIN

VIEW_HEIGHT = 0.5206  # tangent of half the viewer's angle of view (55 degrees upright, rerun 0.41)


def dashboard(record: RunRecord, charts: Mapping[str, Canvas], *, forces: str = "force") -> rrb.Blueprint:
    """Lay out the views of one run; views that have nothing to show are left out.

    Args:
        record: The run.
        charts: Its charts by name.
        forces: Entity that shows the forces of the whole run.
    """
    lanes_share = 0.47 + 0.36 * record.wheel_count
    left: list[tuple[float, View]] = [
        (3.2, _pictures(record, charts)),
        (2.0, plot(forces, "Contact force Q/Q0, whole run")),
        (lanes_share, lanes_view(whole())),
    ]
    motions = _motions(record)
    if motions:
        left.append((1.9, tabbed(motions)))
    right: list[tuple[float, View]] = [(1.9, close_up("force", "Q/Q0 at the cursor"))]
    layers = _layers(record)
    if layers:
        right.append((1.4, tabbed(layers)))
    right += [(1.5, events_view()), (2.2, rrb.TextDocumentView(origin="/sheet", name="Run sheet"))]
    return framed(rrb.Horizontal(stacked(left), stacked(right), column_shares=[2.1, 1]), speed=record.speed)


def _pictures(record: RunRecord, charts: Mapping[str, Canvas]) -> View:
    """The side view, and behind it what is looked at less often."""
    tabs: list[View] = [_side_view(record)]
    if "track" in charts:
        tabs.append(charts["track"].view("Deflection along the track [mm], seen from wheel 1 [m]"))
    spectra = {"force_spectrum": "Contact force [kN²/Hz]", "irregularity_spectrum": "Irregularity [mm²/Hz]"}
    drawn = [charts[name].view(title) for name, title in spectra.items() if name in charts]
    if drawn:
        tabs.append(rrb.Horizontal(*drawn, name="Spectra"))
    return tabbed(tabs)


def _motions(record: RunRecord) -> list[View]:
    """What is plotted over the whole run below the forces."""
    tabs: list[View] = []
    if record.irregularity is not None:
        tabs.append(plot("irregularity", "Irregularity under the wheels [mm], dip positive", legend=False))
    sprung = any(body.kind != "wheelset" for body in record.bodies)
    wheelsets = sum(body.kind == "wheelset" for body in record.bodies)
    if sprung and record.vehicle is not None:
        tabs.append(plot("displacement", "Vehicle [mm], down positive"))
    if sprung and record.vehicle_acceleration is not None:
        tabs.append(plot("acceleration", "Acceleration of carbody and bogies [m/s²]"))
    if wheelsets == record.wheel_count and record.vehicle_acceleration is not None:
        tabs.append(plot("wheel_acceleration", "Acceleration of the wheels [m/s²]", legend=False))
    return tabs


def _layers(record: RunRecord) -> list[View]:
    """Deflections under the wheels, round the cursor."""
    known = {
        "rail": record.rail is not None or record.rail_under_wheel is not None,
        "slab": record.slab is not None or record.slab_under_wheel is not None,
    }
    return [
        close_up(f"{layer}_deflection", f"{layer.capitalize()} under the wheels [mm]")
        for layer, there in known.items()
        if there
    ]


def _side_view(record: RunRecord) -> rrb.Spatial3DView:
    """Look at the vehicle squarely from the side, from near enough that it fills a wide, low view."""
    rear, front = reach_of(record)
    low, high = -BASE_DEPTH - 1.9, ROOF + 0.9
    centre = [0.5 * (rear + front), 0.0, 0.5 * (low + high)]
    distance = max(0.5 * (high - low), 0.14 * (front - rear)) / VIEW_HEIGHT
    return rrb.Spatial3DView(
        origin=f"/{ORIGIN}",
        name="Side view, running to the right",
        background=rrb.Background(color=palette.GROUND, kind=rrb.BackgroundKind.SolidColor),
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=[centre[0], -distance, centre[2]],
            look_target=centre,
            eye_up=[0, 0, 1],
        ),
    )
