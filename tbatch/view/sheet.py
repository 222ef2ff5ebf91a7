"""The run sheet: parameters and results of one run on one page of markdown."""

from __future__ import annotations

import numpy as np

from tbatch.view.record import RunRecord


def run_sheet(record: RunRecord) -> str:
    """Give the record's own sheet, or make one: title, results wheel by wheel, properties."""
    if record.sheet is not None:
        return record.sheet
    n = record.samples
    text = [f"# {record.name}", ""]
    if record.title:
        text += [record.title, ""]
    text += ["| wheel | Q0, kN | max, kN | max Q/Q0 | min | lost | longest, ms | total, ms |"]
    text += ["|" + "---:|" * 8]
    for j in range(record.wheel_count):
        force, load = record.contact_force[:n, j], float(record.static_load[j])
        lengths = [1e3 * (event.end - event.start) for event in record.events if event.wheel == j]
        text.append(
            f"| {j + 1} | {1e-3 * load:.1f} | {1e-3 * float(np.max(force)):.1f} | {float(np.max(force)) / load:.2f} "
            f"| {float(np.min(force)) / load:.2f} | {len(lengths)} | {max(lengths, default=0.0):.1f} | {sum(lengths):.1f} |"
        )
    text += ["", f"From {record.position[0]:.1f} m to {record.position[n - 1]:.1f} m (wheel 1), {record.time[n - 1]:.3f} s."]
    if record.properties:
        text += ["", "| property | value |", "|---|---|"]
        text += [f"| {name} | {_printed(value)} |" for name, value in record.properties.items()]
    return "\n".join(text) + "\n"


def _printed(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
