"""Figures about how much to trust: convergence with the runs, extreme values, what the varied numbers decide."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tbatch.campaign.estimates import Estimate, Units
from tbatch.campaign.estimates.convergence import convergence
from tbatch.campaign.estimates.extremes import (
    ExtremeFit,
    block_maxima,
    cumulative,
    fit_extremes,
    plotting_positions,
    reduced_variate,
)
from tbatch.campaign.estimates.intervals import exact_interval, order_statistics
from tbatch.campaign.estimates.sensitivity import Sensitivity, sensitivities
from tbatch.view.report.drawing import DASHES, WHEEL_COLOURS, Picture, band, drawing, svg_of, wheel_style
from tbatch.view.report.page import table_html
from tbatch.view.report.tables import with_interval

KMH = 3.6
_LABELS = {
    "separation.probability": "probability of separation [-]",
    "separation.per_km": "separations per km [1/km]",
    "load_ratio.max.p95": "95 % value of largest Q/Q0 [-]",
}
_VARIED_BINS = 5


def convergence_picture(speed: float, units: Units) -> tuple[Picture, dict[int, dict[str, Estimate]]]:
    """The main estimates from the first n runs, and every estimate so."""
    followed = convergence(units)
    title = f"How the estimates settle, at {KMH * speed:.4g} km/h"
    with drawing(height=2.8, panels=len(_LABELS)) as (figure, grid):
        for place, (axes, name) in enumerate(zip(grid, _LABELS, strict=True)):
            points = [found[name] for found in followed.values()]
            runs = [*followed]
            values = np.array([one.value for one in points])
            colour = WHEEL_COLOURS[place]
            axes.plot(runs, values, color=colour, marker="o", markersize=3)
            high = np.array([one.high for one in points])
            band(axes, runs, [one.low for one in points], high, colour)
            axes.set_xscale("log")
            ticks = _ticks(runs[0], runs[-1]) if runs else []
            axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
            axes.minorticks_off()
            known = [*values[np.isfinite(values)], *high[np.isfinite(high)][-4:], 0.0]
            axes.set_ylim(0.0 if place < 2 else None, 1.15 * max(known) or 1.0)
            if place == 2:
                axes.set_ylim(0.7 * float(np.nanmin(values)), 1.15 * max(known))
            axes.set_xlabel("runs [-]")
            axes.set_title(_LABELS[name], fontsize=9)
        svg = svg_of(figure, "convergence", title)
    rows: list[list[Any]] = [
        [name, runs, one.value, one.low, one.high, one.unit, one.method]
        for runs, found in followed.items()
        for name, one in found.items()
    ]
    caption = (
        "Estimates for any wheelset from the first n runs, with their 95 % intervals; a band without an edge is open."
        " The numbers behind hold every other estimate too, in SI units."
    )
    columns = ("estimate", "runs", "value", "low", "high", "unit", "method")
    return Picture("convergence", title, caption, svg, columns, rows), followed


def settling_table(followed: Mapping[int, Mapping[str, Estimate]]) -> str:
    """Every estimate from about an eighth, a quarter, half and all of the runs, folded away."""
    counts = [*followed][-1::-2][:4][::-1]
    last = followed[counts[-1]] if counts else {}
    rows = [
        [
            name,
            one.unit or "-",
            *(with_interval(of[name]) if name in of else "-" for of in map(followed.__getitem__, counts)),
        ]
        for name, one in last.items()
    ]
    titles = ["estimate", "unit", *(f"{count:,} runs" for count in counts)]
    return f"<details><summary>How every estimate settles</summary>{table_html(titles, rows, text=2)}</details>"


def _ticks(first: int, last: int) -> list[int]:
    """Round numbers in a range, few enough to be read."""
    steps = (1, 2, 5) if last < 50 * first else (1,)
    return [step * 10**power for power in range(9) for step in steps if first <= step * 10**power <= last]


def extremes_picture(speed: float, units: Units) -> tuple[Picture, list[ExtremeFit]] | None:
    """Largest Q/Q0 of a run on Gumbel paper with both fits; None where there is nothing to fit."""
    values = units["ratio_max"]
    fits = [fit for family in ("gumbel", "gev") if (fit := fit_extremes(values, family=family)) is not None]
    if not fits:
        return None
    maxima = np.sort(block_maxima(values))
    count = len(maxima)
    x = reduced_variate(plotting_positions(count))
    title = f"Extreme values of the largest Q/Q0 of a run, at {KMH * speed:.4g} km/h"
    rows: list[list[Any]] = [["maximum", float(at), float(value), "", ""] for at, value in zip(x, maxima, strict=True)]
    with drawing(height=3.8) as (figure, axes):
        axes.plot(x, maxima, "o", color="#444444", markersize=3, label=f"{count} runs")
        bounds = [order_statistics(count, float(place)) for place in plotting_positions(count)]
        low = [maxima[one] if one is not None else -math.inf for one, _ in bounds]
        high = [maxima[one] if one is not None else math.inf for _, one in bounds]
        band(axes, x, low, high, "#444444")
        for place, fit in enumerate(fits):
            line = np.linspace(maxima[0], max(fit.return_values[-1][1], maxima[-1]), 300)
            probability = cumulative(line, (fit.shape, fit.location, fit.scale))
            inside = (probability > 1e-4) & (probability < 1.0 - 1e-6)
            label = f"{fit.family.upper() if fit.family == 'gev' else 'Gumbel'}, p = {fit.p_value:.2g}"
            style = {"color": WHEEL_COLOURS[place], "linestyle": DASHES[place]}
            axes.plot(reduced_variate(probability[inside]), line[inside], label=label, **style)
            at = reduced_variate(1.0 - 1.0 / np.array([one[0] for one in fit.return_values]))
            value, lower, upper = (np.array([one[k] for one in fit.return_values]) for k in (1, 2, 3))
            errors = [np.maximum(value - lower, 0.0), np.maximum(upper - value, 0.0)]
            axes.errorbar(at + 0.06 * place, value, yerr=errors, fmt="none", ecolor=style["color"], capsize=2)
            rows += [
                [f"{fit.family}: one in {runs:g}", float(where), *numbers]
                for where, (runs, *numbers) in zip(at, fit.return_values, strict=True)
            ]
        for runs in (1e1, 1e2, 1e3, 1e4, 1e5):
            axes.annotate(
                f"1 in {runs:g}", (reduced_variate(1.0 - 1.0 / runs), 0.01), xycoords=("data", "axes fraction"), size=7
            )
        axes.axvspan(float(reduced_variate(1.0 - 1.0 / count)), 12.0, color="#F3F0E6", zorder=0)
        axes.set_xlim(-2.2, 12.0)
        highest = max(
            maxima[-1], *(value for fit in fits for value in (fit.return_values[-1][1], fit.return_values[1][3]))
        )
        axes.set_ylim(maxima[0] - 0.1 * (highest - maxima[0]), highest + 0.15 * (highest - maxima[0]))
        axes.set_xlabel("reduced variate -ln(-ln p) [-]")
        axes.set_ylabel("largest Q/Q0 of a run [-]")
        axes.legend(loc="upper left")
        svg = svg_of(figure, "extremes", title)
    caption = (
        "Each run's largest raw Q/Q0 of any wheelset (points, order-statistic 95 % band) and fits by maximum likelihood"
        " with return values (bars: 95 %, parametric bootstrap). p: Kolmogorov-Smirnov, parametric bootstrap; below"
        " 0.05 the fit is not to be used. Shaded: extrapolation beyond the runs."
    )
    return Picture("extremes", title, caption, svg, ("what", "reduced variate", "Q/Q0 [-]", "low", "high"), rows), fits


def sensitivity_picture(speed: float, units: Units) -> tuple[Picture, list[Sensitivity]] | None:
    """How separation goes with each varied number; None where nothing was varied."""
    found = sensitivities(units)
    if not found:
        return None
    varied = list(dict.fromkeys(one.varied for one in found))
    chosen = [name for name in ("separated", "separations", "ratio_max") if any(one.outcome == name for one in found)]
    labels = {"separated": "whether a run separates", "separations": "how often", "ratio_max": "largest Q/Q0"}
    title = f"What separation depends on, at {KMH * speed:.4g} km/h"
    panels = (
        ("Spearman's rank correlation [-]", ("correlation", "low", "high"), -1.0),
        ("share of the variance [-]", ("share", "share_low", "share_high"), 0.0),
    )
    with drawing(height=1.4 + 0.5 * len(varied), panels=2, sharey=True) as (figure, grid):
        for axes, (label, fields, least) in zip(grid, panels, strict=True):
            for place, outcome in enumerate(chosen):
                style = wheel_style(place + 1)
                of = {one.varied: one for one in found if one.outcome == outcome}
                y = np.arange(len(varied)) + 0.2 * (place - 1)
                value, low, high = (np.array([getattr(of[name], field) for name in varied]) for field in fields)
                errors = [np.maximum(value - low, 0.0), np.maximum(high - value, 0.0)]
                form = {"fmt": style["marker"], "color": style["color"], "capsize": 2}
                axes.errorbar(value, y, xerr=errors, label=labels[outcome], **form)
            axes.axvline(0.0, color="#444444", linewidth=0.8)
            axes.set_yticks(np.arange(len(varied)), varied)
            axes.set_ylim(len(varied) - 0.5, -0.5)
            axes.set_xlim(least, 1.0)
            axes.set_xlabel(label)
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        svg = svg_of(figure, "sensitivity", title)
    numbers = [field for _, fields, _ in panels for field in fields]
    rows = [[one.varied, one.outcome, *(getattr(one, field) for field in numbers), one.runs] for one in found]
    caption = (
        "What any wheelset does in a run against each varied number. Left: rank correlation, which sees what rises or"
        " falls together (bars: 95 %, bootstrap over runs). Right: first-order Sobol index, the share of the variance"
        " that the number alone explains, whichever way it acts (bars: 95 %, regression on polynomials of its rank);"
        " the rest is the irregularity's and that of numbers together."
    )
    ends = ("low (95 %)", "high (95 %)")
    head = ("varied", "outcome", "rank correlation", *ends, "share of variance", *ends, "runs")
    return Picture("sensitivity", title, caption, svg, head, rows), found


def varied_picture(speed: float, units: Units) -> Picture | None:
    """Probability of separation over each varied number, in bins of equally many runs."""
    varied = {name: values for name, values in units.inputs.items() if len(values) >= 20 and np.ptp(values) > 0.0}
    if not varied:
        return None
    separated = np.nan_to_num(units["separations"]) > 0
    rows: list[list[Any]] = []
    title = f"Probability of separation over the varied numbers, at {KMH * speed:.4g} km/h"
    names = list(varied)[:6]
    with drawing(height=2.6, panels=len(names), sharey=True, squeeze=False) as (figure, grid):
        for axes, name in zip(grid[0], names, strict=True):
            order = np.argsort(varied[name], kind="stable")
            parts = np.array_split(order, min(_VARIED_BINS, len(order) // 4))
            x = [float(varied[name][part].mean()) for part in parts]
            counts = [int(separated[part].sum()) for part in parts]
            value = np.array([times / len(part) for times, part in zip(counts, parts, strict=True)])
            bounds = np.array([exact_interval(times, len(part)) for times, part in zip(counts, parts, strict=True)])
            errors = [value - bounds[:, 0], bounds[:, 1] - value]
            axes.errorbar(x, value, yerr=errors, marker="o", color=WHEEL_COLOURS[0], capsize=2)
            axes.set_xlabel(name, fontsize=8)
            axes.ticklabel_format(axis="x", scilimits=(-2, 3))
            rows += [[name, *point] for point in zip(x, value, *bounds.T, map(len, parts), strict=True)]
        grid[0][0].set_ylim(0.0, 1.0)
        grid[0][0].set_ylabel("probability [-]")
        svg = svg_of(figure, "varied", title)
    caption = (
        "Share of runs in which any wheelset separates, in groups of equally many runs (SI units). Bars: exact 95 %."
    )
    head = ("varied", "mean of group", "probability [-]", "low (95 %)", "high (95 %)", "runs")
    return Picture("varied", title, caption, svg, head, rows)
