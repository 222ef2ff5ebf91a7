"""Figures of an estimate against the speed: a line for each wheelset, an interval at each point."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.estimates import ANY_WHEELSET, Estimate
from tbatch.view.report.drawing import Picture, drawing, log_bottom, svg_of, wheel_style

KMH = 3.6
Table = Mapping[tuple[int, int], Mapping[str, Estimate]]
"""Estimates by name, of each (case, wheelset)."""
COLUMNS = ("speed [km/h]", "wheelset (0 = any)", "estimate", "value", "low (95 %)", "high (95 %)", "unit", "runs")


def rows_of(table: Table, speeds: Sequence[float], wheels: Sequence[int], names: Sequence[str]) -> list[list[Any]]:
    """The numbers of a figure."""
    return [
        [KMH * speed, wheel, name, one.value, one.low, one.high, one.unit, one.runs]
        for case, speed in enumerate(speeds)
        for wheel in wheels
        for name in names
        if (one := table[case, wheel].get(name)) is not None
    ]


def by_wheelset(
    table: Table, speeds: Sequence[float], wheels: Sequence[int], name: str, *, title: str, axis: str, caption: str
) -> Picture:
    """An estimate that is zero or more, per wheelset, on a logarithmic axis; none seen is an arrow to its upper limit.

    Args:
        table: The estimates.
        speeds: Of each case [m/s].
        wheels: Wheelsets to draw.
        name: The estimate.
        title: Of the figure.
        axis: Label of the ordinate, with the unit.
        caption: Below the figure.
    """
    picture = name.replace(".", "_")
    numbers = [table[case, wheel][name] for case in range(len(speeds)) for wheel in wheels]
    positive = [one.low if one.low > 0.0 else one.value for one in numbers if one.value > 0.0]
    bottom = log_bottom(min([*positive, *(one.high for one in numbers if one.value == 0.0)], default=0.1))
    with drawing() as (figure, axes):
        gap = 0.5 * _smallest_gap(speeds) * KMH / (len(wheels) + 1)
        for place, wheel in enumerate(wheels):
            style = wheel_style(wheel)
            shift = (place - (len(wheels) - 1) / 2) * gap
            x = np.array([KMH * speed + shift for speed in speeds])
            found = [table[case, wheel][name] for case in range(len(speeds))]
            value = np.array([one.value if one.value > 0.0 else math.nan for one in found])
            low = np.array([max(one.low, bottom) for one in found])
            high = np.array([one.high for one in found])
            axes.errorbar(x, value, yerr=[value - low, high - value], elinewidth=1.0, capsize=1.5, **style)
            _none_seen(axes, x, found, bottom, style["color"])
        axes.set_yscale("log")
        axes.set_ylim(bottom=bottom)
        _mark_speeds(axes, speeds)
        axes.set_ylabel(axis)
        axes.legend(ncols=len(wheels), loc="lower center", bbox_to_anchor=(0.5, 1.0))
        svg = svg_of(figure, picture, title)
    return Picture(picture, title, caption, svg, COLUMNS, rows_of(table, speeds, wheels, [name]))


def by_estimate(
    table: Table,
    speeds: Sequence[float],
    names: Mapping[str, str],
    *,
    picture: str,
    title: str,
    axis: str,
    caption: str,
    log: bool = False,
) -> Picture:
    """Several estimates of any wheelset against the speed.

    Args:
        table: The estimates.
        speeds: Of each case [m/s].
        names: What each estimate is called in the legend, by its name.
        picture: Name of the figure.
        title: Of the figure.
        axis: Label of the ordinate, with the unit.
        caption: Below the figure.
        log: Whether the ordinate is logarithmic.
    """
    numbers = [end for one in table.values() for name in names if name in one for end in _ends(one[name])]
    bottom = log_bottom(min(numbers, default=0.1))
    with drawing() as (figure, axes):
        gap = 0.5 * _smallest_gap(speeds) * KMH / (len(names) + 1)
        for place, (name, label) in enumerate(names.items()):
            found = [table[case, ANY_WHEELSET].get(name) for case in range(len(speeds))]
            kept = [(KMH * speed, one) for speed, one in zip(speeds, found, strict=True) if one is not None]
            value = np.array([one.value if one.value > 0.0 or not log else math.nan for _, one in kept])
            x = np.array([at for at, _ in kept]) + (place - (len(names) - 1) / 2) * gap
            low = np.array([one.low if math.isfinite(one.low) else one.value for _, one in kept])
            low = np.maximum(low, bottom) if log else low
            high = np.array([one.high if math.isfinite(one.high) else one.value for _, one in kept])
            style = {**wheel_style(place + 1), "label": label}
            with np.errstate(invalid="ignore"):
                errors = [np.maximum(value - low, 0.0), np.maximum(high - value, 0.0)]
            axes.errorbar(x, value, yerr=errors, elinewidth=1.0, capsize=1.5, **style)
            for at, (_, one) in zip(x, kept, strict=True):
                if math.isinf(one.high) or math.isinf(one.low):
                    axes.plot([at], [one.value], marker=2 if math.isinf(one.high) else 3, color=style["color"], ms=7)
            if log:
                _none_seen(axes, x, [one for _, one in kept], bottom, style["color"])
        if log:
            axes.set_yscale("log")
            axes.set_ylim(bottom, 2.0 * max(numbers, default=1.0))
        _mark_speeds(axes, speeds)
        axes.set_ylabel(axis)
        axes.legend(ncols=len(names), loc="lower center", bbox_to_anchor=(0.5, 1.0))
        svg = svg_of(figure, picture, title)
    return Picture(picture, title, caption, svg, COLUMNS, rows_of(table, speeds, [ANY_WHEELSET], list(names)))


def _none_seen(axes: Any, x: NDArray[Any], found: Sequence[Estimate], bottom: float, colour: Any) -> None:
    """Where none was seen, an arrow down from the upper limit."""
    for at, one in zip(x, found, strict=True):
        if one.value == 0.0 and math.isfinite(one.high):
            form = {"arrowstyle": "->", "color": colour, "shrinkA": 0, "shrinkB": 0, "lw": 1.0}
            axes.annotate("", (at, max(bottom, one.high / 3.0)), (at, one.high), arrowprops=form)
            axes.plot([at], [one.high], marker="_", color=colour, markersize=6)


def _smallest_gap(speeds: Sequence[float]) -> float:
    return float(np.min(np.diff(np.sort(speeds)))) if len(speeds) > 1 else 5.0


def _ends(one: Estimate) -> list[float]:
    """The estimate, or the upper end of its interval where none was seen."""
    return [number for number in (one.value, one.high) if math.isfinite(number) and number > 0.0]


def _mark_speeds(axes: Any, speeds: Sequence[float]) -> None:
    """Ticks at the speeds themselves, as long as they can be read: points stand beside one another around them."""
    if len(speeds) <= 15:
        axes.set_xticks([KMH * speed for speed in speeds], [f"{KMH * speed:.4g}" for speed in speeds])
    if len(speeds) == 1:
        axes.set_xlim(KMH * speeds[0] - 5.0, KMH * speeds[0] + 5.0)
    axes.set_xlabel("speed [km/h]")
