"""The charts of one run beside its plots over time: spectra, and deflections along the track."""

from __future__ import annotations

import numpy as np
import rerun as rr

from tbatch.view import palette
from tbatch.view.deflection import deflection, under_wheels
from tbatch.view.record import Array, RunRecord
from tbatch.view.scene import MARGIN, Scene
from tbatch.view.spectrum import spectrum
from tbatch.view.timeline.canvas import Axis, Canvas
from tbatch.view.timeline.clock import Clock

WIDE, SMALL, HIGH = 400.0, 190.0, 100.0  # drawn sizes of the charts [drawn units]
PLACES = {"rail": 97, "slab": 49, "base": 33}  # drawn along the track: the deeper, the smoother
GRAINS = 8.0  # to a drawn unit: less than half a pixel, and packs well
EVERY = 2  # pictures of the side view to one of the track alone
DECADES = 8.0  # most powers of ten of a density that are shown
WAVES = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03)  # marked wavelengths [m]
LAYERS = {"rail": palette.RAIL, "slab": palette.SLAB_LINE, "base": palette.BASE_LINE}


def send_charts(stream: rr.RecordingStream, record: RunRecord, scene: Scene, clock: Clock) -> dict[str, Canvas]:
    """Send all charts that the run has something for.

    Returns:
        The charts by name: "force_spectrum", "irregularity_spectrum", "track".
    """
    charts: dict[str, Canvas] = {}
    n = record.samples
    series: dict[str, tuple[Array, str]] = {"force": (1e-3 * np.asarray(record.contact_force)[:n], "kN²/Hz")}
    if record.irregularity is not None:
        series["irregularity"] = (1e3 * np.asarray(record.irregularity)[:n], "mm²/Hz")
    for name, (values, unit) in series.items():
        chart = _spectrum(stream, record, f"spectrum/{name}", values, unit)
        if chart is not None:
            charts[f"{name}_spectrum"] = chart
    chart = _track(stream, record, scene, clock)
    return charts if chart is None else charts | {"track": chart}


def _spectrum(stream: rr.RecordingStream, record: RunRecord, entity: str, values: Array, unit: str) -> Canvas | None:
    """A curve for each wheel over the frequency, with the wavelengths at the run's speed above."""
    frequency, density = spectrum(values, float(record.time[1] - record.time[0]))
    largest = float(density.max())
    if len(frequency) < 2 or not largest > 0.0:
        return None
    top = 10.0 ** np.ceil(np.log10(largest))
    bottom = max(10.0 ** np.floor(np.log10(max(float(density.min()), 1e-300))), top / 10.0**DECADES)
    low, high = float(frequency[0]), float(frequency[-1])
    chart = Canvas(entity, Axis(low, high, SMALL, "Hz", log=True), Axis(bottom, top, HIGH, unit, log=True))
    waves = [(record.speed / wave, f"{wave:g} m") for wave in WAVES if low <= record.speed / wave <= high]
    chart.send_axes(stream, above=waves)
    colours = [palette.wheel_colour(j) for j in range(record.wheel_count)]
    chart.send_curves(stream, "wheels", frequency, density, colours)
    return chart


def _track(stream: rr.RecordingStream, record: RunRecord, scene: Scene, clock: Clock) -> Canvas | None:
    """Deflection of each layer along the track as the vehicle sees it, and each wheel's place on the rail."""
    known = {name: getattr(record, name) for name in LAYERS if getattr(record, name) is not None}
    if not known or record.rail_at is None:
        return None
    first, last = scene.reach[0] - MARGIN, scene.reach[1] + MARGIN
    seen = {name: np.linspace(first, last, PLACES[name]) for name in known}
    frames = scene.frames[::EVERY]
    position = np.asarray(record.position)[frames, None]
    sunk = {name: 1e3 * deflection(record, values, frames, position + seen[name]) for name, values in known.items()}
    under = under_wheels(record, frames)
    drawn = [*sunk.values(), *([] if under is None else [1e3 * under])]
    low, high = min(float(part.min()) for part in drawn), max(float(part.max()) for part in drawn)
    room = 0.05 * (high - low) or 0.1
    across = Axis(first, last, WIDE, "m")
    chart = Canvas("along_track", across, Axis(low - room, high + room, HIGH, "mm", downward=True))
    chart.send_axes(stream)
    chart.send_legend(stream, list(sunk), [LAYERS[name] for name in sunk])
    times = clock.at(frames)
    for name, values in sunk.items():
        entity = f"{chart.entity}/{name}"
        look = rr.LineStrips2D.from_fields(colors=[LAYERS[name]], radii=[-1.4])
        stream.log(entity, look, static=True, strict=True)
        strips = list(np.round(GRAINS * chart.points(seen[name], values)) / GRAINS)
        stream.send_columns(entity, times, rr.LineStrips2D.columns(strips=strips), strict=True)
    if under is not None:
        entity = f"{chart.entity}/wheels"
        colours = [palette.wheel_colour(j) for j in range(record.wheel_count)]
        stream.log(entity, rr.Points2D.from_fields(colors=colours, radii=[-4.0]), static=True, strict=True)
        places = chart.points(-np.asarray(record.wheel_offsets), 1e3 * under).reshape(-1, 2)
        columns = rr.Points2D.columns(positions=places).partition(np.full(len(frames), record.wheel_count))
        stream.send_columns(entity, times, columns, strict=True)
    return chart
