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
    from tbatch.engine.result import Result
    from tbatch.engine.runs import SaveAt
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
        # The places of an endless track come and go; the rail under the wheels stays.
        channels = tuple(name for name in channels if name not in (*LAYERS, "rail_acceleration"))
        channels = tuple(dict.fromkeys((*channels, "rail_under_wheel")))
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
    model = scenario.model()
    case, sample = campaign.pair(name)
    runs, _ = scenario.runs([(case, sample)])
    vehicle, track = model.vehicle, model.track
    channel = {key: history[index] for key, history in result.channels.items()}
    speed, start = float(runs.speed[0]), float(runs.start[0])
    position = start + speed * result.time
    rows = slice(None, None, max(1, round(FRAME_INTERVAL / float(result.time[1]))))
    layers = {layer: np.ascontiguousarray(channel[layer][rows]) for layer in LAYERS if layer in channel}
    optional: dict[str, Any] = dict(layers)
    if vehicle.wheel_radius is not None:
        optional["wheel_radius"] = vehicle.wheel_radius
    summary = _of_run(result.summary, index)
    return RunRecord(
        name=name,
        campaign=scenario.name,
        title=f"{vehicle.name} at {speed * KMH:.4g} km/h on {track.name}",
        time=result.time,
        position=position,
        wheel_offsets=vehicle.wheel_offsets,
        static_load=model.static_load,
        contact_force=channel["contact_force"],
        bodies=vehicle.bodies,
        vehicle=channel.get("vehicle"),
        vehicle_acceleration=channel.get("vehicle_acceleration"),
        lift_off=model.rest.constants.approach - model.rest.constants.separation,
        rail_at=_kept_places(campaign) if layers else None,
        track_time=result.time[rows] if layers else None,
        rail_under_wheel=channel.get("rail_under_wheel"),
        irregularity=channel.get("irregularity"),
        line=_line(runs.irregularity[0], position[0] - float(vehicle.wheel_offsets.max()), position[-1]),
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
        parameters=_parameters(scenario),
        **optional,
    )


def _parameters(scenario: Scenario) -> dict[str, str]:
    """What was simulated: the model as it describes itself, and what the scenario says of the rail and the run."""
    told = [line.split("  ", 1) for line in scenario.model().describe().splitlines()]
    found = {name: value.strip() for name, value in (line for line in told if len(line) == 2)}
    resolved = scenario.resolved()
    for table in ("irregularity", "run"):
        for name, value in resolved.get(table, {}).items():
            if value not in (None, [], {}):
                found[f"{table}.{name}"] = str(value)
    return found


def _kept_places(campaign: Campaign) -> Array:
    return histories_to_keep(campaign).rail_at


def _line(irregularity: Any, low: float, high: float) -> tuple[Array, Array] | None:
    if irregularity is None:
        return None
    places = np.linspace(low, high, int(min(MOST_PLACES, np.ceil((high - low) / LINE_SPACING) + 1)))
    return places, np.asarray(irregularity(places), float)


def _of_run(table: pa.Table, index: int) -> pa.Table:
    """Rows of one run of a result's table."""
    return table.filter(pa.array(table["run"].to_numpy() == index))
