"""How strongly the carbody is shaken, speed by speed: only where runs last long enough to say so."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates.intervals import quantile
from tbatch.numerics.ride import LEAST_DURATION, band_passed, weighted
from tbatch.view.passages import sound_runs
from tbatch.view.report.drawing import Picture, drawing, svg_of, wheel_style

if TYPE_CHECKING:
    from tbatch.physics.vehicle import Vehicle

KMH = 3.6
MOST_RUNS = 64
MOST_RUN_STEPS = 4e6  # simulated again for one speed: ten seconds on two cores
_MOST_MEMORY = 128e6  # of histories at a time [bytes]
_SAMPLING = 0.5e-3  # of the accelerations [s]
_SHARES = (0.5, 0.95)
_LABELS = ("0.4 to 10 Hz, RMS [m/s²]", "weighted Wk, RMS [m/s²]")
_COLUMNS = ("speed [km/h]", "place", "quantity", "share of runs", "value [m/s2]", "low (95 %)", "high (95 %)", "runs")


def ride_picture(campaign: Campaign, cases: list[int]) -> Picture | str:
    """RMS of the carbody's acceleration over runs, against the speed; why there is none, where there is none.

    Args:
        campaign: The campaign.
        cases: Indices of the speeds to draw.
    """
    places = carbody_places(campaign.scenario.model().vehicle)
    if not places:
        return "No ride values: the vehicle does not say where its carbody is."
    run = campaign.store.resolved["run"]
    evaluated = float(run["distance"]) - float(run["evaluate_from"])
    long_enough = [case for case in cases if evaluated / campaign.speeds[case] >= LEAST_DURATION]
    if not long_enough:
        return (
            f"No ride values: they take {LEAST_DURATION:g} s at least (EN 12299), and {evaluated:g} m pass in"
            f" {min(evaluated / campaign.speeds[case] for case in cases):.2g} to"
            f" {max(evaluated / campaign.speeds[case] for case in cases):.2g} s."
        )
    found = {KMH * campaign.speeds[case]: _levels(campaign, case, places) for case in long_enough}
    found = {speed: levels for speed, levels in found.items() if levels.size}
    if not found:
        return "No ride values: every run diverged."
    title = "Ride: vertical acceleration of the carbody"
    rows: list[list[Any]] = []
    with drawing(height=3.2, panels=2) as (figure, grid):
        for number, (axes, label) in enumerate(zip(grid, _LABELS, strict=True)):
            for place, name in enumerate(places):
                style = {**wheel_style(place + 1), "label": name}
                value: dict[float, list[tuple[float, float, float]]] = {share: [] for share in _SHARES}
                for speed, levels in found.items():
                    for share in _SHARES:
                        value[share].append(quantile(levels[:, number, place], share))
                        rows.append([speed, name, label, share, *value[share][-1], len(levels)])
                middle, low, high = np.array(value[0.5]).T
                ends = [np.where(np.isfinite(end), np.abs(end - middle), 0.0) for end in (low, high)]
                axes.errorbar(list(found), middle, yerr=ends, capsize=2, **style)
                axes.plot(list(found), np.array(value[0.95])[:, 0], color=style["color"], linewidth=0.6, linestyle=":")
            axes.set_ylim(bottom=0.0)
            axes.set_xlabel("speed [km/h]")
            axes.set_ylabel(label)
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        svg = svg_of(figure, "ride", title)
    runs = min(len(levels) for levels in found.values())
    caption = (
        f"Root mean square over the evaluated part of each of {runs} runs or more, simulated again: of a run in the"
        " middle (bars: 95 %, order statistics over runs; none where the runs are too few) and of one that 95 % stay"
        " below (dotted). Left: behind a fourth-order band-pass (EN 14363); right: behind ISO 2631-1's weighting"
        " Wk. A rigid carbody on a straight line: to compare variants, not to be held against limits."
    )
    return Picture("ride", title, caption, svg, _COLUMNS, rows)


def carbody_places(vehicle: "Vehicle") -> dict[str, NDArray[np.float64]]:
    """Where the first carbody's acceleration is taken, and from which dofs: weights, shape (dof,), by name.

    Its centre; where it pitches also above its foremost and its last bogie, which stand under it.
    """
    carbody = next((body for body in vehicle.bodies if body.kind == "carbody"), None)
    if carbody is None:
        return {}

    def at(ahead: float) -> NDArray[np.float64]:
        weights = np.zeros(vehicle.dof_count)
        weights[carbody.vertical_dof] = 1.0
        if carbody.pitch_dof is not None:
            weights[carbody.pitch_dof] = ahead  # nose-down: a point ahead goes down
        return weights

    places = {"centre": at(0.0)}
    ahead = [carbody.offset - body.offset for body in vehicle.bodies if body.kind == "bogie"]
    under = [distance for distance in ahead if abs(distance) <= 0.5 * carbody.length]
    if carbody.pitch_dof is not None and under and max(under) > min(under):
        places = {"above the leading bogie": at(max(under)), **places, "above the trailing bogie": at(min(under))}
    return places


def _levels(campaign: Campaign, case: int, places: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """RMS of the evaluated part behind both filters [m/s²], shape (run, filter, place)."""
    from tbatch.engine.runs import SaveAt

    samples = sound_runs(campaign, case, MOST_RUNS, MOST_RUN_STEPS)
    every = campaign.step * max(1, int(_SAMPLING / campaign.step * (1.0 + 1e-9)))
    weights = np.array(list(places.values()))
    evaluate_from = float(campaign.store.resolved["run"]["evaluate_from"])
    steps = max(campaign.executor.steps_per_run()[case], 1) * campaign.step / every
    together = max(1, int(_MOST_MEMORY / (8.0 * steps * weights.shape[1])))
    levels = []
    for begin in range(0, len(samples), together):
        pairs = [(case, sample) for sample in samples[begin : begin + together]]
        result = campaign.executor.simulate(pairs, save=SaveAt(every, ("vehicle_acceleration",)))
        runs, _ = campaign.scenario.runs(pairs)
        for speed, history in zip(runs.speed, result.channels["vehicle_acceleration"], strict=True):
            # A run starts in equilibrium: the filters start from rest, and have settled where evaluation begins.
            acceleration = weights @ history[~np.isnan(history).any(axis=1)].T
            evaluated = slice(int(evaluate_from / float(speed) / every), None)
            filtered = (band_passed(acceleration, every), weighted(acceleration, every))
            levels.append([np.sqrt((one[:, evaluated] ** 2).mean(axis=1)) for one in filtered])
    return np.array(levels)
