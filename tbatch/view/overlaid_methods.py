"""The methods of a comparison on the same axes: a page a step, each method beside the reference."""

from __future__ import annotations

from typing import Any

import numpy as np

from tbatch.engine.result import Result
from tbatch.methods.case import METHODS, Case
from tbatch.methods.comparison import Comparison, Score
from tbatch.view import palette
from tbatch.view.overlay import Overlay, Page, Panel, Response
from tbatch.view.record import Array, separation_of

BEYOND = 20.0  # Q/Q0 at which a method that runs away leaves the picture


def overlaid_methods(comparison: Comparison) -> Overlay:
    """Put every method with every step beside the reference."""
    case = comparison.case
    reference = next(result for (name, _), result in comparison.responses.items() if name == "reference")
    panels = _panels(case)
    pages = []
    for step in sorted({score.step for score in comparison.scores}):
        fine = f"{1e3 * comparison.reference_step:g}"
        facts = {"law": case.law("own"), "solved, ms": fine}
        responses = [_response(case, "reference", reference, facts)]
        for score in comparison.scores:
            if score.step == step:
                result = comparison.responses[score.method, step]
                responses.append(_response(case, score.method, result, _facts(score)))
        pages.append(Page(name=f"step {1e3 * step:g} ms", panels=panels, responses=responses))
    notes = [
        f"One run at {case.speed * 3.6:.4g} km/h. The reference is the two-step scheme with the scenario's own contact "
        f"law and a step of {1e3 * comparison.reference_step:g} ms; what a linear law differs from it is no error of a "
        "time integration, and the errors in the table are against a reference of the method's own law.",
        f"A method that runs away is drawn until it reaches {BEYOND:g} static loads.",
    ]
    return Overlay(name=f"{case.name}: methods", pages=pages, notes=notes)


def _facts(score: Score) -> dict[str, str]:
    error = score.error.get("force", float("nan"))
    return {
        "law": score.law,
        "solved, ms": f"{1e3 * score.step:g}",
        "outcome": score.outcome,
        "error of the force, %": f"{100 * error:.3g}" if np.isfinite(error) and error < 1e3 else "-",
        "solves a step": f"{score.iterations_mean:.1f}",
    }


def _panels(case: Case) -> list[Panel]:
    wheels = range(1, case.model.vehicle.wheel_count + 1)
    panels = [Panel(f"force/wheel_{j}", f"Q/Q0, wheel {j}", "force") for j in wheels]
    panels += [Panel(f"acceleration/wheel_{j}", f"Acceleration, wheel {j} [m/s²]", "acceleration") for j in wheels]
    if case.model.track.node_dofs:
        panels += [
            Panel("rail", f"Rail at {case.point:g} m [mm]", "rail"),
            Panel("rail_acceleration", f"Acceleration of the rail at {case.point:g} m [m/s²]", "rail acceleration"),
        ]
    return panels


def _response(case: Case, name: str, result: Result, facts: dict[str, str]) -> Response:
    ratio = np.asarray(result.contact_force[0]) / case.model.static_load
    values: dict[str, Array] = {}
    for j, dof in enumerate(case.model.vehicle.wheel_dofs):
        values[f"force/wheel_{j + 1}"] = ratio[:, j]
        values[f"acceleration/wheel_{j + 1}"] = result.vehicle_acceleration[0][:, dof]
    if case.model.track.node_dofs:
        values["rail"] = 1e3 * result.rail[0][:, 0]
        values["rail_acceleration"] = result.rail_acceleration[0][:, 0]
    gone = np.flatnonzero(~(np.abs(ratio).max(axis=1) <= BEYOND))
    if len(gone):
        values = {key: np.where(np.arange(len(ratio)) < max(gone[0], 2), history, np.nan)
                  for key, history in values.items()}  # fmt: skip
    time = np.asarray(result.time)
    last = float(time[gone[0]] if len(gone) else time[-1])
    rows: list[dict[str, Any]] = result.separations.to_pylist()
    return Response(
        name=name,
        colour=palette.run_colour(["reference", *METHODS].index(name)),
        time=time,
        position=case.start + case.speed * time,
        values=values,
        events=[separation_of(row) for row in rows if row["end"] <= last],
        facts=facts,
    )
