"""Figures of single runs, simulated again: the worst and a median one."""

from typing import TYPE_CHECKING, Any

import numpy as np

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import Units
from tbatch.numerics.resonance import p2_frequency
from tbatch.scenario.run_name import run_name
from tbatch.view.report.drawing import LIMIT_COLOUR, Picture, drawing, svg_of, wheel_style
from tbatch.view.report.spectra import spectra_picture

if TYPE_CHECKING:
    from tbatch.engine.model import Model
    from tbatch.physics.vehicle import Vehicle

KMH = 3.6
_MOST_ROWS = 20_000


def chosen_runs(units: Units) -> tuple[int, int]:
    """Places of the worst run (longest separation, then largest Q/Q0) and of the median one of the largest Q/Q0."""
    worst = np.lexsort((units["ratio_max"], units["longest"]))[-1]
    median = np.argsort(units["ratio_max"], kind="stable")[(len(units) - 1) // 2]
    return int(worst), int(median)


def history_pictures(campaign: Campaign, case: int, units: Units) -> list[Picture]:
    """Histories of both runs, simulated again bit for bit, and third octaves of their forces and accelerations."""
    from tbatch.engine.runs import SaveAt

    names = [run_name(case, int(units.sample[place])) for place in dict.fromkeys(chosen_runs(units))]
    step = campaign.step
    save = SaveAt(every=step, channels=("contact_force", "irregularity", "vehicle_acceleration"))
    result = campaign.replay_together(names, save=save)
    load = np.asarray(result.summary["static_load"].to_numpy()).reshape(len(names), -1)
    ratio = result.contact_force / load[:, None, :]
    speeds = units.inputs["speed"][[int(np.searchsorted(units.sample, campaign.pair(name)[1])) for name in names]]
    run = campaign.store.resolved["run"]
    start = float(run["start"])
    model = campaign.scenario.model()
    offsets = model.vehicle.wheel_offsets
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
    loads = {f"{word}, {name}": ratio[index, :, 0] for index, (name, word) in enumerate(zip(names, words, strict=True))}
    bodies = _bodies(model.vehicle)
    accelerations = {name: result.channels["vehicle_acceleration"][0, :, dof] for name, dof in bodies.items()}
    return [*pictures, spectra_picture(loads, accelerations, step, marked_frequencies(model, float(speeds[0])))]


def marked_frequencies(model: "Model", speed: float) -> dict[str, float]:
    """Frequencies that an engineer looks for in a spectrum [Hz]: seats passing by, the wheelset upon the track (P2).

    Args:
        model: The model.
        speed: [m/s].
    """
    track = model.track
    marks = {}
    if track.kind == "slab":
        marks["fasteners"] = speed / (track.element_length * track.period)
    p2 = p2_frequency(model.vehicle, model.ground) if track.node_dofs else None
    return marks if p2 is None else {"P2": p2, **marks}


def _bodies(vehicle: "Vehicle") -> dict[str, int]:
    """Dof of the leading body of each kind, from the wheel up, by its name."""
    first = {vehicle.dof_names[vehicle.wheel_dofs[0]]: int(vehicle.wheel_dofs[0])}
    for kind in ("bogie", "carbody"):
        dofs = [dof for dof, name in enumerate(vehicle.dof_names) if kind in name and "pitch" not in name]
        first |= {vehicle.dof_names[dof]: dof for dof in dofs[:1]}
    return first


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
