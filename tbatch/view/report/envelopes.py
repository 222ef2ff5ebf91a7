"""What most runs keep within along the line: the leading wheelset's load and the track under it, speed by speed."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import Units
from tbatch.campaign.estimates.envelope import Envelope, envelope
from tbatch.scenario.run_name import run_name
from tbatch.view.report.drawing import LIMIT_COLOUR, WHEEL_COLOURS, Picture, band, drawing, svg_of

KMH = 3.6
MOST_RUNS = 64  # 59 bound the 95 % value
_SPACING = 0.25  # of the places [m]
_MOST_PLACES = 1000
_COLUMNS = ("speed [km/h]", "quantity", "share of runs", "chainage [m]", "value", "low (95 %)", "high (95 %)", "runs")
_LABELS = {
    "load": "Q/Q0 [-]",
    "rail": "rail under it [mm]",
    "slab": "slab under it [mm]",
    "base": "base plate under it [mm]",
}
_PICTURES = {
    "envelopes": ("Along the line: the leading wheelset's load over runs", ("load", "rail")),
    "track_envelopes": ("Along the line: what the track below the rail does over runs", ("slab", "base")),
}
_SHARES = (
    f"Runs simulated again from their seeds, up to {MOST_RUNS} a speed: the smallest and largest of all, and what"
    " 5, 50 and 95 % of them stay below at each place (bands: 95 %, order statistics over runs, pointwise; an end"
    " that fewer than 59 runs leave open is not shaded)."
)
_MEANINGS = {
    "load": " Left: raw contact force; zero is a separation.",
    "rail": " Right: how far the rail under the wheelset is displaced, negative downwards.",
    "slab": " How far slab and base plate under the wheelset are displaced, negative downwards.",
}


def envelope_pictures(campaign: Campaign, units: Mapping[int, Units]) -> list[Picture]:
    """Quantiles over runs, simulated again, of some speeds: the load and the rail; the layers below, if there are.

    Args:
        campaign: The campaign.
        units: The runs of each case to draw.
    """
    found = {KMH * campaign.speeds[case]: _envelopes(campaign, case, one) for case, one in units.items() if len(one)}
    known = dict.fromkeys(name for of_speed in found.values() for name in of_speed)
    pictures = []
    for name, (title, quantities) in _PICTURES.items():
        drawn = [quantity for quantity in quantities if quantity in known]
        if drawn:
            pictures.append(_picture(name, title, drawn, found))
    return pictures


def _picture(name: str, title: str, quantities: list[str], found: Mapping[float, Mapping[str, Envelope]]) -> Picture:
    rows: list[list[Any]] = []
    with drawing(height=0.9 + 1.25 * len(found)) as (figure, _):
        figure.clear()
        grid = figure.subplots(len(found), len(quantities), sharex=True, sharey="col", squeeze=False)
        for axes, quantity in zip(grid[0], quantities, strict=True):
            axes.set_title(_LABELS[quantity], fontsize=9)
        for line, (speed, of_speed) in zip(grid, found.items(), strict=True):
            for axes, quantity in zip(line, quantities, strict=True):
                _draw(axes, of_speed[quantity])
                rows += _rows(speed, _LABELS[quantity], of_speed[quantity])
                if quantity == "load":
                    axes.axhline(0.0, color=LIMIT_COLOUR, linewidth=0.6)
            line[0].set_ylabel(f"{speed:.4g} km/h")
        for axes in grid[-1]:
            axes.set_xlabel("chainage of wheelset 1 [m]")
        handles, labels = grid[0][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
        svg = svg_of(figure, name, title)
    caption = _SHARES + "".join(_MEANINGS.get(quantity, "") for quantity in quantities)
    return Picture(name, title, caption, svg, _COLUMNS, rows)


def _envelopes(campaign: Campaign, case: int, units: Units) -> dict[str, Envelope]:
    """Of the leading wheelset, from the first runs of a speed."""
    from tbatch.engine.runs import SaveAt

    scenario = campaign.scenario
    names = [run_name(case, int(sample)) for sample in units.sample[:MOST_RUNS]]
    speeds = units.inputs["speed"][: len(names)]
    run = scenario.resolved()["run"]
    start, end = float(run["start"]), float(run["start"]) + float(run["distance"])
    begin = start + float(run["evaluate_from"])
    x = np.linspace(begin, end, 1 + max(1, min(_MOST_PLACES, round((end - begin) / _SPACING))))
    # Four samples between places: what is drawn is the load at a place, not a mean around it.
    every = campaign.step * max(1, int(0.25 * (x[1] - x[0]) / speeds.max() / campaign.step))
    under = {f"{layer}_under_wheel": layer for layer in scenario.model().track.layers}
    result = campaign.replay_together(names, save=SaveAt(every, ("contact_force", *under)))
    load = result.summary["static_load"].to_numpy().reshape(len(names), -1)[:, 0]
    places = start + speeds[:, None] * result.time

    def at(values: NDArray[np.float64]) -> NDArray[np.float64]:
        pairs = zip(places, values, strict=True)
        return np.array([np.interp(x, place, value, right=np.nan) for place, value in pairs])

    found = {"load": envelope(x, at(result.contact_force[:, :, 0] / load[:, None]))}
    for channel, layer in under.items():
        found[layer] = envelope(x, -1e3 * at(result.channels[channel][:, :, 0]))
    return found


def _draw(axes: Any, one: Envelope) -> None:
    axes.fill_between(one.x, one.least, one.most, color="#E4E4E4", linewidth=0, label="all")
    for (share, curve), colour in zip(one.curves.items(), (WHEEL_COLOURS[5], "#222222", WHEEL_COLOURS[0]), strict=True):
        axes.plot(curve.x, curve.value, color=colour, linewidth=0.9, label=f"{100 * share:g} %")
        low, high = (np.where(np.isfinite(end), end, curve.value) for end in (curve.low, curve.high))
        band(axes, curve.x, low, high, colour)


def _rows(speed: float, label: str, one: Envelope) -> list[list[Any]]:
    runs = next(iter(one.curves.values())).runs
    rows: list[list[Any]] = []
    for name, values in (("smallest", one.least), ("largest", one.most)):
        rows += [[speed, label, name, float(x), float(y), "", "", runs] for x, y in zip(one.x, values, strict=True)]
    for share, curve in one.curves.items():
        points = zip(curve.x, curve.value, curve.low, curve.high, strict=True)
        rows += [[speed, label, share, *map(float, point), runs] for point in points]
    return rows
