"""From a campaign's kept runs to recordings: simulates them again with histories and writes an .rrd file for each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from tbatch.view.record import Array, RunRecord
from tbatch.view.scene import FRAME_INTERVAL, MARGIN, OVERHANG
from tbatch.view.timeline import RecordingUnavailable, check_loadable, write_recording

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign
    from tbatch.campaign.recordings import Recorder
    from tbatch.engine.model import Model
    from tbatch.engine.result import Result
    from tbatch.engine.runs import Runs, SaveAt
    from tbatch.physics.line import Line
    from tbatch.scenario import Scenario

LAYERS = ("rail", "slab", "base")
LINE_SPACING = 0.02  # between drawn places of the irregularity [m]
MOST_PLACES = 20_000  # of the irregularity along the line
MOST_MEMORY = 64e6  # of a run's track histories [bytes]
KMH = 3.6


def write_kept(campaign: Campaign, names: Sequence[str], folder: Path) -> None:
    """Write ``<name>.rrd`` into a folder for each named run.

    Args:
        campaign: The campaign.
        names: Printed ids, ``c03-s000127``.
        folder: Where to write.
    """
    result = replay_with_histories(campaign, names)
    for index, name in enumerate(names):
        write_recording(record_of(campaign, name, result, index), folder / f"{name}.rrd")


def recorder(message: Callable[[str], None]) -> Recorder:
    """The campaign's recorder; where rerun cannot be loaded it says so once and writes nothing.

    Args:
        message: Where to say it.
    """
    said: list[str] = []

    def record(campaign: Campaign, names: Sequence[str], folder: Path) -> None:
        try:
            check_loadable()
        except RecordingUnavailable as error:
            if not said:
                message(f"no recordings of the kept runs: {error}")
            said.append(str(error))
            return
        write_kept(campaign, names, folder)

    return record


def replay_with_histories(campaign: Campaign, names: Sequence[str]) -> Result:
    """Simulate runs again, keeping the channels that the scenario keeps."""
    return campaign.replay_together(names, save=histories_to_keep(campaign))


def histories_to_keep(campaign: Campaign) -> SaveAt:
    """Say which histories recordings of a campaign need: its [keep] table, and the places along its track."""
    from tbatch.engine.runs import SaveAt

    keep, track = campaign.scenario.keep, campaign.scenario.model().track
    channels = tuple(dict.fromkeys(("contact_force", *(keep.channels or ()))))
    every = float(keep.every or campaign.step)
    if track.window is not None:
        # The places of an endless track come and go; rail and slab under the wheels stay.
        channels = tuple(name for name in channels if name not in (*LAYERS, "rail_acceleration"))
        under = (f"{layer}_under_wheel" for layer in ("rail", "slab") if layer in track.layers)
        channels = tuple(dict.fromkeys((*channels, *under)))
    layers = sum(name in LAYERS or name == "rail_acceleration" for name in channels)
    if not layers:
        return SaveAt(every, channels)
    samples = max(campaign.executor.steps_per_run()) * campaign.step / every + 1
    most = max(16, int(MOST_MEMORY / (8.0 * layers * samples)))
    return SaveAt(every, channels, rail_at=_places(campaign, track, most))


def _places(campaign: Campaign, track: Line, most: int) -> Array:
    """Choose places along the track: one a bay, or wider apart, wherever the side view looks [m]."""
    runs, duration = campaign.scenario.runs([(0, 0)])
    rear = float(campaign.scenario.model().vehicle.wheel_offsets.max())
    low = max(track.begin, float(runs.start[0]) - rear - MARGIN - OVERHANG)
    high = min(track.end, float(runs.start[0] + runs.speed[0] * duration[0]) + MARGIN + OVERHANG)
    spacing = track.element_length * max(track.period, round(0.5 / track.element_length))
    spacing *= max(1, int(np.ceil((high - low) / spacing / most)))
    return np.arange(np.ceil(low / spacing), np.floor(high / spacing) + 1) * spacing


def record_of(campaign: Campaign, name: str, result: Result, index: int = 0) -> RunRecord:
    """Put together what one run shows.

    Args:
        campaign: The campaign.
        name: The run's printed id.
        result: A result of ``replay_with_histories`` that holds it.
        index: Its place there.
    """
    scenario = campaign.scenario
    case, sample = campaign.pair(name)
    runs, _ = scenario.runs([(case, sample)])
    model = _own_model(scenario.model(), runs)
    vehicle, track = model.vehicle, model.track
    # Simulated together with longer ones a run has rows of NaN after its end, which are no part of it.
    samples = int(np.isfinite(result.channels["contact_force"][index]).all(axis=1).argmin()) or len(result.time)
    if samples < 2:
        raise ValueError(f"{name} has 1 sample before it diverged; at least 2 are needed to show it")
    time = result.time[:samples]
    channel = {key: history[index][:samples] for key, history in result.channels.items()}
    speed, start = float(runs.speed[0]), float(runs.start[0])
    position = start + speed * time
    rows = np.union1d(np.arange(0, samples, max(1, round(FRAME_INTERVAL / float(time[1])))), [samples - 1])
    layers = {layer: np.ascontiguousarray(channel[layer][rows]) for layer in LAYERS if layer in channel}
    optional: dict[str, Any] = dict(layers)
    if vehicle.wheel_radius is not None:
        optional["wheel_radius"] = vehicle.wheel_radius
    summary = _of_run(result.summary, index)
    return RunRecord(
        name=name,
        campaign=scenario.name,
        title=f"{vehicle.name} at {speed * KMH:.4g} km/h on {track.name}",
        time=time,
        position=position,
        wheel_offsets=vehicle.wheel_offsets,
        static_load=model.static_load,
        contact_force=channel["contact_force"],
        bodies=vehicle.bodies,
        vehicle=channel.get("vehicle"),
        vehicle_acceleration=channel.get("vehicle_acceleration"),
        lift_off=model.rest.constants.approach - model.rest.constants.separation,
        rail_at=_kept_places(campaign) if layers else None,
        track_time=time[rows] if layers else None,
        rail_under_wheel=channel.get("rail_under_wheel"),
        slab_under_wheel=channel.get("slab_under_wheel"),
        irregularity=channel.get("irregularity"),
        line=_line(runs.irregularity[0], position[0] - float(vehicle.wheel_offsets.max()), float(position[-1])),
        bay=track.element_length * track.period if track.kind == "slab" else None,
        separations=_of_run(result.separations, index),
        properties={
            "speed_kmh": speed * KMH,
            "case": case,
            "sample": sample,
            "seed": scenario.seed,
            "status": "ok" if int(result.status[index]) == 0 else "diverged",
            "separations": int(np.sum(summary["separations"].to_numpy())),
            "longest_ms": round(1e3 * float(np.max(summary["longest"].to_numpy())), 3),
            "force_max_kN": round(1e-3 * float(np.max(summary["force_max"].to_numpy())), 1),
            "step_ms": 1e3 * model.step,
        },
        parameters=_parameters(scenario, model, sample),
        **optional,
    )


def _own_model(model: Model, runs: Runs) -> Model:
    """The model with the vehicle and the contact of the only run, where these vary."""
    if runs.vehicle is None and runs.contact is None:
        return model
    vehicle = model.vehicle if runs.vehicle is None else runs.vehicle[0]
    return model.with_vehicle(vehicle, model.contact if runs.contact is None else runs.contact[0])


def _parameters(scenario: Scenario, model: Model, sample: int) -> dict[str, str]:
    """What was simulated: what varies, the run's model in its own words, and the scenario's of the rail and the run."""
    found = {name: f"{value:.6g} [SI], of this run alone" for name, value in scenario.varied(sample).items()}
    told = [line.split("  ", 1) for line in model.describe().splitlines()]
    found |= {name: value.strip() for name, value in (line for line in told if len(line) == 2)}
    resolved = scenario.resolved()
    for table in ("irregularity", "run"):
        for name, value in resolved.get(table, {}).items():
            if value not in (None, [], {}) and f"{table}.{name}" not in found:
                found[f"{table}.{name}"] = str(value)
    return found


def _kept_places(campaign: Campaign) -> Array:
    return histories_to_keep(campaign).rail_at


def _line(irregularity: Any, low: float, high: float) -> tuple[Array, Array] | None:
    """The irregularity wherever the side view looks, while wheels run from low to high [m]; None on a smooth rail."""
    if irregularity is None:
        return None

    def level(first: float, last: float) -> tuple[Array, Array]:
        places = np.linspace(first, last, int(min(MOST_PLACES, np.ceil((last - first) / LINE_SPACING) + 1)))
        return places, np.asarray(irregularity(places), float)

    try:
        return level(low - MARGIN - OVERHANG, high + MARGIN + OVERHANG)
    except ValueError:  # a measured level may reach no further than the wheels
        return level(low, high)


def _of_run(table: pa.Table, index: int) -> pa.Table:
    """Rows of one run of a result's table."""
    return table.filter(pa.array(table["run"].to_numpy() == index))
