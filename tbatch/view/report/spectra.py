"""Spectra of single runs and of the running surface: third octaves over frequency, densities over wavenumber."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import Units
from tbatch.physics.irregularity import Irregularity
from tbatch.view.report.drawing import ANY_COLOUR, LIMIT_COLOUR, WHEEL_COLOURS, Picture, band, drawing, svg_of
from tbatch.view.report.drawing import wheel_style as style_of

THIRD_OCTAVES = 10.0 ** (np.arange(0, 34) / 10.0)
"""Band centres from 1 Hz to 2 kHz [Hz], IEC 61260, base ten."""
MOST_SURFACES = 64
_SPACING = 0.02  # of the surface's points [m]
_FEWEST_PLACES = 16  # of a line that is long enough to have a spectrum
_FREEDOM = 0.7  # of a Hann-windowed segment among half-overlapping ones, as if it were independent

Series = Mapping[str, NDArray[np.float64]]
"""What is drawn in a panel, by its label: shape (n,), one entry a time step."""


def third_octaves(series: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """RMS in third octaves with its 95 % interval: columns band centre [Hz], RMS, low, high.

    Welch's method; the interval is the chi-square one of the averaged periodograms.

    Args:
        series: Samples, NaN after the end, shape (n,).
        step: Time between them [s].
    """
    from scipy.signal import welch
    from scipy.stats import chi2

    series = series[~np.isnan(series)]
    length = min(len(series), max(256, len(series) // 4))
    frequency, density = welch(series, 1.0 / step, "hann", nperseg=length)
    averaged = max(1, 2 * len(series) // length - 1)
    points = []
    for middle in THIRD_OCTAVES:
        inside = (frequency >= middle * 10**-0.05) & (frequency < middle * 10**0.05)
        if inside.any():
            level = float(np.sqrt(density[inside].sum() * frequency[1]))
            freedom = 2.0 * _FREEDOM * averaged * np.count_nonzero(inside)
            ends = [level * float(np.sqrt(freedom / chi2.ppf(q, freedom))) for q in (0.975, 0.025)]
            points.append([float(middle), level, *ends])
    return np.array(points).reshape(-1, 4)


def spectra_picture(loads: Series, accelerations: Series, step: float, marks: Mapping[str, float]) -> Picture:
    """Third octaves of the leading wheelset's load, and of accelerations down the vehicle.

    Args:
        loads: Q/Q0 of the runs.
        accelerations: Of the bodies of the first of them [m/s²].
        step: Time step [s].
        marks: Frequencies to mark [Hz], by what passes at them.
    """
    name, title = "spectra", "Third-octave spectra of the load and of the accelerations"
    rows: list[list[Any]] = []
    with drawing(height=3.2, panels=2) as (figure, grid):
        panels = ((loads, "RMS of Q/Q0 [-]", "-"), (accelerations, "RMS of the acceleration [m/s²]", "m/s2"))
        for axes, (series, label, unit) in zip(grid, panels, strict=True):
            for place, (what, values) in enumerate(series.items()):
                data = third_octaves(values, step)
                errors = [data[:, 1] - data[:, 2], data[:, 3] - data[:, 1]]
                axes.errorbar(
                    data[:, 0], data[:, 1], yerr=errors, elinewidth=0.8, **{**style_of(place + 1), "label": what}
                )
                rows += [[what, *map(float, point), unit] for point in data]
            for place, (what, frequency) in enumerate(marks.items()):
                axes.axvline(frequency, color="#777777", linewidth=0.8, linestyle=":")
                height = 1.01 + 0.05 * place  # two marks may stand close together
                axes.annotate(what, (frequency, height), xycoords=("data", "axes fraction"), size=7, ha="center")
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlabel("band centre [Hz]")
            axes.set_ylabel(label)
            axes.legend(loc="lower left", fontsize=7)
        svg = svg_of(figure, name, title)
    caption = (
        "RMS in third octaves (IEC 61260, base ten), Welch's method with Hann windows and half overlap: the leading"
        " wheelset's Q/Q0, and bodies of the worst run. Bars: 95 % chi-square interval of the averaged periodograms,"
        " which takes the record for stationary. P2: where the wheelset and the track under it resonate."
    )
    return Picture(
        name, title, caption, svg, ("what", "band centre [Hz]", "RMS", "low (95 %)", "high (95 %)", "unit"), rows
    )


def surface_picture(campaign: Campaign, units: Units) -> Picture | None:
    """Density of the running surfaces against the spectrum asked for; None without one, or where the line is short."""
    from scipy.signal import detrend, periodogram
    from scipy.stats import chi2

    scenario = campaign.scenario
    section = scenario.document.irregularity
    target = section.density
    if target is None or section.wavelengths is None or not len(units):
        return None
    tables = campaign.store.resolved["run"]
    low, high = float(tables["start"]) + float(tables["taper"]), float(tables["start"]) + float(tables["distance"])
    x = np.arange(low, high, _SPACING)
    if len(x) < _FEWEST_PLACES:
        return None
    samples: Sequence[int] = [int(sample) for sample in units.sample[:MOST_SURFACES]]
    # The spline that a run meets: its waves are summed by FFT, those of a long line one by one would take minutes.
    surfaces = np.array([Irregularity.of(scenario.irregularity(sample)).spline(low, high)(x) for sample in samples])
    wavenumber, each = periodogram(detrend(surfaces), 1.0 / _SPACING, "hann")
    shortest, longest = section.wavelengths
    inside = (wavenumber >= max(1.0 / longest, 2.5 * wavenumber[1])) & (wavenumber <= 1.0 / shortest)
    if not inside.any():
        return None
    wavenumber, density = wavenumber[inside], each[:, inside].mean(axis=0)
    freedom = 2.0 * len(samples)
    low_end, high_end = (density * freedom / float(chi2.ppf(q, freedom)) for q in (0.975, 0.025))
    scale = 1.0 if section.scale is None else section.scale
    wanted = scale**2 * np.asarray(target(wavenumber), float)
    name, title = "irregularity", "Density of the irregularity"
    with drawing(height=3.2) as (figure, axes):
        axes.plot(wavenumber, density, color=WHEEL_COLOURS[0], linewidth=0.9, label=f"{len(samples)} samples")
        band(axes, wavenumber, low_end, high_end, WHEEL_COLOURS[0])
        axes.plot(wavenumber, wanted, color=ANY_COLOUR, linestyle="--", label=str(section.spectrum))
        if section.tail is not None and section.tail_from is not None:
            axes.axvline(section.tail_from, color=LIMIT_COLOUR, linewidth=0.8, linestyle=":")
            axes.annotate(" tail", (section.tail_from, 0.03), xycoords=("data", "axes fraction"), size=8)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(0.2 * float(min(wanted.min(), density.min())), 5.0 * float(max(wanted.max(), density.max())))
        axes.set_xlabel("wavenumber [1/m]")
        axes.set_ylabel("density [m²/(1/m)]")
        other = axes.secondary_xaxis("top", functions=(_inverse, _inverse))
        other.set_xlabel("wavelength [m]")
        axes.legend(loc="lower left")
        svg = svg_of(figure, name, title)
    caption = (
        "Mean of the periodograms (Hann window, trend removed) of the surfaces over the line that is run, each sample"
        " once, and the density asked for. Band: 95 % chi-square interval, of surfaces taken for Gaussian."
    )
    if any(key.startswith("irregularity.") for key in campaign.records.varied):
        caption += " The samples vary in numbers of their own; the density asked for is the scenario's."
    points = zip(wavenumber, density, low_end, high_end, wanted, strict=True)
    rows = [[*map(float, point), len(samples)] for point in points]
    head = ("wavenumber [1/m]", "density [m2/(1/m)]", "low (95 %)", "high (95 %)", "asked for", "samples")
    return Picture(name, title, caption, svg, head, rows)


def _inverse(values: Any) -> Any:
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(values, float)
