"""Contact and separation over time: lanes, a log of events, and marks on plots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint import encodings

from tbatch.view import palette
from tbatch.view.record import Separation
from tbatch.view.timeline.clock import Clock

LANES = "contact"
EVENTS = "events"
SHORTEST = 1 / 300  # of a run: a lane's separations are drawn at least that long, or the viewer leaves them out


def send_lane(
    stream: rr.RecordingStream, lane: str, events: Sequence[Separation], clock: Clock, *, ends: tuple[float, float]
) -> None:
    """Send one wheel's lane: separations start when they do and end when they do, but for the shortest.

    Args:
        stream: The recording.
        lane: Its name below ``LANES``, shown beside it.
        events: The wheel's separations.
        clock: Stamps its times.
        ends: First and last time of the run [s].
    """
    least = (ends[1] - ends[0]) * SHORTEST
    changes: list[tuple[float, str]] = [(ends[0], "contact")]
    for event in events:
        end = max(event.end, event.start + least)
        changes.append((event.start, "separated"))
        hidden = any(event.start < other.start <= end for other in events)
        if not hidden and end < ends[1]:
            changes.append((end, "contact"))
    states = dict(sorted(changes, key=lambda change: change[0]))  # the later of two at one time wins
    look = rr.StateConfiguration(
        values=["contact", "separated"],
        labels=[" ", "off"],  # an empty one is replaced by the value (rerun 0.41)
        colors=[palette.CONTACT, palette.WARNING],
    )
    entity = f"{LANES}/{lane}"
    stream.log(entity, look, static=True, strict=True)
    columns = rr.StateChange.columns(state=list(states.values()))
    stream.send_columns(entity, clock.when(list(states)), columns, strict=True)


def send_events(
    stream: rr.RecordingStream,
    events: Sequence[Separation],
    clock: Clock,
    *,
    ends: tuple[float, float],
    colours: Sequence[palette.Colour],
    who: str = "",
    last: str = "end",
    entity: str = EVENTS,
) -> None:
    """Send the start, every separation and the end as lines of text.

    Args:
        stream: The recording.
        events: The separations of a run.
        clock: Stamps their times.
        ends: First and last time of the run [s].
        colours: One for each event.
        who: Said before each line where there are several runs.
        last: What the run's last time is.
        entity: What to log to.
    """
    count = len(events)
    total = "no separation" if not count else f"{count} separation{'s' if count > 1 else ''}"
    text = rr.TextLog.columns(
        text=[f"{who}start", f"{who}{last}: {total}"], level=["INFO"] * 2, color=[palette.RAIL] * 2
    )
    stream.send_columns(entity, clock.when(ends), text, strict=True)
    if not count:
        return
    text = rr.TextLog.columns(
        text=[who + sentence(event) for event in events], level=["WARN"] * count, color=list(colours)
    )
    stream.send_columns(entity, clock.when([event.start for event in events]), text, strict=True)


def send_marks(stream: rr.RecordingStream, plot: str, events: Sequence[Separation], clock: Clock) -> None:
    """Mark the start of every separation on a plot of forces, where the force is zero."""
    if not events:
        return
    entity = f"{plot}/separation"
    mark = rr.SeriesPoints(colors=[palette.WARNING], markers=["diamond"], marker_sizes=[4.0], names=["separation"])
    times = sorted({event.start for event in events})
    stream.log(entity, mark, static=True, strict=True)
    marks = rr.Scalars.columns(scalars=np.zeros(len(times)))
    stream.send_columns(entity, clock.when(times), marks, strict=True)


def sentence(event: Separation) -> str:
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


def lanes_view(whole: rrb.TimeAxis, origin: str = LANES) -> rrb.StateTimelineView:
    """All lanes over the whole run."""
    return rrb.StateTimelineView(origin=f"/{origin}", name="Off the rail in red, the shortest widened", time_view=whole)


def events_view(origin: str = EVENTS) -> rrb.TextLogView:
    """The log of events. A click on a row's time moves the time cursor, one on its text does not (rerun 0.41)."""
    body = [encodings.TextLogColumn(encodings.TextLogColumnKind.Body)]
    columns = rrb.TextLogColumns(text_log_columns=body)
    return rrb.TextLogView(origin=f"/{origin}", name="Separations: click a time to go there", columns=columns)
