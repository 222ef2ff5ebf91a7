"""What dashboards share: plots that span a whole run or a window at the cursor, and the frame around the views.

Recordings of one application share a layout in the viewer, and a catalogue of runs has the layout of its first one
(rerun 0.41). So nothing in a layout may be true of one run alone: no ranges of values, no numbers in titles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from tbatch.view.timeline.clock import CHAINAGE, TIME
from tbatch.view.timeline.series import RANGES

View = rrb.View | rrb.Container
WINDOW_TIME = 0.05  # shown before and after the cursor in close-ups [s]
WINDOW_TRAVEL = 4.0  # the same on the chainage [m]
LEGEND = rrb.PlotLegend(corner=rrb.Corner2D.LeftTop)  # runs begin calmly: little is hidden
NO_LEGEND = rrb.PlotLegend(visible=False)
SLOW_MOTION, SLOW_TRAVEL = 0.05, 2.2  # simulated seconds played in a second, and least way [m]
POINTS_MAX = 2_000_000  # in one view: the software renderer needs half a minute for eight times as many


def plot(entity: str, name: str, *, legend: bool = True, **options: Any) -> rrb.TimeSeriesView:
    """A plot of all series at and below an entity, over the whole run."""
    options.setdefault("axis_x", whole())
    return rrb.TimeSeriesView(origin=f"/{entity}", name=name, plot_legend=LEGEND if legend else NO_LEGEND, **options)


def close_up(entity: str, name: str, share: float = 1.0) -> rrb.TimeSeriesView:
    """A plot of a window at the cursor, or of a share of the usual one."""
    contents = [f"/{entity}/**", f"/{RANGES}/{entity}/**"]
    return rrb.TimeSeriesView(
        origin="/", contents=contents, name=name, plot_legend=NO_LEGEND, time_ranges=window(share)
    )


def whole() -> rrb.TimeAxis:
    """Span the whole run: by default the viewer shows a limited stretch round the cursor.

    Open ends hold on both timelines; a range of seconds would be nonsense on the chainage (rerun 0.41).
    """
    boundary = rr.TimeRangeBoundary.infinite
    return rrb.TimeAxis(view_range=rr.TimeRange(start=boundary(), end=boundary()))


def window(share: float = 1.0) -> list[rr.VisibleTimeRange]:
    """Span a little round the cursor, on either timeline."""
    boundary = rr.TimeRangeBoundary.cursor_relative
    time, travel = share * WINDOW_TIME, round(1e3 * share * WINDOW_TRAVEL)
    return [
        rr.VisibleTimeRange(TIME, start=boundary(seconds=-time), end=boundary(seconds=time)),
        rr.VisibleTimeRange(CHAINAGE, start=boundary(seq=-travel), end=boundary(seq=travel)),
    ]


def stacked(parts: list[tuple[float, View]]) -> rrb.Vertical:
    """Views on top of each other, each with its share of the height."""
    return rrb.Vertical(*(view for _, view in parts), row_shares=[share for share, _ in parts])


def tabbed(views: Sequence[View]) -> View:
    """Views behind each other; one alone needs no tabs."""
    return rrb.Tabs(*views) if len(views) > 1 else views[0]


def framed(views: View, *, speed: float, timeline: str = TIME) -> rrb.Blueprint:
    """The whole blueprint: views, and a time panel that is paused, or the viewer starts playing at once.

    Args:
        views: What is shown.
        speed: Of the vehicle [m/s]: slow motion is as slow on both timelines.
        timeline: Shown at first.
    """
    # Pictures are a way apart: a slow run is slowed down less, or they would follow one another in jerks.
    played = max(SLOW_MOTION, min(SLOW_TRAVEL / speed, 1.0)) if speed > 0.0 else 1.0
    return rrb.Blueprint(
        views,
        rrb.TimePanel(
            state="collapsed", timeline=timeline, play_state="paused", playback_speed=played, fps=1e3 * speed
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )
