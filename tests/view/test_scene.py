from dataclasses import replace

import numpy as np
import pytest

from tbatch.view.deflection import along, under_wheels
from tbatch.view.scene import FRAME_DENSITY, FRAME_TRAVEL, ROOM, build_scene, choose_frames


@pytest.fixture(scope="module")
def scene(record):
    return build_scene(record)


def test_every_separation_has_its_instants_among_the_pictures(record, scene):
    shown = set(record.time[scene.frames].round(9))
    for event in record.events:
        assert {round(event.start, 9), round(event.end, 9)} <= shown


def test_pictures_are_as_far_apart_at_any_speed_and_not_too_many_where_wheels_chatter(record):
    """At 20 km/h a picture every 0.3 m; wheels off every other millisecond take no more than their share."""
    slow = replace(record, time=record.time * 15.0)
    calm = replace(slow, contact_force=np.maximum(record.contact_force, 1.0), separations=None)
    assert np.diff(record.position[choose_frames(calm)][:-1]) == pytest.approx(FRAME_TRAVEL, rel=0.1)
    chatter = np.maximum(record.contact_force, 1.0)
    chatter[::20] = 0.0
    chattering = choose_frames(replace(record, contact_force=chatter, separations=None))
    way = record.position[-1] - record.position[0]
    assert len(chattering) <= FRAME_DENSITY * way
    assert np.diff(record.position[chattering]).max() < FRAME_TRAVEL * 1.1


def test_exaggeration_is_round_and_fills_the_room(record, scene):
    drawn = np.abs(record.irregularity + record.rail_under_wheel).max()
    assert scene.exaggeration in (1, 2, 5, 10, 20, 50, 100, 200, 500)
    assert ROOM / 2.5 < scene.exaggeration * drawn <= ROOM  # the next factor would be at least twice as large


def test_wheels_stand_on_the_drawn_running_surface(record, scene):
    """In contact a wheel's lowest point is at the surface, but for the Hertz approach and the points' spacing."""
    surface, place = scene.surface, record.wheel_position[scene.frames]
    for j in range(record.wheel_count):
        contact = np.flatnonzero(scene.gap[:, j] == 0.0)
        z = np.array([np.interp(place[k, j], surface[k, :, 0], surface[k, :, 2]) for k in contact])
        below = np.abs(scene.wheel_bottom[contact, j, 2] - z)
        # 0.07 mm of approach at rest, a few times that at a peak force, 0.02 m of drawing between two points
        assert below.max() < 0.3e-3 * scene.exaggeration + 0.02
        assert np.median(below) < 0.05e-3 * scene.exaggeration


@pytest.mark.parametrize("at", [60.05, 60.1, 60.13, 60.2])
def test_a_defect_shorter_than_the_spacing_of_points_is_drawn(record, at):
    """A dip of 100 mm at 60 m, with points 200 mm apart elsewhere: its full depth is there."""
    x = np.arange(0.0, 100.0, 0.005)
    dip = np.where(np.abs(x - at) < 0.05, 1e-3 * (1 + np.cos(20 * np.pi * (x - at))), 0.0)
    flat = replace(record, line=(x, dip), rail=None, slab=None, base=None)
    scene = build_scene(flat)
    seen = np.abs(record.position[scene.frames] - at) < 3.0
    depth = -scene.surface[seen][:, :, 2].min(axis=1)
    np.testing.assert_allclose(depth, 2e-3 * scene.exaggeration, atol=0.03)
    assert scene.surface.shape[1] < 300  # without points everywhere


def test_drawn_gap_reaches_the_gap_of_the_event(record, scene):
    time = record.time[scene.frames]
    for event in record.events:
        during = (time >= event.start) & (time < event.end)
        largest = scene.gap[during, event.wheel].max()
        assert 0.8 * event.gap < largest <= event.gap * (1 + 1e-9)  # at least three pictures within
    off = record.contact_force[scene.frames] == 0.0
    np.testing.assert_array_equal(scene.gap != 0.0, off)


def test_front_is_on_the_right_and_pitch_lowers_it(record, scene):
    x = [body.place[0, 0] for body in scene.bodies if body.kind == "wheelset"]
    assert x == sorted(x, reverse=True)
    nose_down = np.array(record.vehicle)
    nose_down[:, 1] = 1e-3
    carbody = next(body for body in build_scene(replace(record, vehicle=nose_down)).bodies if body.kind == "carbody")
    assert np.all(carbody.angle > 0)  # about y, away from the onlooker: x turns towards -z


def test_splines_along_the_track_are_exact_for_cubics():
    at = np.linspace(0.0, 6.0, 11)
    rows = np.array([[1.0, -2.0, 0.5, 0.1], [0.0, 1.0, 0.0, -0.2]])
    values = np.array([np.polyval(row, at) for row in rows])
    x = np.array([[0.1, 3.33], [2.71, 5.9]])
    expected = [np.polyval(row, places) for row, places in zip(rows, x, strict=True)]
    np.testing.assert_allclose(along(at, values, x), expected, rtol=1e-12, atol=1e-12)


def test_rail_under_the_wheels_follows_from_fixed_places_seldom_saved(record):
    """From bends 0.65 m apart and 1 ms apart, within 0.03 mm of 1 mm: enough for a picture."""
    rail = np.exp(-((record.rail_at - record.position[:, None]) ** 2) / 2) * 1e-3
    thin = replace(
        record,
        rail_under_wheel=None,
        slab_under_wheel=None,
        rail_at=record.rail_at[::2],
        track_time=record.time[::10],
        rail=rail[::10, ::2],
        slab=None,
        base=None,
    )
    samples = np.arange(0, 6000, 7)
    under = under_wheels(thin, samples)
    assert under is not None
    np.testing.assert_allclose(under[:, 0], 1e-3, atol=0.03e-3)


def test_what_is_not_known_is_left_out(record):
    bare = replace(record, bodies=(), vehicle=None, vehicle_acceleration=None, lift_off=None, rail=None, rail_at=None,
                   slab=None, base=None, rail_under_wheel=None, slab_under_wheel=None, irregularity=None,
                   line=None)  # fmt: skip
    scene = build_scene(bare)
    assert set(scene.lines) == {"rail"}
    assert scene.bodies == ()
    assert scene.springs is None
    assert np.isnan(scene.gap).any()  # a separated wheel is marked, its gap is not known
