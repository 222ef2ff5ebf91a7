"""Figures of single runs, simulated again: the worst and a median one, and their spectra."""

from typing import Any

import numpy as np

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import Units
from tbatch.scenario.run_name import run_name
from tbatch.view.report.drawing import LIMIT_COLOUR, Picture, drawing, svg_of, wheel_style

KMH = 3.6
_THIRD_OCTAVES = np.arange(0, 34)  # IEC 61260, base ten: 1 Hz to 2 kHz
_MOST_ROWS = 20_000


def chosen_runs(units: Units) -> tuple[int, int]:
    """Places of the worst run (longest separation, then largest Q/Q0) and of the median one of the largest Q/Q0."""
    worst = np.lexsort((units["ratio_max"], units["longest"]))[-1]
    median = np.argsort(units["ratio_max"], kind="stable")[(len(units) - 1) // 2]
    return int(worst), int(median)


def history_pictures(campaign: Campaign, case: int, units: Units) -> list[Picture]:
    """Histories of both runs, simulated again bit for bit, and third-octave levels of their contact forces."""
    from tbatch.engine.runs import SaveAt

    names = [run_name(case, int(units.sample[place])) for place in dict.fromkeys(chosen_runs(units))]
    step = campaign.step
    save = SaveAt(every=step, channels=("contact_force", "irregularity"))
    result = campaign.replay_together(names, save=save)
    load = np.asarray(result.summary["static_load"].to_numpy()).reshape(len(names), -1)
    ratio = result.contact_force / load[:, None, :]
    speeds = units.inputs["speed"][[int(np.searchsorted(units.sample, campaign.pair(name)[1])) for name in names]]
    run = campaign.store.resolved["run"]
    start = float(run["start"])
    offsets = campaign.scenario.model().vehicle.wheel_offsets
    words = ["the worst run", "a median run"][: len(names)]
    pictures = [
        _history(
            name,
            word,
            start + speed * result.time,
            ratio[index],
            result.irregularity[index],
            float(speed),
            run,
            offsets,
        )
        for index, (name, word, speed) in enumerate(zip(names, words, speeds, strict=True))
    ]
    return [*pictures, _spectra(names, words, ratio, step)]


def _history(
    name: str, word: str, x: Any, ratio: Any, irregularity: Any, speed: float, run: Any, offsets: Any
) -> Picture:
    title = f"Wheel load along the line: {word}, {name}, {KMH * speed:.4g} km/h"
    wheels = ratio.shape[1]
    known = ~np.isnan(ratio[:, 0])
    x, ratio, irregularity = x[known], ratio[known], irregularity[known]
    with drawing(height=1.0 + 0.9 * (wheels + 1)) as (figure, _):
        figure.clear()
        grid = figure.subplots(wheels + 1, 1, sharex=True)
        for wheel, axes in enumerate(grid[:-1], start=1):
            style = wheel_style(wheel)
            axes.plot(x, ratio[:, wheel - 1], color=style["color"], linewidth=0.7)
            gone = ratio[:, wheel - 1] <= 0.0
            axes.fill_between(x, 0, 1, where=gone, color=LIMIT_COLOUR, alpha=0.35, transform=axes.get_xaxis_transform())
            axes.axhline(1.0, color="#888888", linewidth=0.6)
            axes.set_ylim(bottom=-0.1)
            axes.set_ylabel(f"wheelset {wheel}\nQ/Q0 [-]", fontsize=8)
        grid[-1].plot(x, 1e3 * irregularity[:, 0], color="#444444", linewidth=0.8)
        grid[-1].invert_yaxis()
        grid[-1].set_ylabel("r [mm]", fontsize=8)
        grid[-1].set_xlabel("chainage of wheelset 1 [m]")
        for axes, offset in zip(grid, (*offsets, 0.0), strict=True):
            axes.axvspan(x[0], float(run["start"]) + float(run["evaluate_from"]) + offset, color="#EEEEEE", zorder=0)
        svg = svg_of(figure, f"history_{name}", title)
    every = max(1, len(x) // _MOST_ROWS + 1)
    rows = np.column_stack([x, ratio, irregularity[:, 0]])[::every].tolist()
    head = ("chainage [m]", *(f"Q/Q0 of wheelset {wheel} [-]" for wheel in range(1, wheels + 1)), "irregularity [m]")
    caption = (
        "One run, simulated again from its seed. Red: separated. Grey: not evaluated yet, later for each wheelset."
        " Below: the irregularity under wheelset 1, dips down. A single record, so without an interval."
    )
    return Picture(f"history_{name}", title, caption, svg, head, rows)


def _spectra(names: list[str], words: list[str], ratio: Any, step: float) -> Picture:
    """Third-octave levels of the leading wheelset's Q/Q0, with the interval of the averaged periodograms."""
    from scipy.signal import welch
    from scipy.stats import chi2

    title = "Third-octave spectrum of the leading wheelset's load"
    rows: list[list[Any]] = []
    with drawing(height=3.0) as (figure, axes):
        for place, (name, word) in enumerate(zip(names, words, strict=True)):
            series = ratio[place, :, 0]
            series = series[~np.isnan(series)]
            length = min(len(series), max(256, len(series) // 4))
            frequency, density = welch(series, 1.0 / step, "hann", nperseg=length)
            centre = 1000.0 * 10.0 ** ((_THIRD_OCTAVES - 30) / 10.0)
            width = frequency[1]
            averaged = max(1, 2 * len(series) // length - 1)
            points = []
            for middle in centre:
                inside = (frequency >= middle * 10**-0.05) & (frequency < middle * 10**0.05)
                if inside.any():
                    level = float(np.sqrt(density[inside].sum() * width))
                    freedom = 2.0 * 0.7 * averaged * np.count_nonzero(inside)
                    ends = [level * float(np.sqrt(freedom / chi2.ppf(q, freedom))) for q in (0.975, 0.025)]
                    points.append([float(middle), level, *ends])
            data = np.array(points)
            style = wheel_style(place + 1)
            errors = [data[:, 1] - data[:, 2], data[:, 3] - data[:, 1]]
            axes.errorbar(data[:, 0], data[:, 1], yerr=errors, **{**style, "label": f"{word}, {name}"}, elinewidth=0.8)
            rows += [[name, *point] for point in points]
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("band centre [Hz]")
        axes.set_ylabel("RMS of Q/Q0 in the band [-]")
        axes.legend(loc="lower left")
        svg = svg_of(figure, "spectra", title)
    caption = (
        "RMS of Q/Q0 in third octaves (IEC 61260, base ten), Welch's method with Hann windows and half overlap."
        " Bars: 95 % chi-square interval of the averaged periodograms, which takes the record for stationary."
    )
    head = ("run", "band centre [Hz]", "RMS [-]", "low (95 %)", "high (95 %)")
    return Picture("spectra", title, caption, svg, head, rows)
