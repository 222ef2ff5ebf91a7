"""Figures of distributions: over runs, over separations, along the line, over the steps."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tbatch.campaign.estimates import Units
from tbatch.campaign.estimates.curves import Curve, along_line, events_exceeding, exceedance, time_above
from tbatch.campaign.estimates.loads import BIN_WIDTH
from tbatch.view.report.drawing import LIMIT_COLOUR, Picture, band, drawing, speed_style, svg_of

KMH = 3.6
COLUMNS = ("speed [km/h]", "curve", "x", "value", "low (95 %)", "high (95 %)", "runs")
PIECE = 2.5  # of the line, for where separations begin [m]
Ensemble = Mapping[float, Units]
"""Runs by speed [m/s], any wheelset."""


def _rows(label: str, speed: float, curve: Curve) -> list[list[Any]]:
    points = zip(curve.x, curve.value, curve.low, curve.high, strict=True)
    return [[KMH * speed, label, *map(float, point), curve.runs] for point in points]


def _panels(
    name: str,
    title: str,
    caption: str,
    ensemble: Ensemble,
    panels: Sequence[tuple[str, str, Callable[[Units], Curve]]],
    *,
    ordinate: str,
    lines: Mapping[str, Sequence[float]] | None = None,
    shared: bool = True,
) -> Picture:
    """Panels side by side with a curve and its band for each speed, on a logarithmic ordinate."""
    rows: list[list[Any]] = []
    with drawing(panels=len(panels), sharey=shared, squeeze=False) as (figure, grid):
        for axes, (label, abscissa, curve_of) in zip(grid[0], panels, strict=True):
            for place, (speed, units) in enumerate(ensemble.items()):
                curve = curve_of(units)
                style = speed_style(place, len(ensemble), f"{KMH * speed:.4g} km/h")
                axes.plot(curve.x, curve.value, drawstyle="default", **style)
                band(axes, curve.x, curve.low, curve.high, style["color"])
                rows += _rows(label, speed, curve)
            for limit in (lines or {}).get(label, ()):
                axes.axvline(limit, color=LIMIT_COLOUR, linewidth=1.2)
                axes.annotate("limit", (limit, 1.0), xycoords=("data", "axes fraction"), color=LIMIT_COLOUR, size=8)
            axes.set_yscale("log")
            axes.set_xlabel(abscissa)
            values = [row[3] for row in rows if row[3] > 0.0]
            axes.set_ylim((0.5 * min(values), 2.0 * max(values)) if values else (0.1, 1.0))
            if not values:
                axes.annotate("none", (0.5, 0.5), xycoords="axes fraction", ha="center")
        grid[0][0].set_ylabel(ordinate)
        handles, labels = grid[0][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=5)
        svg = svg_of(figure, name, title)
    return Picture(name, title, caption, svg, COLUMNS, rows)


def load_exceedance(ensemble: Ensemble, limits: Mapping[str, Sequence[float]]) -> Picture:
    """How large and how small Q/Q0 becomes in a run."""
    return _panels(
        "load_ratio_exceedance",
        "Largest and smallest wheel load of a run",
        "Share of runs in which the raw contact force of any wheelset exceeds (left) or falls below (right) a multiple"
        " of its static load. Bands: exact pointwise 95 % intervals over runs.",
        ensemble,
        (
            ("load_ratio.max", "largest Q/Q0 of a run [-]", lambda units: exceedance(units["ratio_max"])),
            ("load_ratio.min", "smallest Q/Q0 of a run [-]", lambda units: exceedance(units["ratio_min"], below=True)),
        ),
        ordinate="share of runs beyond [-]",
        lines=limits,
    )


def filtered_exceedance(ensemble: Ensemble, limits: Mapping[str, Sequence[float]]) -> Picture:
    """The same of the 20 Hz family."""
    return _panels(
        "load_ratio_20hz_exceedance",
        "EN 14363 family: largest and smallest 20 Hz wheel load of a run",
        "As above, for the force after a fourth-order 20 Hz low-pass (bands: exact 95 %). It hides separations, is"
        " never mixed with the raw contact force, may undershoot zero and is not clipped.",
        ensemble,
        (
            ("load_ratio_20hz.max", "largest 20 Hz Q/Q0 [-]", lambda units: exceedance(units["ratio_20hz_max"])),
            (
                "load_ratio_20hz.min",
                "smallest 20 Hz Q/Q0 [-]",
                lambda units: exceedance(units["ratio_20hz_min"], below=True),
            ),
        ),
        ordinate="share of runs beyond [-]",
        lines=limits,
    )


def event_sizes(ensemble: Ensemble) -> Picture:
    """How long separations are."""

    def of(name: str, factor: float) -> Callable[[Units], Curve]:
        def curve(units: Units) -> Curve:
            whole = units.events["censored"] < 0.5
            values = factor * units.events[name][whole]
            return events_exceeding(values, units.event_unit[whole], units["evaluated_distance"])

        return curve

    return _panels(
        "separation_sizes",
        "How long separations are",
        "Separations per wheelset-kilometre that last (left) or reach (right) at least so long, without those that the"
        " ends of the evaluated part cut off. Bands: 95 %, bootstrap over runs.",
        ensemble,
        (
            ("duration [ms]", "duration [ms]", of("duration", 1e3)),
            ("length [m]", "length [m]", of("length", 1.0)),
        ),
        ordinate="separations per km [1/km]",
    )


def event_forces(ensemble: Ensemble) -> Picture:
    """How wide separations gape and how hard wheels land."""

    def of(name: str, factor: float) -> Callable[[Units], Curve]:
        return lambda units: events_exceeding(
            factor * units.events[name], units.event_unit, units["evaluated_distance"]
        )

    return _panels(
        "separation_gaps",
        "How wide separations gape and how hard wheels land",
        "Separations per wheelset-kilometre with at least this gap (left), or with at least this largest force within"
        " 5 ms of landing (right). Bands: 95 %, bootstrap over runs.",
        ensemble,
        (
            ("gap [mm]", "gap [mm]", of("gap", 1e3)),
            ("landing force [kN]", "landing force [kN]", of("landing_force", 1e-3)),
        ),
        ordinate="separations per km [1/km]",
    )


def time_shares(ensemble: Ensemble) -> Picture:
    """For how much of the time Q/Q0 exceeds a value, the two families apart."""
    return _panels(
        "load_ratio_time",
        "For how much of the time Q/Q0 is high",
        f"Share of the evaluated steps with Q/Q0 at or above a value, in bins of {BIN_WIDTH:g}: raw contact force"
        " (left) and the 20 Hz family (right), apart. Bands: 95 %, bootstrap over runs.",
        ensemble,
        (
            ("raw", "raw Q/Q0 [-]", lambda units: time_above(units.histograms["histogram"], BIN_WIDTH)),
            ("20 Hz", "20 Hz Q/Q0 [-]", lambda units: time_above(units.histograms["histogram_20hz"], BIN_WIDTH)),
        ),
        ordinate="share of time above [-]",
    )


def positions(speed: float, units: Units) -> Picture:
    """Where along the line separations begin."""
    edges, curve = along_line(units.events["position"], units.event_unit, len(units), length=PIECE)
    name, title = "separation_positions", f"Where separations begin, at {KMH * speed:.4g} km/h"
    with drawing(height=2.8) as (figure, axes):
        if len(edges):
            axes.stairs(curve.value, edges, fill=True, color="#9DB8D2")
            errors = [curve.value - curve.low, curve.high - curve.value]
            axes.errorbar(curve.x, curve.value, yerr=errors, fmt="none", ecolor="#333333", elinewidth=0.8)
        axes.set_xlabel("chainage x [m]")
        axes.set_ylabel(f"separations per run\nand {PIECE:g} m [-]")
        svg = svg_of(figure, name, title)
    caption = (
        f"Separations of any wheelset that begin in each {PIECE:g} m, per run; wheels enter the evaluated part one"
        " after the other. Bars: 95 %, bootstrap over runs."
    )
    return Picture(name, title, caption, svg, COLUMNS, _rows("separations per run", speed, curve))
