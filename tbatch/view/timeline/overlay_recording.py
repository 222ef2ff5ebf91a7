"""What a comparing recording holds: every response's histories, and their differences, on common time lines."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr

from tbatch.view.overlay import Overlay, Page, Panel, Response, difference, overlay_sheet
from tbatch.view.record import Array
from tbatch.view.thinning import extremes, spaced_samples
from tbatch.view.timeline.clock import Clock, columns
from tbatch.view.timeline.contact import send_events, send_lane
from tbatch.view.timeline.file import recording_file
from tbatch.view.timeline.layout import POINTS_MAX
from tbatch.view.timeline.overlay_dashboard import OVERVIEW, Place, overlay_dashboard
from tbatch.view.timeline.series import FORCE_DENSITY, GRAIN, contact_changes, plotted_samples, send_range, send_series

INTERVAL, TRAVEL = 1e-3, 0.04  # least time [s] and way [m] between extremes; half of it for differences


def _send(stream: rr.RecordingStream, overlay: Overlay) -> None:
    """Send everything, the dashboard last."""
    text = rr.TextDocument(overlay_sheet(overlay), media_type="text/markdown")
    stream.log("sheet", text, static=True, strict=True)
    places = []
    for page in overlay.pages:
        prefix = f"{slug(page.name)}/" if len(overlay.pages) > 1 else ""
        place = Place(page, prefix, thinned=sum(one.samples for one in page.responses) > POINTS_MAX)
        places.append(place)
        for panel in page.panels:
            _panel(stream, place, panel)
        _contact(stream, place)
    blueprint = overlay_dashboard(places)
    stream.send_blueprint(blueprint, make_active=True, make_default=True)


def write(overlay: Overlay, path: Path) -> Path:
    """Write the recording."""
    # An application of its own: pages differ, and recordings of one application share their layout (rerun 0.41).
    responses = [(page.name, response.name) for page in overlay.pages for response in page.responses]
    identity = "compare-" + hashlib.sha256(repr((overlay.name, responses)).encode()).hexdigest()[:16]
    with recording_file(path, identity, name=overlay.name, application=f"tbatch-{identity}") as stream:
        _send(stream, overlay)
    return path


def slug(name: str) -> str:
    """A name as part of an entity's path."""
    return re.sub(r"[^\w.-]+", "_", name)


def _panel(stream: rr.RecordingStream, place: Place, panel: Panel) -> None:
    """Send one quantity of all responses, and its differences."""
    base = place.page.responses[0]
    grain = GRAIN if panel.key.startswith("force/") else None
    if panel.row:
        everything = np.concatenate([one.values[panel.key][: one.samples] for one in place.page.responses])
        longest = max(place.page.responses, key=lambda one: float(one.position[one.samples - 1]))
        send_range(stream, f"{place.prefix}{panel.key}", Clock(longest), longest, everything)
    for response in place.page.responses:
        look = [(response.name, response.colour)]
        n = response.samples
        values = np.asarray(response.values[panel.key], float)[:n, None]
        clock = Clock(response)
        leaf = f"{panel.key}/{slug(response.name)}"
        if panel.row:
            kept = contact_changes(values) if panel.key.startswith("force/") else None
            at = plotted_samples(response, values, kept=kept, density=FORCE_DENSITY)
            rows = values[at]
        else:  # looked at less often: extremes will do
            time, position = np.asarray(response.time[:n]), np.asarray(response.position[:n])
            at, rows = extremes(values, spaced_samples(time, position, interval=INTERVAL, travel=TRAVEL))
        send_series(stream, f"{place.prefix}{leaf}", look, clock.at(at), rows, grain)
        if place.thinned:
            blocks = np.arange(0, n, -(-2 * n * len(place.page.responses) // POINTS_MAX))
            at, rows = extremes(values, blocks)
            send_series(stream, f"{place.prefix}{OVERVIEW}/{leaf}", look, clock.at(at), rows, grain)
        if response is not base:
            found = difference(response, base, panel.key)
            entity = f"{place.prefix}difference/{leaf}"
            spaced = spaced_samples(found.time, found.position, interval=0.5 * INTERVAL, travel=0.5 * TRAVEL)
            at, rows = extremes(found.values[:, None], spaced)
            send_series(stream, entity, look, columns(found.time[at], found.position[at]), rows)


def _contact(stream: rr.RecordingStream, place: Place) -> None:
    """Send the lanes, wheel by wheel so that responses are compared, and one log of all events."""
    for response, clock, ends in _clocks(place.page):
        who = f"{response.name}: "
        colours = [response.colour] * len(response.events)
        send_events(stream, response.events, clock, ends=ends, colours=colours, who=who, entity=place.events)
        if place.lanes:
            for j in range(place.wheel_count):
                mine = [event for event in response.events if event.wheel == j]
                send_lane(stream, f"{place.prefix}wheel_{j + 1}/{slug(response.name)}", mine, clock, ends=ends)


def _clocks(page: Page) -> Iterator[tuple[Response, Clock, tuple[float, float]]]:
    for response in page.responses:
        time: Array = response.time
        yield response, Clock(response), (float(time[0]), float(time[response.samples - 1]))
