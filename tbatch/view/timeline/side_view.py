"""The side view as columns: static shapes that are moved, and lines redrawn for every picture."""

from __future__ import annotations

import numpy as np
import rerun as rr

from tbatch.view import palette
from tbatch.view.record import RunRecord
from tbatch.view.scene import BASE_DEPTH, OVERHANG, RAIL_DEPTH, ROOF, SLAB_DEPTH, DrawnBody, Scene
from tbatch.view.timeline.clock import Clock

ORIGIN = "side"
LINE_LOOK = {
    "surface": (palette.RAIL, 0.035),
    "rail": (palette.RAIL_FOOT, 0.025),
    "slab": (palette.SLAB, 0.13),
    "base": (palette.BASE, 0.17),
}  # colour, half thickness [m]
WHEEL_WIDTH, BODY_WIDTH = 0.06, 0.04  # across the track, in a picture seen from the side [m]
RIM = 0.05  # half thickness of the drawn rim of a wheel [m]
LABEL_EVERY = 5.0  # between chainage labels [m]


def send(stream: rr.RecordingStream, record: RunRecord, scene: Scene, clock: Clock) -> None:
    """Send the whole side view."""
    times = clock.at(scene.frames)
    for body in scene.bodies:
        _body(stream, scene, body, clock)
    for name, points in {"surface": scene.surface, **scene.lines}.items():
        colour, radius = LINE_LOOK[name]
        # The surface is fixed to the ground that passes by, the smooth lines are given as the vehicle sees them.
        entity = f"{ORIGIN}/{'ground' if name == 'surface' else 'track'}/{name}"
        stream.log(entity, rr.LineStrips3D.from_fields(colors=[colour], radii=[radius]), static=True, strict=True)
        stream.send_columns(entity, times, rr.LineStrips3D.columns(strips=list(points)), strict=True)
    if scene.springs is not None:
        frames, springs = scene.springs.shape[:2]
        entity = f"{ORIGIN}/vehicle/suspension"
        look = rr.LineStrips3D.from_fields(colors=[palette.SPRING], radii=[0.025])
        stream.log(entity, look, static=True, strict=True)
        strips = list(scene.springs.reshape(frames * springs, *scene.springs.shape[2:]))
        columns = rr.LineStrips3D.columns(strips=strips).partition(np.full(frames, springs))
        stream.send_columns(entity, times, columns, strict=True)
    _scale(stream, scene)
    _ground(stream, record, scene, clock)
    _gaps(stream, scene, clock)


def _body(stream: rr.RecordingStream, scene: Scene, body: DrawnBody, clock: Clock) -> None:
    entity = f"{ORIGIN}/vehicle/{body.name.replace(' ', '_')}"
    length, height = body.size
    if body.wheel is not None:
        _wheel(stream, scene, body.wheel, 0.5 * length, entity, clock)
    else:
        colour = palette.CARBODY if body.kind == "carbody" else palette.BOGIE
        half_sizes = [[length / 2, BODY_WIDTH / 2, height / 2]]
        stream.log(entity, rr.Boxes3D(half_sizes=half_sizes, colors=[colour], fill_mode="solid"), static=True)
    if body.kind == "carbody":
        count = max(int(length / 2.0), 1)
        centres = [[2.0 * (k - (count - 1) / 2), -BODY_WIDTH, 0.2 * height] for k in range(count)]
        windows = rr.Boxes3D(
            centers=centres, half_sizes=[[0.65, 0.01, 0.16 * height]], colors=[palette.WINDOW], fill_mode="solid"
        )
        stream.log(f"{entity}/windows", windows, static=True, strict=True)
    if np.any(body.angle):
        turn = np.zeros((len(body.angle), 4), np.float32)
        turn[:, 1], turn[:, 3] = np.sin(body.angle / 2), np.cos(body.angle / 2)
        columns = rr.Transform3D.columns(translation=body.place, quaternion=turn)
    else:
        columns = rr.Transform3D.columns(translation=body.place)
    stream.send_columns(entity, clock.at(scene.frames), columns, strict=True)


def _wheel(stream: rr.RecordingStream, scene: Scene, wheel: int, radius: float, entity: str, clock: Clock) -> None:
    """Draw a wheel as a disc with a rim in the wheel's colour; both turn to the warning colour off the rail."""
    lying = [rr.RotationAxisAngle([1, 0, 0], degrees=90)]
    disc = rr.Cylinders3D.from_fields(
        lengths=[WHEEL_WIDTH], radii=[radius], rotation_axis_angles=lying, fill_mode="solid"
    )
    turn = np.linspace(0.0, 2.0 * np.pi, 49)
    inner = radius - RIM
    circle = np.column_stack((inner * np.cos(turn), np.full(len(turn), -WHEEL_WIDTH), inner * np.sin(turn)))
    stream.log(entity, disc, static=True, strict=True)
    stream.log(f"{entity}/rim", rr.LineStrips3D.from_fields(strips=[circle], radii=[RIM]), static=True, strict=True)
    # The colour changes with time: logged statically beside the shape it would hide its own changes.
    off = scene.gap[:, wheel] != 0.0
    changed = np.flatnonzero(np.diff(off.astype(np.int8), prepend=-1))
    times = clock.at(scene.frames[changed])
    rims = [palette.WARNING if off[k] else palette.wheel_colour(wheel) for k in changed]
    discs = [palette.WARNING if off[k] else palette.DISC for k in changed]
    stream.send_columns(entity, times, rr.Cylinders3D.columns(colors=discs), strict=True)
    stream.send_columns(f"{entity}/rim", times, rr.LineStrips3D.columns(colors=rims), strict=True)


def _scale(stream: rr.RecordingStream, scene: Scene) -> None:
    """Say in the picture itself how much is exaggerated: a layout is shared by many runs."""
    middle = 0.5 * (scene.reach[0] + scene.reach[1])
    text = f"displacements and irregularity × {scene.exaggeration}"
    label = rr.Points3D([[middle, 0.0, ROOF + 0.45]], labels=[text], show_labels=True, radii=0.001, colors=palette.MARK)
    stream.log(f"{ORIGIN}/scale", label, static=True, strict=True)


def _ground(stream: rr.RecordingStream, record: RunRecord, scene: Scene, clock: Clock) -> None:
    """Send what stays in place, fasteners and chainage, and let it pass by."""
    n = record.samples
    position = np.asarray(record.position[:n])
    first, last = position[0] + scene.reach[0] - OVERHANG, position[n - 1] + scene.reach[1] + OVERHANG
    if record.rail_at is not None:
        first, last = max(first, float(record.rail_at[0])), min(last, float(record.rail_at[-1]))
    ground = f"{ORIGIN}/ground"
    if record.bay:
        seats = np.arange(np.ceil(first / record.bay), np.floor(last / record.bay) + 1) * record.bay
        top, bottom = -RAIL_DEPTH - 0.04, -SLAB_DEPTH + 0.12
        marks = [[[x, 0.1, top], [x, 0.1, bottom]] for x in seats]
        stream.log(f"{ground}/fasteners", rr.LineStrips3D(marks, radii=0.05, colors=palette.MARK), static=True)
    places = np.arange(np.ceil(first / LABEL_EVERY), np.floor(last / LABEL_EVERY) + 1) * LABEL_EVERY
    depth = -BASE_DEPTH - 0.4
    labels = rr.Points3D(
        [[x, 0.0, depth] for x in places],
        labels=[f"{x:.0f} m" for x in places],
        show_labels=True,
        radii=0.05,
        colors=palette.MARK,
    )
    stream.log(f"{ground}/chainage", labels, static=True, strict=True)
    shift = np.zeros((len(scene.frames), 3), np.float32)
    shift[:, 0] = -position[scene.frames]
    stream.send_columns(ground, clock.at(scene.frames), rr.Transform3D.columns(translation=shift), strict=True)


def _gaps(stream: rr.RecordingStream, scene: Scene, clock: Clock) -> None:
    """Send the gap under every separated wheel, as a label while it is open."""
    off = scene.gap != 0.0
    any_off = off.any(axis=1)
    shown = np.flatnonzero(any_off | np.concatenate(([False], any_off[:-1])))
    if not len(shown):
        return
    places, labels, pointers = [], [], []
    for k in shown:
        for j in np.flatnonzero(off[k]):
            x, _, bottom = scene.wheel_bottom[k, j]
            foot = [x, -0.05, -BASE_DEPTH - 1.2]
            places.append(foot)
            pointers.append([foot, [x, -0.05, bottom]])
            gap = scene.gap[k, j]
            labels.append("off the rail" if np.isnan(gap) else f"gap {1e3 * gap:.2f} mm")
    counts = off[shown].sum(axis=1)
    times = clock.at(scene.frames[shown])
    look = rr.Points3D.from_fields(colors=[palette.WARNING], radii=[0.05], show_labels=True)
    stream.log(f"{ORIGIN}/gap", look, static=True, strict=True)
    columns = rr.Points3D.columns(positions=places, labels=labels).partition(counts)
    stream.send_columns(f"{ORIGIN}/gap", times, columns, strict=True)
    line = rr.LineStrips3D.from_fields(colors=[palette.WARNING], radii=[0.03])
    stream.log(f"{ORIGIN}/gap/pointer", line, static=True, strict=True)
    columns = rr.LineStrips3D.columns(strips=pointers).partition(counts)
    stream.send_columns(f"{ORIGIN}/gap/pointer", times, columns, strict=True)
