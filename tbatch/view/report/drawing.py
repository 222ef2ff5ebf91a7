"""How figures look: colours that colour-blind eyes tell apart, with markers and dashes beside them; SVG text."""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from tbatch.campaign.estimates import ANY_WHEELSET

matplotlib.use("svg")

# Okabe and Ito's colours for light ground (Color Universal Design, 2008).
WHEEL_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#8C8C00", "#6A51A3")
ANY_COLOUR = "#000000"
LIMIT_COLOUR = "#B00020"
MARKERS = "osD^vP*X"
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
_STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.5,
    "figure.constrained_layout.use": True,
}


@dataclass(frozen=True)
class Picture:
    """A figure of the report with the numbers behind it."""

    name: str
    """Of its CSV file."""
    title: str
    caption: str
    """What is drawn, how the intervals were made, how many runs."""
    svg: str
    columns: tuple[str, ...]
    """Titles of the CSV's columns, each with its unit."""
    rows: Sequence[Sequence[Any]]
    """The numbers drawn."""


@contextmanager
def drawing(width: float = 7.2, height: float = 3.6, panels: int = 1, **options: Any) -> Iterator[tuple[Figure, Any]]:
    """A figure and its axes, an array of them for several panels side by side.

    Args:
        width: [inch].
        height: [inch].
        panels: How many.
        options: For ``Figure.subplots``.
    """
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(width, height))
        yield figure, figure.subplots(1, panels, **options)


def svg_of(figure: Figure, name: str, alternative: str) -> str:
    """The figure as an SVG element to stand in HTML; the same text for the same figure.

    Args:
        figure: The figure.
        name: Kept in its ids, so that those of two figures never meet in a page.
        alternative: What it shows, for those who cannot see it.
    """
    text = io.StringIO()
    with matplotlib.rc_context({**_STYLE, "svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    meant = set(re.findall(r'(?:href="#|url\(#)([^")]+)', svg))
    svg = re.sub(r' id="([^"]*)"', lambda match: match[0] if match[1] in meant else "", svg)
    shown = alternative.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return svg.replace("<svg ", f'<svg role="img" aria-label="{shown}" ', 1)


def wheel_style(wheel: int) -> dict[str, Any]:
    """Colour, marker and label of a wheelset, counted from 1; any wheelset is black."""
    if wheel == ANY_WHEELSET:
        return {"color": ANY_COLOUR, "marker": "_", "linestyle": ":", "label": "any wheelset"}
    place = wheel - 1
    return {
        "color": WHEEL_COLOURS[place % len(WHEEL_COLOURS)],
        "marker": MARKERS[place % len(MARKERS)],
        "linestyle": DASHES[place % len(DASHES)],
        "label": f"wheelset {wheel}",
    }


def speed_style(place: int, count: int, label: str) -> dict[str, Any]:
    """Colour and dashes of a speed, from dark (slow) to light (fast) in a map made for colour-blind eyes."""
    colour = matplotlib.colormaps["cividis"](0.85 * place / max(count - 1, 1))
    return {"color": colour, "linestyle": DASHES[place % len(DASHES)], "label": label}


def band(axes: Axes, x: ArrayLike, low: ArrayLike, high: ArrayLike, colour: Any, *, step: str | None = None) -> None:
    """An interval as a shaded band; an open end reaches the edge of the picture."""
    below, above = np.array(low, float), np.array(high, float)
    below[~np.isfinite(below)] = -1e30
    above[~np.isfinite(above)] = 1e30
    kind: Any = step
    axes.fill_between(np.asarray(x, float), below, above, color=colour, alpha=0.15, linewidth=0, step=kind)


def log_bottom(smallest: float) -> float:
    """The lower end of a logarithmic axis below a smallest number."""
    return float(10.0 ** np.floor(np.log10(max(smallest, 1e-12)) - 1e-9))
