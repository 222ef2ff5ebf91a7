"""Geometry of the side view: what is drawn where, in plain NumPy.

The picture moves with the vehicle: x is measured from wheel 1 in the running direction, z upwards from the top of
the undeflected rail, both in metres, and y points away from the onlooker. All displacements, the irregularity among
them, are drawn `exaggeration` times too large; lengths and heights are true.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbatch.view.deflection import deflection, under_wheels
from tbatch.view.record import Array, Body, RunRecord, Separation
from tbatch.view.thinning import Samples, spaced_samples

Float32 = NDArray[np.float32]

FRAME_TRAVEL = 0.3  # least way between two pictures [m]
FRAME_INTERVAL = 1e-3  # least time between two pictures [s]
FRAME_DENSITY, FEW_FRAMES = 8.0, 200  # most pictures to a metre [1/m], and in a short run
MARGIN = 5.0  # track in view before the first wheel and behind the last [m]
OVERHANG = 9.0  # track drawn beyond that, for windows wider than usual [m]
HEAD_SPACING, RAIL_SPACING, SLAB_SPACING = 0.2, 0.4, 1.0  # between drawn points [m]
HEAD_PARTS, HEAD_TOLERANCE = 8, 0.02  # a spacing of the surface is divided where it bends more [m]
GRAIN = 1.0 / 256.0  # drawn coordinates are whole multiples of it: a seventh of a pixel, and packs well [m]
ROOM = 0.6  # largest drawn displacement of rail and wheels [m]
RAIL_DEPTH = 0.18  # of the line that shows the rail's deflection alone, below the running surface [m]
SLAB_DEPTH, BASE_DEPTH = 0.50, 0.85  # of their centre lines below the running surface [m]
BOGIE_HEIGHT, BOGIE_DEPTH = 1.1, 0.22  # of a bogie frame's centre, and its depth [m]
FLOOR, ROOF = 1.75, 4.1  # of a carbody [m]
SPRING = np.array([[0, 0], [0, 0.2], [1, 0.29], [-1, 0.43], [1, 0.57], [-1, 0.71], [0, 0.8], [0, 1]])
# a spring's shape: half widths sideways and share of the height, shape (point, 2)


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """One body of the vehicle and where it is in each picture."""

    name: str
    kind: str
    wheel: int | None  # axis index of a wheelset's wheel
    size: tuple[float, float]  # length along the line and height [m]
    place: Float32
    # centre (x, y, z) [m], shape (frame, 3)
    angle: Array
    # rotation about y, nose-down positive, exaggerated [rad], shape (frame,)


@dataclass(frozen=True, eq=False)
class Scene:
    """The side view of one run."""

    exaggeration: int
    frames: Samples
    # sample of each picture, shape (frame,)
    bodies: tuple[DrawnBody, ...]
    springs: Float32 | None
    # suspensions as zigzag lines [m], shape (frame, spring, point, 3)
    surface: Float32
    # running surface, x from the track's start as it is fixed to it [m], shape (frame, point, 3)
    lines: dict[str, Float32]
    # "rail", and "slab" and "base" where known [m], shape (frame, point, 3)
    wheel_bottom: Float32
    # lowest point of each wheel (x, y, z) [m], shape (frame, wheel, 3)
    gap: Array
    # gap under each wheel, not exaggerated [m], zero in contact, NaN where not known, shape (frame, wheel)
    reach: tuple[float, float]
    # first and last x in view [m]; the track is drawn OVERHANG further


def build_scene(record: RunRecord) -> Scene:
    """Place everything for every picture of a run."""
    frames = choose_frames(record)
    factor = choose_exaggeration(record, frames)
    reach = reach_of(record)
    lines = track_lines(record, frames, factor, reach)
    surface = running_surface(record, frames, factor, reach)
    bodies = drawn_bodies(record, frames, factor)
    wheels = [body for body in bodies if body.kind == "wheelset"]
    bottom = np.zeros((len(frames), record.wheel_count, 3))
    bottom[:, :, 0] = -np.asarray(record.wheel_offsets)
    if len(wheels) == record.wheel_count:
        bottom[:, :, 2] = np.stack([wheel.place[:, 2] for wheel in wheels], axis=1) - record.wheel_radius
    return Scene(
        exaggeration=factor,
        frames=frames,
        bodies=tuple(bodies),
        springs=suspension(record, bodies),
        surface=surface,
        lines=lines,
        wheel_bottom=_rounded(bottom),
        gap=gaps(record, frames),
        reach=reach,
    )


def reach_of(record: RunRecord) -> tuple[float, float]:
    """First and last x in view [m]."""
    return -float(np.max(record.wheel_offsets)) - MARGIN, MARGIN


def choose_frames(record: RunRecord) -> Samples:
    """Pick the samples that become pictures: a few hundred per 100 m, more while a wheel is off the rail.

    The start and the end of a separation are pictures, and what is between as finely as the number of pictures
    allows; where it does not allow the ends of all, those of the longest.
    """
    n = record.samples
    time, position = np.asarray(record.time[:n]), np.asarray(record.position[:n])
    regular = spaced_samples(time, position, interval=FRAME_INTERVAL, travel=FRAME_TRAVEL)
    most = max(int(FRAME_DENSITY * float(position[-1] - position[0])), FEW_FRAMES)
    for pieces in (4, 2, 1):  # of each separation at least
        for interval in FRAME_INTERVAL * 2.0 ** np.arange(4):
            frames = np.union1d(regular, _separated_frames(time, record.events, interval, pieces))
            if len(frames) <= most:
                return frames
    longest = sorted(record.events, key=lambda event: event.start - event.end)[: max(most - len(regular), 0) // 2]
    return np.union1d(regular, _separated_frames(time, longest, np.inf, 1))


def _separated_frames(time: Array, events: Sequence[Separation], interval: float, pieces: int) -> Samples:
    """Pick samples from the start to the end of every separation, on marks that all wheels share.

    Args:
        time: Time [s], shape (n,).
        events: The separations.
        interval: Time between the marks [s].
        pieces: Into how many a separation is divided beside that.
    """
    instants = [np.linspace(event.start, event.end, pieces + 1) for event in events]
    for event in events:
        first, last = np.ceil(event.start / interval), np.floor(event.end / interval)
        if np.isfinite(interval):
            instants.append(interval * np.arange(first, last + 1))
    found = np.searchsorted(time, np.concatenate([*instants, np.zeros(0)]) - 1e-12)
    return np.unique(np.clip(found, 0, len(time) - 1)).astype(np.intp)


def choose_exaggeration(record: RunRecord, frames: Samples) -> int:
    """Pick the largest round factor (1, 2, 5, 10, ... 500) that keeps rail and wheels within ROOM."""
    drawn = [np.zeros(1)]
    under = under_wheels(record, frames)
    if under is not None:
        drawn.append(under)
    if record.irregularity is not None:
        level = np.asarray(record.irregularity)[frames]
        drawn += [level, level if under is None else level + under]
    if record.vehicle is not None:
        wheels = [body.vertical_dof for body in record.bodies if body.kind == "wheelset"]
        drawn.append(np.asarray(record.vehicle)[frames][:, wheels])
    largest = max(float(np.nanmax(np.abs(part), initial=0.0)) for part in drawn)
    return max((factor for factor in (1, 2, 5, 10, 20, 50, 100, 200, 500) if factor * largest <= ROOM), default=1)


def running_surface(record: RunRecord, frames: Samples, factor: int, reach: tuple[float, float]) -> Float32:
    """Draw the rail's deflection and irregularity, with points closer together where a short defect needs them."""
    position = np.asarray(record.position)[frames]
    low, high = reach[0] - OVERHANG, reach[1] + OVERHANG
    start = np.floor((position[0] + low) / HEAD_SPACING)  # on the track's own grid: no flicker
    count = int(np.ceil((position[-1] + high) / HEAD_SPACING) - start)
    fine = HEAD_SPACING * (start + np.arange(count * HEAD_PARTS + 1) / HEAD_PARTS)
    level = factor * _level(record, fine)
    bent = np.abs(level - np.interp(fine, fine[::HEAD_PARTS], level[::HEAD_PARTS])) > HEAD_TOLERANCE
    kept = np.repeat(bent[:-1].reshape(count, HEAD_PARTS).any(axis=1), HEAD_PARTS)
    kept[::HEAD_PARTS] = True
    places = fine[np.append(kept, True)]
    first, last = np.searchsorted(places, position + low), np.searchsorted(places, position + high)
    column = np.arange(np.max(last - first))
    x = places[np.minimum(first[:, None] + column, last[:, None])]  # shorter ones repeat their last point
    sunk = deflection(record, record.rail, frames, x) + _level(record, x)
    return _rounded(np.stack((x, np.zeros_like(x), -factor * sunk), axis=2))


def track_lines(record: RunRecord, frames: Samples, factor: int, reach: tuple[float, float]) -> dict[str, Float32]:
    """Draw the deflected rail, slab and base plate."""
    lines: dict[str, Float32] = {}
    position = np.asarray(record.position)[frames, None]
    for name, values, depth, spacing in (
        ("rail", record.rail, RAIL_DEPTH, RAIL_SPACING),
        ("slab", record.slab, SLAB_DEPTH, SLAB_SPACING),
        ("base", record.base, BASE_DEPTH, SLAB_SPACING),
    ):
        if values is None and name != "rail":
            continue
        seen = np.arange(reach[0] - OVERHANG, reach[1] + OVERHANG + spacing / 2, spacing)
        x = position + seen
        height = -depth - factor * deflection(record, values, frames, x)
        lines[name] = _rounded(np.stack((np.broadcast_to(seen, x.shape), np.zeros_like(x), height), axis=2))
    return lines


def _level(record: RunRecord, x: Array) -> Array:
    if record.line is None:
        return np.zeros_like(x)
    return np.interp(x, np.asarray(record.line[0]), np.asarray(record.line[1]))


def drawn_bodies(record: RunRecord, frames: Samples, factor: int) -> list[DrawnBody]:
    """Place the bodies; their heights at rest are those of a usual vehicle."""
    if record.vehicle is None:
        return []
    vehicle = np.asarray(record.vehicle)[frames]
    height = {"carbody": (FLOOR + ROOF) / 2, "bogie": BOGIE_HEIGHT, "wheelset": record.wheel_radius}
    depth = {"carbody": ROOF - FLOOR, "bogie": BOGIE_DEPTH, "wheelset": 2 * record.wheel_radius}
    behind = {"carbody": 0.3, "bogie": 0.2, "wheelset": 0.0}  # later ones stand in front
    names = {id(body): name for body, name in zip(record.bodies, body_names(record.bodies), strict=True)}
    drawn = []
    for body in record.bodies:
        place = np.zeros((len(frames), 3))
        place[:, 0] = -body.offset
        place[:, 1] = behind[body.kind]
        place[:, 2] = height[body.kind] - factor * vehicle[:, body.vertical_dof]
        angle = np.zeros(len(frames)) if body.pitch_dof is None else factor * vehicle[:, body.pitch_dof]
        size = (2 * record.wheel_radius if body.kind == "wheelset" else body.length, depth[body.kind])
        wheel = int(names[id(body)].split()[-1]) - 1 if body.kind == "wheelset" else None
        drawn.append(DrawnBody(names[id(body)], body.kind, wheel, size, _rounded(place), np.arctan(angle)))
    return drawn


def body_names(bodies: Sequence[Body]) -> list[str]:
    """Name bodies by kind and number from the front: "carbody", "bogie 1", "wheel 2"."""
    names = []
    for k, body in enumerate(bodies):
        same = [i for i, other in enumerate(bodies) if other.kind == body.kind]
        word = "wheel" if body.kind == "wheelset" else body.kind
        alone = len(same) == 1 and body.kind != "wheelset"
        names.append(word if alone else f"{word} {same.index(k) + 1}")
    return names


def suspension(record: RunRecord, bodies: Sequence[DrawnBody]) -> Float32 | None:
    """Draw a zigzag between every wheelset and its bogie, and every bogie and its carbody."""
    ends: list[tuple[Array, Array]] = []
    lower_of = {"carbody": "bogie", "bogie": "wheelset"}
    for above_kind, below_kind in lower_of.items():
        above = [body for body in bodies if body.kind == above_kind]
        for below in (body for body in bodies if body.kind == below_kind):
            if not above:
                continue
            x = float(below.place[0, 0])
            owner = min(above, key=lambda body: abs(float(body.place[0, 0]) - x))
            arm = x - owner.place[:, 0]
            top = owner.place.astype(float)
            top[:, 0] = x
            top[:, 2] -= arm * np.tan(owner.angle) + owner.size[1] / 2
            foot = below.place.astype(float)
            if below_kind == "bogie":
                foot[:, 2] += below.size[1] / 2
            # A bogie frame hides the upper end of its wheels: primary springs are drawn in front of both.
            top[:, 1] = foot[:, 1] = 0.1 if below_kind == "bogie" else -0.15
            ends.append((foot, top))
    if not ends:
        return None
    springs = np.zeros((len(ends[0][0]), len(ends), len(SPRING), 3))
    for k, (foot, top) in enumerate(ends):
        springs[:, k] = foot[:, None] + SPRING[:, 1:2] * (top - foot)[:, None]
        springs[:, k, :, 0] += 0.14 * SPRING[:, 0]
    return _rounded(springs)


def gaps(record: RunRecord, frames: Samples) -> Array:
    """Gap under each wheel at the pictures [m], shape (frame, wheel): surface minus wheel, beyond the lift-off."""
    separated = np.asarray(record.contact_force)[frames] == 0.0
    wheels = [body.vertical_dof for body in record.bodies if body.kind == "wheelset"]
    under = under_wheels(record, frames)
    if (
        under is None
        or record.vehicle is None
        or record.irregularity is None
        or record.lift_off is None
        or len(wheels) != record.wheel_count
    ):
        return np.where(separated, np.nan, 0.0)
    level = np.asarray(record.irregularity)[frames]
    open_by = under + level - np.asarray(record.vehicle)[frames][:, wheels] - record.lift_off
    # A force of zero with no gap to see is still a separation.
    return np.where(separated, np.maximum(open_by, 1e-9), 0.0)


def _rounded(points: Array) -> Float32:
    return (np.round(points / GRAIN) * GRAIN).astype(np.float32)
