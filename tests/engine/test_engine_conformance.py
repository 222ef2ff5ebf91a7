"""The batch kernels give, bit for bit, what the one-run NumPy reference gives."""

import numpy as np
import pytest
from engine_cases import LAWS, TRACKS, OneRun, corrugation, model, reference, wheel

from tbatch.engine.model import Model
from tbatch.engine.result import Result
from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs, SaveAt, State
from tbatch.engine.simulate import simulate
from tbatch.numerics.rows import hermite_at
from tbatch.numerics.two_step import EQUAL_SPLITTING
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.vehicle import Vehicle

STEPS = 60
CHANNELS = ("contact_force", "vehicle", "vehicle_acceleration", "irregularity")

PARTS = [
    ("wheel", "rigid", EQUAL_SPLITTING),
    ("column", "rigid", 0.5),
    ("wheel", "beam", 0.5),
    ("wheel", "beam", 0.4),
    ("column", "winkler", EQUAL_SPLITTING),
    ("bar", "winkler", EQUAL_SPLITTING),
    ("coach", "slab", EQUAL_SPLITTING),
    # The largest kernel once more, for two rates: it takes half a minute to compile.
    pytest.param("coach", "slab", 0.5, marks=pytest.mark.slow),
    ("train", "long winkler", EQUAL_SPLITTING),
]


def points(of: Model) -> np.ndarray:
    """Where the track is saved [m]: a node, within elements, both ends."""
    length, a = of.track.length, of.track.element_length
    return np.array([0.0, 3.0 * a, 0.3712 * length, 0.61 * length, length])


def saved(of: Model) -> SaveAt:
    """Every step of everything that the track has."""
    under = [f"{layer}_under_wheel" for layer in of.track.layers or ("rail",)]
    return SaveAt(of.step, (*CHANNELS, *under, *of.track.layers), points(of))


def assert_same(result: Result, run: int, one: OneRun, of: Model) -> None:
    """All channels of one run equal the reference's, to the last bit."""
    steps = one.steps
    assert result.steps[run] == steps
    assert result.status[run] == one.diverged
    np.testing.assert_array_equal(result.contact_force[run, : steps + 1], one.force)
    np.testing.assert_array_equal(result.vehicle[run, : steps + 1], one.vehicle)
    np.testing.assert_array_equal(result.vehicle_acceleration[run, 1 : steps + 1], one.vehicle_acceleration[1:])
    np.testing.assert_array_equal(result.irregularity[run, : steps + 1], one.level)
    a, count = of.track.element_length, of.track.element_count
    for layer, (first, _) in of.track.layers.items():
        element, _, shape = hermite_at(points(of), a, count)
        left, right = one.track[:, element, first : first + 2], one.track[:, element + 1, first : first + 2]
        value = (shape[:, 0] * left[..., 0] + shape[:, 1] * left[..., 1]) + (
            shape[:, 2] * right[..., 0] + shape[:, 3] * right[..., 1]
        )
        np.testing.assert_array_equal(result.channels[layer][run, : steps + 1], value)
    for wheel_number in range(one.force.shape[1]):
        element, _, shape = hermite_at(one.position[:, wheel_number], a, count)
        n, at = shape.T, np.arange(steps + 1)
        for layer, (first, _) in of.track.layers.items():
            left, right = one.track[at, element, first : first + 2].T, one.track[at, element + 1, first : first + 2].T
            under = (n[0] * left[0] + n[1] * left[1]) + (n[2] * right[0] + n[3] * right[1])
            found = result.channels[f"{layer}_under_wheel"][run, : steps + 1, wheel_number]
            np.testing.assert_array_equal(found[1:], under[1:])
            assert found[0] == pytest.approx(under[0], rel=1e-12, abs=1e-18)
        if not of.track.layers:
            assert not result.rail_under_wheel[run, : steps + 1].any()
    # The gaps in the log are the reference's overlaps.
    for event in result.separations.to_pylist():
        if event["run"] != run:
            continue
        wheel_number = event["wheel"] - 1
        opened, closed = (round(event[key] / of.step) for key in ("start", "end"))
        apart = one.overlap[opened : closed + 1, wheel_number][one.force[opened : closed + 1, wheel_number] == 0.0]
        assert event["gap"] == max((of.rest.constants.separation[wheel_number] - apart).max(), 0.0)


def rough_runs(of: Model) -> Runs:
    """Runs rough enough that wheels leave the rail: a block of different courses, one of one course, and two more.

    Where all lanes of a block keep one course, the kernels serve them all at once.
    """
    count = 2 * LANES + 2
    place = np.where(np.arange(count) // LANES == 1, LANES, np.arange(count))
    start = float(of.vehicle.wheel_offsets.max()) + 2.0 + 0.037 * place
    rough = [corrugation(0.6e-3, 0.7 * run) for run in range(count)]
    for run in (1, LANES + 1):
        rough[run] = rough[run].taper(float(start[run]) - 0.5, 1.0) + Irregularity.flat(
            0.4e-3, 0.06, float(start[run]) + 0.05
        )
    first = float(start[-1])
    rough[-1] = Irregularity.flat(0.4e-3, 0.06, first + 0.02) + Irregularity.flat(0.5e-3, 0.05, first + 0.11)
    return Runs(speed=38.0 + 0.7 * place, irregularity=rough, start=start)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("vehicle", "track", "splitting"), PARTS)
def test_kernels_equal_the_reference_bit_for_bit(vehicle, track, splitting, law):
    of = model(vehicle, track, law, splitting)
    runs, duration = rough_runs(of), STEPS * of.step
    result = simulate(of, runs, duration, save=saved(of), threads=1)
    forces = []
    for run in (1, LANES + 1, 2 * LANES + 1):
        one = reference(of, runs, duration, run)
        assert one.steps == STEPS
        assert_same(result, run, one, of)
        forces.append(one.force)
    # The case is worth its time only if wheels leave the rail and land.
    assert (np.stack(forces) == 0.0).any()
    assert (np.diff(np.stack(forces) > 0.0, axis=1) > 0).any()


def test_two_wheels_on_one_element_push_on_each_other():
    # The same bar with its wheels heard by two different elements, or by one: the reference has both, the kernels too.
    of = model("bar", "winkler")
    runs = Runs(speed=[40.0, 40.0], irregularity=[corrugation(0.2e-3)] * 2, start=[6.62, 7.02])
    result = simulate(of, runs, STEPS * of.step, save=saved(of), threads=1)
    same = []
    for run in range(2):
        one = reference(of, runs, STEPS * of.step, run)
        assert_same(result, run, one, of)
        same.append((np.floor(one.position[:, 0]) == np.floor(one.position[:, 1])).mean())
    assert same[0] > 0.9
    assert same[1] < 0.6


def test_runs_of_one_block_may_differ_in_vehicle_and_law():
    of = model("column", "winkler")
    columns = [Vehicle.column("koh-column", wheel_mass=300.0 + 20.0 * run) for run in range(9)]
    contacts = [*LAWS.values()] * 3
    runs = Runs(speed=[50.0] * 9, irregularity=[corrugation(0.6e-3)] * 9, start=5.0, vehicle=columns, contact=contacts)
    result = simulate(of, runs, STEPS * of.step, save=saved(of), threads=1)
    for run in range(9):
        one = reference(of, runs, STEPS * of.step, run)
        np.testing.assert_array_equal(result.contact_force[run], one.force)
        np.testing.assert_array_equal(result.vehicle[run], one.vehicle)
        assert (one.force == 0.0).any()


def test_wheel_profiles_turn_with_their_own_wheel():
    # A wheel this small turns three times in the run: the profile wraps.
    radius, of = 0.02, model("bar", "winkler")
    turn = 2.0 * np.pi * radius
    oval = Irregularity.cosines(2.0 / turn, 0.1e-3)
    flat = Irregularity.flat(0.05e-3, 0.02, 0.04)
    runs = Runs(
        speed=[60.0, 60.0, 60.0, 60.0],
        irregularity=[None, corrugation(0.1e-3), None, None],
        start=6.0,
        contact=[Contact.hertz(wheel_radius=radius)] * 4,
        wheel_profile=[(oval, None), oval, (None, oval + flat), None],
    )
    result = simulate(of, runs, STEPS * of.step, save=saved(of), threads=1)
    ones = [reference(of, runs, STEPS * of.step, run) for run in range(4)]
    for run, one in enumerate(ones):
        assert_same(result, run, one, of)
    rolled = 60.0 * np.arange(STEPS + 1) * of.step
    assert rolled[-1] > 2.8 * turn
    # The spline is within 1e-9 m of a cosine.
    np.testing.assert_allclose(ones[0].level[:, 0], oval(rolled), atol=2e-9)
    assert (ones[0].level[:, 1] == 0.0).all()
    np.testing.assert_allclose(ones[2].level[:, 1], oval(rolled) + flat(rolled % turn), atol=2e-9)
    assert (ones[3].level == 0.0).all()


@pytest.mark.parametrize("law", LAWS)
def test_every_way_to_start_is_the_reference_s(law):
    of = model("column", "winkler", law)
    runs = Runs(speed=[45.0, 55.0], irregularity=[corrugation(0.5e-3)] * 2, start=[6.0, 7.3])
    random = np.random.default_rng(3)
    nodes = (2, of.track.node_count, of.track.node_dofs)
    track = np.where(of.track.pinned, 0.0, 1e-4 * random.standard_normal(nodes))
    given = State(
        vehicle=1e-4 * random.standard_normal((2, 3)),
        vehicle_velocity=1e-2 * random.standard_normal(3),
        track=track,
        track_velocity=100.0 * track[0],
    )
    for initial in ("static", "rest", given):
        result = simulate(of, runs, 30 * of.step, initial=initial, save=saved(of), threads=1)
        for run in range(2):
            assert_same(result, run, reference(of, runs, 30 * of.step, run, initial), of)
        if initial == "rest":
            np.testing.assert_array_equal(result.contact_force[:, 0], np.tile(of.static_load, (2, 1)))


def test_a_wheel_that_starts_in_the_air_falls_as_the_reference_s():
    of = model("wheel", "rigid")
    runs = Runs(speed=[20.0], start=[5.0])
    lifted = State(vehicle=np.array([-2e-4]))
    result = simulate(of, runs, 80 * of.step, initial=lifted, save=saved(of), threads=1)
    one = reference(of, runs, 80 * of.step, 0, lifted)
    assert_same(result, 0, one, of)
    assert one.force[0, 0] == 0.0
    assert one.force[-1, 0] > 0.0
    # Free fall under g' = P0/m, to the round-off of a position of 1e-4 m; the trapezoidal rule is exact for it.
    landing = int(np.argmax(one.force[:, 0] > 0.0))
    t = np.arange(landing) * of.step
    vehicle = wheel()
    fall = 0.5 * vehicle.weight[0] / vehicle.mass[0, 0] * t**2
    assert landing > 10
    np.testing.assert_allclose(one.vehicle[:landing, 0], -2e-4 + fall, rtol=0.0, atol=1e-14)


def test_a_run_may_end_exactly_at_the_end_of_the_track():
    of = model("column", "winkler")
    length = TRACKS["winkler"]().length
    runs = Runs(speed=[40.0], irregularity=[corrugation(0.2e-3)], start=[length - 40.0 * STEPS * of.step])
    result = simulate(of, runs, STEPS * of.step, save=saved(of), threads=1)
    assert_same(result, 0, reference(of, runs, STEPS * of.step, 0), of)
