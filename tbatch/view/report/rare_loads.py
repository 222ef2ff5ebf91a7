"""The wheel load that hardly any run exceeds, and the one that hardly any falls below, bin by bin along the line."""

from typing import Any

import numpy as np

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates.curves import Curve
from tbatch.campaign.estimates.envelope import envelope
from tbatch.campaign.estimates.intervals import runs_needed
from tbatch.view.passages import Passages, passages_of, sound_runs
from tbatch.view.report.drawing import LIMIT_COLOUR, WHEEL_COLOURS, Picture, band, drawing, svg_of

KMH = 3.6
MOST_RUNS = 2500  # from 1,996 on the largest bounds the 99.85 % value
MOST_RUN_STEPS = 2.5e7  # simulated again: a minute on two cores
_CURVES = ((0.9985, "largest", WHEEL_COLOURS[5]), (0.5, "middle", "#222222"), (0.0015, "least", WHEEL_COLOURS[0]))
_COLUMNS = ("chainage [m]", "share of runs", "Q/Q0 [-]", "low (95 %)", "high (95 %)", "runs")


def rare_loads_picture(campaign: Campaign, case: int) -> Picture | None:
    """0.15, 50 and 99.85 % over runs of the leading wheelset's load; None where no run is sound.

    Args:
        campaign: The campaign.
        case: Index of the speed.
    """
    samples = sound_runs(campaign, case, MOST_RUNS, MOST_RUN_STEPS)
    if not samples:
        return None
    curves = rare_loads(passages_of(campaign, case, samples))
    title = f"Wheel load that one run in 667 goes beyond, at {KMH * campaign.speeds[case]:.4g} km/h"
    rows: list[list[Any]] = []
    with drawing(height=3.2) as (figure, axes):
        for (share, _, colour), curve in zip(_CURVES, curves, strict=True):
            axes.plot(curve.x, curve.value, color=colour, linewidth=0.9, label=f"{100 * share:g} %")
            band(axes, curve.x, curve.low, curve.high, colour)
            points = zip(curve.x, curve.value, curve.low, curve.high, strict=True)
            rows += [[float(x), share, *map(float, point), curve.runs] for x, *point in points]
        axes.axhline(0.0, color=LIMIT_COLOUR, linewidth=0.6)
        highest = max((float(curve.value.max()) for curve in curves if len(curve.x)), default=1.0)
        axes.set_ylim(-0.1, 1.15 * highest)
        axes.set_xlabel("chainage of wheelset 1 [m]")
        axes.set_ylabel("Q/Q0 [-]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
        svg = svg_of(figure, "rare_loads", title)
    caption = (
        f"Raw contact force of the leading wheelset from {len(samples):,} runs, simulated again: of each run the"
        " largest value in a bin of 0.25 m or more for 99.85 %, the least for 0.15 %, that at the middle for 50 %."
        " Bands: 95 %, order statistics over runs, pointwise; an open end reaches the edge."
    )
    needed = runs_needed(_CURVES[0][0])
    if len(samples) < needed:
        caption += f" Fewer than {needed:,} runs: the outer curves are the extremes met, and unbounded outwards."
    return Picture("rare_loads", title, caption, svg, _COLUMNS, rows)


def rare_loads(passages: Passages) -> tuple[Curve, ...]:
    """99.85, 50 and 0.15 % over runs of the leading wheelset's load, bin by bin."""
    found = []
    for share, which, _ in _CURVES:
        values = np.asarray(getattr(passages, which))[:, 0]
        found.append(envelope(passages.place, values, (share,)).curves[share])
    return tuple(found)
