"""Runs of a campaign on the same axes: different ones, or the same ones with other steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tbatch.view import palette
from tbatch.view.kept import record_of
from tbatch.view.overlay import Overlay, Page, Panel, Response
from tbatch.view.record import Array, RunRecord
from tbatch.view.scene import body_names

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign
    from tbatch.engine.result import Result
    from tbatch.engine.runs import SaveAt

KMH = 3.6


@dataclass(frozen=True, eq=False)
class StepResult:
    """Runs of a campaign, simulated again with one step."""

    campaign: Campaign  # as stored, or with another step
    result: Result
    names: Sequence[str]

    @property
    def step(self) -> float:
        """The step [s]."""
        return self.campaign.scenario.model().step


def with_step(campaign: Campaign, step: float, *, threads: int | None = None) -> Campaign:
    """The same campaign with another step; its runs are not the stored ones.

    Raises:
        ScenarioError: If the scenario does not accept the step.
    """
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.store import SCENARIO_NAME
    from tbatch.scenario import Scenario

    tables = dict(campaign.scenario.resolved())
    tables["integration"] = {**tables["integration"], "step": step}
    tables["keep"] = {**tables["keep"], "every": step}
    # The same place as the campaign's own, so that files it names are found.
    scenario = Scenario.from_tables(tables, file=str(campaign.folder / SCENARIO_NAME))
    return Campaign(campaign.store, scenario, threads=threads)


def replay_to_compare(campaign: Campaign, names: Sequence[str]) -> StepResult:
    """Simulate runs again with the histories that are compared, at every step."""
    return StepResult(campaign, campaign.replay_together(names, save=_histories(campaign)), names)


def replay_with_steps(
    campaign: Campaign, names: Sequence[str], steps: Sequence[str], *, threads: int | None = None
) -> list[StepResult]:
    """Simulate runs again with the stored step, and with others.

    Args:
        campaign: The campaign.
        names: Printed ids of runs; one given twice counts once.
        steps: Times such as "0.05 ms", or numbers in s; the stored one among them counts once.
        threads: Threads for runs with other steps.
    """
    names = list(dict.fromkeys(names))
    others = [step for step in dict.fromkeys(map(_seconds, steps)) if abs(step / campaign.step - 1.0) > 1e-9]
    if len(names) < 2 and not others:
        raise ValueError(
            f"runs to compare are {names[0]} with a step of {1e3 * campaign.step:g} ms alone; 2 are needed"
        )
    changed = [with_step(campaign, step, threads=threads) for step in others]  # all are checked before the first runs
    return [replay_to_compare(one, names) for one in (campaign, *changed)]


def _seconds(text: str) -> float:
    """A step [s] as it is typed."""
    from tbatch.scenario.units import UnitError, to_si

    try:
        return to_si(text, "s") if any(map(str.isalpha, text.strip()[-1:])) else float(text)
    except (UnitError, ValueError):
        raise ValueError(f"--step: {text!r} is no time; accepted are such as '0.05 ms' or 5e-5 [s]") from None


def _histories(campaign: Campaign) -> SaveAt:
    from tbatch.engine.runs import SaveAt

    model = campaign.scenario.model()
    under = ("rail_under_wheel",) if model.track.node_dofs else ()
    return SaveAt(model.step, ("contact_force", "vehicle", "vehicle_acceleration", "irregularity", *under))


def overlaid_runs(parts: Sequence[StepResult], *, stored_step: float) -> Overlay:
    """Put runs, with one step or with several, on the same axes.

    Args:
        parts: The same runs, with one step each; the first run of the first part is what others are compared with.
        stored_step: The campaign's own step [s].
    """
    responses: list[Response] = []
    panels: list[Panel] = []
    for part in parts:
        for index, name in enumerate(part.names):
            record = record_of(part.campaign, name, part.result, index)
            label = name if len(parts) == 1 else f"{name}, {1e3 * part.step:g} ms"
            responses.append(_response(record, label, palette.run_colour(len(responses)), part.step))
            panels = panels or _panels(record)
    names = list(dict.fromkeys(name for part in parts for name in part.names))
    notes = ["Simulated again from the seed, colours by run."]
    others = [part.step for part in parts if part.step != stored_step]
    if others:
        steps = ", ".join(f"{1e3 * step:g} ms" for step in others)
        notes.append(f"With {steps} this is **not the stored run**, which has a step of {1e3 * stored_step:g} ms.")
    page = Page(name=" and ".join(names), panels=panels, responses=responses)
    if not page.same_speed:
        notes.append("Speeds differ: look along the chainage; equal times are different places.")
    title = f"{parts[0].campaign.name}: {page.name}"
    if len(parts) > 1:
        title += ", step " + " and ".join(f"{1e3 * part.step:g} ms" for part in parts)
    return Overlay(name=title, pages=[page], notes=notes)


def _panels(record: RunRecord) -> list[Panel]:
    """What is compared: Q/Q0 of every wheel in sight, the rest behind."""
    found = [Panel(f"force/wheel_{j + 1}", f"Q/Q0, wheel {j + 1}", f"{j}") for j in range(record.wheel_count)]
    return found + [Panel(key, title) for key, (title, _) in _further(record).items()]


def _further(record: RunRecord) -> dict[str, tuple[str, Array]]:
    """Quantities beside the force: title and values of each, by key."""
    found: dict[str, tuple[str, Array]] = {}
    if record.rail_under_wheel is not None:
        for j, values in enumerate(np.asarray(record.rail_under_wheel).T):
            found[f"rail/wheel_{j + 1}"] = (f"Rail under wheel {j + 1} [mm]", 1e3 * values)
    if record.vehicle_acceleration is not None:
        for body, name in zip(record.bodies, body_names(record.bodies), strict=True):
            values = np.asarray(record.vehicle_acceleration)[:, body.vertical_dof]
            found[f"acceleration/{name.replace(' ', '_')}"] = (f"Acceleration, {name} [m/s²]", values)
    if record.irregularity is not None:
        found["irregularity"] = ("Irregularity, wheel 1 [mm]", 1e3 * np.asarray(record.irregularity)[:, 0])
    return found


def _response(record: RunRecord, label: str, colour: palette.Colour, step: float) -> Response:
    ratio = record.force_ratio
    values = {f"force/wheel_{j + 1}": ratio[:, j] for j in range(record.wheel_count)}
    values |= {key: history for key, (_, history) in _further(record).items()}
    lengths = [1e3 * (event.end - event.start) for event in record.events]
    return Response(
        name=label,
        colour=colour,
        time=record.time,
        position=record.position,
        values=values,
        events=record.events,
        facts={
            "km/h": f"{record.speed * KMH:.4g}",
            "step, ms": f"{1e3 * step:g}",
            "separations": f"{len(lengths)}",
            "longest, ms": f"{max(lengths, default=0.0):.2f}",
            "max Q/Q0": f"{float(np.max(ratio[: record.samples])):.3f}",
        },
    )
