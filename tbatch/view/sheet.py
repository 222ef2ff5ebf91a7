"""The run sheet: parameters and results of one run on one page of markdown."""

from __future__ import annotations

import numpy as np

from tbatch.view.record import RunRecord


def run_sheet(record: RunRecord) -> str:
    """Give the record's own sheet, or make one: results wheel by wheel, then properties and parameters."""
    if record.sheet is not None:
        return record.sheet
    last = record.samples - 1
    text = [f"# {record.name}", "", record.title, ""]
    if record.properties.get("status") == "diverged":
        text += [f"**Diverged at {record.time[last]:.4f} s**: shown up to there, left out of the statistics.", ""]
    text += ["| wheel | Q0, kN | max, kN | max Q/Q0 | min | lost | longest, ms | total, ms |", "|" + "---:|" * 8]
    for j, ratio in enumerate(record.force_ratio[: last + 1].T):
        load = 1e-3 * float(record.static_load[j])
        most, least = float(np.max(ratio)), float(np.min(ratio))
        lengths = [1e3 * (event.end - event.start) for event in record.events if event.wheel == j]
        cells = [f"{j + 1}", f"{load:.1f}", f"{most * load:.1f}", f"{most:.2f}", f"{least:.2f}"]
        cells += [f"{len(lengths)}", f"{max(lengths, default=0.0):.1f}", f"{sum(lengths):.1f}"]
        text.append("| " + " | ".join(cells) + " |")
    way = f"{record.position[0]:.1f} m to {record.position[last]:.1f} m"
    text += [
        "",
        f"Wheel 1 from {way} in {record.time[last] - record.time[0]:.3f} s; separations of the warm-up included.",
    ]
    if record.properties:
        text += ["", "| property | value |", "|---|---|"]
        text += [f"| {name} | {_printed(value)} |" for name, value in record.properties.items()]
    if record.parameters:
        text += ["", "| parameter | value |", "|---|---|"]
        text += [f"| {name} | {value} |" for name, value in record.parameters.items()]
    return "\n".join(text) + "\n"


def _printed(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
