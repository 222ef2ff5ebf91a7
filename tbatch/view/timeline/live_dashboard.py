"""The dashboard of a live view: which views, and the chart of probability against speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint import encodings

from tbatch.view import palette
from tbatch.view.live.counts import SpeedCounts
from tbatch.view.live.news import Began

ELAPSED = "elapsed"  # since the live view began, a duration
RUNS = "runs"  # stored runs of a speed
STRIP_SHOWN = 8.0  # of the clock [s]
FORCE_TOP = 4.0  # of the strips, Q/Q0
WIDTH, HEIGHT = 260.0, 100.0  # of the chart, in its own unit
SPEEDS: tuple[palette.Colour, ...] = ((110, 150, 245), (60, 190, 180), (150, 215, 90), (250, 220, 100))
KMH = 3.6


def speed_colour(place: int) -> palette.Colour:
    """Colour of a followed speed, counted from the slowest."""
    return SPEEDS[place % len(SPEEDS)]


def speed_name(began: Began, case: int) -> str:
    """A speed in words."""
    return f"{began.speeds[case] * KMH:.4g} km/h"


@dataclass(frozen=True)
class Chart:
    """Probability against speed, drawn as points with whiskers: rerun plots against time alone (0.41)."""

    speeds: tuple[float, ...]  # km/h

    def place(self, speed: float, probability: float) -> list[float]:
        """Where a probability at a speed stands."""
        low, high = self.reach
        return [WIDTH * (speed - low) / (high - low), HEIGHT * (1.0 - probability)]

    @property
    def reach(self) -> tuple[float, float]:
        """First and last speed of the axis [km/h]."""
        low, high = min(self.speeds, default=0.0), max(self.speeds, default=1.0)
        room = 0.06 * (high - low) or 10.0
        return low - room, high + room

    def send_frame(self, stream: rr.RecordingStream) -> None:
        """Sends grid and axes."""
        low, high = self.reach
        ticks = [0.0, 0.25, 0.5, 0.75, 1.0]
        lines = [[self.place(low, tick), self.place(high, tick)] for tick in ticks]
        grid = rr.LineStrips2D(lines, colors=[palette.BASE], radii=rr.Radius.ui_points(0.6))
        stream.log("curve/grid", grid, static=True, strict=True)
        named = self.speeds[:: max(1, -(-len(self.speeds) // 7))]
        places = [[x - 9.0, y - 7.0] for x, y in (self.place(low, tick) for tick in ticks)]
        places += [[x, y + 5.0] for x, y in (self.place(speed, 0.0) for speed in named)]
        labels = [f"{tick:g}" for tick in ticks] + [f"{speed:.4g}" for speed in named]
        axes = rr.Points2D(places, labels=labels, colors=[palette.RAIL], radii=0.1, show_labels=True)
        stream.log("curve/axes", axes, static=True, strict=True)

    def send(self, stream: rr.RecordingStream, counts: Sequence[SpeedCounts]) -> None:
        """Sends what is known by now."""
        known = [(speed, count.probability) for speed, count in zip(self.speeds, counts, strict=True) if count.runs]
        whiskers = [[self.place(speed, low), self.place(speed, high)] for speed, (_, low, high) in known]
        colour, width = [palette.WINDOW], rr.Radius.ui_points(2.0)
        stream.log("curve/intervals", rr.LineStrips2D(whiskers, colors=colour, radii=width), strict=True)
        places = [self.place(speed, p) for speed, (p, _, _) in known]
        stream.log("curve/points", rr.Points2D(places, colors=colour, radii=rr.Radius.ui_points(4.0)), strict=True)


def live_dashboard(began: Began, chart: Chart) -> rrb.Blueprint:
    """Lays out the views: numbers on the right, what moves on the left."""
    infinite = rr.TimeRangeBoundary.infinite
    whole = rrb.TimeAxis(view_range=rr.TimeRange(start=infinite(), end=infinite()))
    cursor = rr.TimeRangeBoundary.cursor_relative
    window = rr.TimeRange(start=cursor(seconds=-STRIP_SHOWN), end=cursor(seconds=0.0))
    latest = [rr.VisibleTimeRange(ELAPSED, range=window)]
    left: list[rrb.View] = [
        rrb.TimeSeriesView(
            origin="/probability",
            name="Probability of a separation in a run, any wheelset, with exact 95 % interval",
            axis_y=rrb.ScalarAxis(range=(-0.02, 1.02), zoom_lock=True),
            axis_x=whole,
            plot_legend=rrb.PlotLegend(visible=False),
        )
    ]
    for place, case in enumerate(reversed(began.followed)):
        left.append(
            rrb.TimeSeriesView(
                origin=f"/forces/{case}",
                name=f"Q/Q0 of one run after the other at {speed_name(began, case)}",
                axis_y=rrb.ScalarAxis(range=(-0.2, FORCE_TOP), zoom_lock=True),
                time_ranges=latest,
                axis_x=rrb.TimeAxis(view_range=window),
                plot_legend=rrb.PlotLegend(visible=place == 0, corner=rrb.Corner2D.LeftTop),
            )
        )
    low, high = chart.reach
    curve = rrb.Spatial2DView(
        origin="/curve",
        name=f"Probability against speed [km/h], {low:.0f} to {high:.0f}",
        background=rrb.Background(color=palette.GROUND, kind=rrb.BackgroundKind.SolidColor),
        visual_bounds=rrb.VisualBounds2D(x_range=[-20.0, WIDTH + 6.0], y_range=[-8.0, HEIGHT + 20.0]),
    )
    histograms = [
        rrb.BarChartView(origin=f"/histogram/{case}", name=f"Q/Q0 at {speed_name(began, case)}, % of time")
        for case in reversed(began.followed)
    ]
    throughput = rrb.TimeSeriesView(
        origin="/throughput", name="1000 run-steps/s", axis_x=whole, plot_legend=rrb.PlotLegend(visible=False)
    )
    kind = encodings.TextLogColumnKind
    body = rrb.TextLogColumns(text_log_columns=[encodings.TextLogColumn(kind.Body)])
    log = rrb.TextLogView(origin="/log", name="Followed runs", columns=body)
    numbers = rrb.TextDocumentView(origin="/table", name="Numbers")
    right = rrb.Vertical(curve, numbers, rrb.Tabs(*histograms), throughput, log, row_shares=[2.3, 2.6, 1.7, 1, 1.4])
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(*left, row_shares=[1.6, *[1.0] * (len(left) - 1)]), right, column_shares=[1.9, 1.0]
        ),
        rrb.TimePanel(state="collapsed", timeline=ELAPSED, play_state="following"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )
