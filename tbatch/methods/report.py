"""A comparison as text, as JSON and as CSV."""

import csv
import json
from pathlib import Path

import numpy as np

from tbatch.methods.comparison import MEASURES, Comparison

_SHORT = {
    "displacement": "displ.",
    "force": "force",
    "wheel_acceleration": "wheel acc.",
    "track_acceleration": "rail acc.",
}


def comparison_text(comparison: Comparison) -> str:
    """The table that is printed."""
    case = comparison.case
    measures = [name for name in MEASURES if name in comparison.reference_error]
    head = [
        "method",
        "law",
        "step, ms",
        "steps",
        "time, s",
        "cpu, s",
        "solves/step",
        *(_SHORT[name] for name in measures),
    ]
    head += ["pull, kN", "radius", "outcome"]
    rows = [head]
    for score in comparison.scores:
        rows.append(
            [
                score.method,
                score.law,
                f"{score.step * 1e3:g}",
                f"{score.steps}",
                f"{score.wall_time:.2f}",
                f"{score.cpu_time:.2f}",
                f"{score.iterations_mean:.1f} (most {score.iterations_max})",
                *(_percent(score.error[name]) for name in measures),
                f"{score.pull * 1e-3:.1f}" if score.outcome != "unstable" else "-",
                f"{score.radius:.3f}",
                score.outcome,
            ]
        )
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    own, doubled = comparison.reference_error, comparison.law_difference
    return "\n".join(
        [
            f"{case.name}: {case.speed * 3.6:g} km/h, {case.duration:g} s, {case.model.contact.law} contact",
            "",
            *lines,
            "",
            f"Errors are in % against the batch engine's two-step with {comparison.reference_step * 1e3:g} ms and the "
            "method's own contact law:",
            "displacement of the rail at mid-track by the static one, force by the static load, accelerations by the "
            "largest.",
            "The reference moves by " + _listed(own, measures) + " when its step is doubled.",
            "The linear law differs from the scenario's by " + _listed(doubled, measures) + ".",
            "Radius: spectral radius at the track's highest frequency; at 1 what is excited there rings on.",
            "Pull: largest force by which a lagged method held a wheel that had left the rail.",
        ]
    )


def save_comparison(comparison: Comparison, folder: Path) -> list[Path]:
    """Write methods.json, methods.csv and the responses behind the plots.

    Args:
        comparison: What to write.
        folder: Where to; it is made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    document = folder / "methods.json"
    document.write_text(json.dumps(_without_nan(comparison.document()), indent=1), encoding="utf-8")
    rows = [score.row() for score in comparison.scores]
    table = folder / "methods.csv"
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    steps = dict.fromkeys((comparison.case.model.step, max(score.step for score in comparison.scores)))
    return [document, table, *(_save_responses(comparison, step, folder) for step in steps)]


def _save_responses(comparison: Comparison, step: float, folder: Path) -> Path:
    """Histories of all methods with one step, and of the reference at the same times."""
    case, wheel = comparison.case, comparison.case.model.vehicle.wheel_dofs[0]
    columns: dict[str, np.ndarray] = {}
    for (name, of), result in comparison.responses.items():
        every = round(step / of) if name == "reference" else 1
        if name != "reference" and of != step:
            continue
        columns.setdefault("time_s", result.time[::every])
        columns[f"{name}: force of wheel 1, N"] = result.contact_force[0][::every, 0]
        columns[f"{name}: acceleration of wheel 1, m/s2"] = result.vehicle_acceleration[0][::every, wheel]
        for layer in case.model.track.layers:
            columns[f"{name}: {layer} at {case.point:g} m, m"] = result.channels[layer][0][::every, 0]
        if case.model.track.node_dofs:
            columns[f"{name}: rail acceleration at {case.point:g} m, m/s2"] = result.rail_acceleration[0][::every, 0]
    path = folder / f"responses_{step * 1e6:g}us.csv"
    count = min(len(values) for values in columns.values())
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(values[:count].tolist() for values in columns.values()), strict=True))
    return path


def _percent(error: float) -> str:
    if not np.isfinite(error):
        return "-"
    return f"{100.0 * error:.3g}" if error < 100.0 else ">10000"


def _listed(errors: dict[str, float], measures: list[str]) -> str:
    return ", ".join(f"{_SHORT[name]} {100.0 * errors[name]:.2g} %" for name in measures)


def _without_nan(value: object) -> object:
    """JSON has no NaN: null stands for it."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
