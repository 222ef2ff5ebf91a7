"""The recording of an envelope: percentiles of Q/Q0 along the line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from tbatch.view import palette
from tbatch.view.envelope import KMH, LEVELS, Envelope
from tbatch.view.timeline.clock import CHAINAGE
from tbatch.view.timeline.file import recording_file

APPLICATION = "tbatch-envelope"  # of its own: recordings of one application share a layout in the viewer (rerun 0.41)
LOOKS: tuple[tuple[palette.Colour, float], ...] = (
    ((240, 150, 60), 1.2),
    ((250, 220, 100), 1.2),
    ((150, 215, 90), 1.2),
    ((235, 235, 235), 2.0),
    ((86, 180, 233), 1.2),
)  # of the curves of LEVELS: colour and width
TELLS_APART = 667  # passages from which on 99.85 % is not the largest value
FORCE_TOP = 5.0  # of the axis, the same for all speeds so that they can be compared


def write(envelope: Envelope, path: Path) -> Path:
    """Write an envelope to a temporary name, then move it into place."""
    identity = f"{envelope.campaign}-{envelope.name}"
    name = f"{envelope.name}, {envelope.speed * KMH:.4g} km/h"
    with recording_file(path, identity, name=name, application=APPLICATION) as stream:
        _curves(stream, envelope)
        page = rr.TextDocument(sheet(envelope), media_type="text/markdown")
        stream.log("sheet", page, static=True, strict=True)
        stream.send_blueprint(_dashboard(), make_active=True, make_default=True)
    return path


def sheet(envelope: Envelope) -> str:
    """What the curves are, in words."""
    worst = int(np.nanargmax(envelope.separated))
    most = int(envelope.passages.max())
    length = envelope.place[1] - envelope.place[0] if len(envelope.place) > 1 else 0.0
    return "\n".join(
        [
            f"# {envelope.speed * KMH:.4g} km/h",
            "",
            f"{envelope.runs} runs of {envelope.campaign}, simulated again; at most {most} passages of wheels a place, "
            f"bins of {length:.2f} m.",
            "",
            "A passage counts in a bin with its largest Q/Q0 for max, 99.85 % and 95 %, with that at the middle for "
            "50 %, with its least for 5 %."
            + (f" Of {most} passages 99.85 % is the largest." if most < TELLS_APART else "")
            + " The axis is the place along the line in mm.",
            "",
            f"Largest share of passages that lose contact in a bin: {100 * envelope.separated[worst]:.2f} % "
            f"at {envelope.place[worst]:.1f} m.",
            "",
            "The wheels of a run follow each other: their passages are no independent samples.",
        ]
    )


def _curves(stream: rr.RecordingStream, envelope: Envelope) -> None:
    known = envelope.passages > 0
    at = [rr.TimeColumn(CHAINAGE, sequence=np.round(1e3 * envelope.place[known]).astype(np.int64))]
    lines = rr.SeriesLines(
        names=[name for name, _ in LEVELS],
        colors=[colour for colour, _ in LOOKS],
        widths=[width for _, width in LOOKS],
        aggregation_policy="MinMax",
    )
    stream.log("envelope", lines, static=True, strict=True)
    rows = envelope.ratio[known]
    columns = rr.Scalars.columns(scalars=rows.ravel()).partition(np.full(len(rows), len(LEVELS)))
    stream.send_columns("envelope", at, columns, strict=True)
    line = rr.SeriesLines(names="separated", colors=[palette.WARNING], widths=[1.5], aggregation_policy="MinMax")
    stream.log("separated", line, static=True, strict=True)
    share = rr.Scalars.columns(scalars=100.0 * envelope.separated[known])
    stream.send_columns("separated", at, share, strict=True)


def _dashboard() -> rrb.Blueprint:
    """Lay out the views; nothing here is of one speed alone, since all envelopes share it in the viewer."""
    infinite = rr.TimeRangeBoundary.infinite
    whole = rrb.TimeAxis(view_range=rr.TimeRange(start=infinite(), end=infinite()))
    forces = rrb.TimeSeriesView(
        origin="/envelope",
        name="Q/Q0 along the line, all wheelsets: percentiles over runs",
        axis_x=whole,
        axis_y=rrb.ScalarAxis(range=(-0.2, FORCE_TOP), zoom_lock=True),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
    )
    share = rrb.TimeSeriesView(
        origin="/separated",
        name="Passages that lose contact, %",
        axis_x=whole,
        plot_legend=rrb.PlotLegend(visible=False),
    )
    page = rrb.TextDocumentView(origin="/sheet", name="What it is")
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(forces, share, row_shares=[3, 1]), page, column_shares=[3.2, 1]),
        rrb.TimePanel(state="collapsed", timeline=CHAINAGE, play_state="paused"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_layout=False,
        auto_views=False,
    )
