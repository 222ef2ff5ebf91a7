"""Vehicles against published frequencies, and the rigid lift against its definition."""

import dataclasses

import numpy as np
import pytest

from tbatch.physics.catalogue.vehicles import COACHES
from tbatch.physics.vehicle import Vehicle

PLAIN = {
    "carbody_mass": 40000.0,
    "carbody_inertia": 1.5e6,
    "bogie_mass": 3000.0,
    "bogie_inertia": 8000.0,
    "wheelset_mass": 2000.0,
    "primary": (1.6e6, 40e3),
    "secondary": (0.4e6, 60e3),
    "bogie_half_distance": 8.75,
    "axle_half_distance": 1.25,
}


@pytest.mark.parametrize(
    ("name", "frequencies"),
    [
        ("seed-multiwheel", [0.6704, 0.9570, 3.9789, 3.9789, 5.5185, 5.5240]),
        ("zhai-high-speed", [0.9289, 1.0202, 5.0655, 5.0726, 5.4416, 5.4416]),
        ("ice3-velaro", [0.8037, 1.0898, 6.3167, 6.3233, 10.5249, 10.5249]),
    ],
)
def test_rigid_rail_frequencies_are_the_published_ones(name, frequencies):
    np.testing.assert_allclose(Vehicle.coach(name).natural_frequencies(), frequencies, atol=5.1e-5)


def test_frequencies_of_a_coach_are_those_of_its_symmetric_halves():
    # Bounce: carbody on two bogies in step; bogie pitch: 2 k lt² / J. Closed forms.
    vehicle = Vehicle.coach(**PLAIN)
    f = vehicle.natural_frequencies()
    pitch = np.sqrt(2 * 1.6e6 * 1.25**2 / 8000.0) / (2 * np.pi)
    m, k = np.diag([40000.0, 6000.0]), np.array([[0.8e6, -0.8e6], [-0.8e6, 0.8e6 + 6.4e6]])
    bounce = np.sqrt(np.linalg.eigvals(np.linalg.solve(m, k))) / (2 * np.pi)
    for expected in (pitch, pitch, *bounce):
        assert np.abs(f - expected).min() < 1e-9 * expected


def test_rigid_lift_is_one_at_wheels_and_bodies_and_zero_at_pitches():
    for name in COACHES:
        vehicle = Vehicle.coach(name)
        np.testing.assert_allclose(vehicle.rigid_lift(), [1, 0, 1, 0, 1, 0, 1, 1, 1, 1], atol=1e-9)
        assert vehicle.weight[[1, 3, 5]] == pytest.approx(0.0, abs=1e-9)


def test_weight_is_that_of_the_masses():
    vehicle = Vehicle.coach("seed-multiwheel")
    assert vehicle.weight.sum() == pytest.approx(4 * 132435.0, rel=1e-12)
    np.testing.assert_allclose(Vehicle.column("koh-column").weight, 9.81 * np.array([3500.0, 250.0, 350.0]))


def test_wheels_run_behind_wheel_one_and_nose_down_moves_the_front_down():
    vehicle = Vehicle.coach(**PLAIN)
    np.testing.assert_allclose(vehicle.wheel_offsets, [0.0, 2.5, 17.5, 20.0])
    front_down = np.zeros(10)
    front_down[3] = 0.01
    force = -vehicle.stiffness @ front_down
    assert force[6] == pytest.approx(1.6e6 * 1.25 * 0.01)
    assert force[7] == pytest.approx(-1.6e6 * 1.25 * 0.01)
    front_down = np.zeros(10)
    front_down[1] = 0.01
    force = -vehicle.stiffness @ front_down
    assert force[2] == pytest.approx(0.4e6 * 8.75 * 0.01)
    assert force[4] < 0.0


def test_seed_set_equals_its_numbers_given_one_by_one():
    named, given = Vehicle.coach("seed-multiwheel"), Vehicle.coach(**PLAIN)
    for field in ("mass", "damping", "stiffness", "weight", "wheel_offsets"):
        np.testing.assert_array_equal(getattr(named, field), getattr(given, field))
    assert (named.rails, given.rails) == (2, 2)


def test_one_number_of_a_named_set_can_be_changed():
    vehicle = Vehicle.coach("zhai-high-speed", carbody_mass=36000.0)
    assert vehicle.mass[0, 0] == 36000.0
    assert vehicle.mass[2, 2] == 3000.0
    assert "changed: carbody_mass" in vehicle.source
    assert Vehicle.column("koh-column", rails=2).rails == 2


def test_column_is_half_and_matrices_are_either_by_default():
    assert Vehicle.column("koh-column").rails == 1
    assert Vehicle([[1.0]], [[0.0]], [[0.0]], wheel_dofs=[0], wheel_offsets=[0.0]).rails is None


def test_a_lone_wheel_weighs_its_mass():
    assert Vehicle([[350.0]], [[0.0]], [[0.0]], [0], [0.0]).weight == pytest.approx([350.0 * 9.81])


def test_rigid_lift_of_any_matrices_is_solved_for():
    # A bar on two wheels, described by the displacements of its third points instead of bounce and pitch.
    wheels = np.array([[1.0, 0.0], [0.0, 1.0]])
    ends = np.array([[2.0, -1.0], [-1.0, 2.0]])
    stretch = np.hstack([ends, -wheels])
    K = 1e6 * stretch.T @ stretch
    vehicle = Vehicle(np.diag([500.0, 500.0, 100.0, 100.0]), 0 * K, K, wheel_dofs=[2, 3], wheel_offsets=[0.0, 3.0])
    np.testing.assert_allclose(vehicle.rigid_lift(), 1.0, rtol=1e-12)


def test_weight_is_refused_where_no_rigid_lift_exists():
    grounded = [[2e6, -1e6], [-1e6, 1e6]]
    with pytest.raises(ValueError, match=r"no rigid lift.*give vehicle.weight \[N\]"):
        Vehicle(np.eye(2), np.zeros((2, 2)), grounded, [1], [0.0])
    given = Vehicle(np.eye(2), np.zeros((2, 2)), grounded, [1], [0.0], weight=[9.81, 9.81])
    np.testing.assert_array_equal(given.weight, 9.81)


def test_weight_is_refused_where_a_body_hangs_on_no_spring():
    with pytest.raises(ValueError, match=r"leaves top free"):
        Vehicle(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [1], [0.0], dof_names=["top", "wheel"])


def test_weight_is_refused_where_wheels_cannot_rise_together():
    # A spring that resists the sum of the two wheels' displacements, as a lever would.
    with pytest.raises(ValueError, match="no rigid lift"):
        Vehicle(np.eye(2), np.zeros((2, 2)), 1e6 * np.ones((2, 2)), [0, 1], [0.0, 2.0])


I2, O2 = np.eye(2), np.zeros((2, 2))
SPRING = 1e6 * np.array([[1.0, -1.0], [-1.0, 1.0]])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.ones((2, 3)), O2, SPRING, [1], [0.0]), "vehicle.mass has shape"),
        ((np.diag([1.0, 0.0]), O2, SPRING, [1], [0.0]), r"vehicle.mass of dof 1 = 0.0"),
        ((np.ones((2, 2)), O2, SPRING, [1], [0.0]), "positive definite"),
        ((I2, O2, [[1.0, -1.0], [0.0, 1.0]], [1], [0.0]), "vehicle.stiffness is not symmetric"),
        ((I2, [[np.nan, 0.0], [0.0, 0.0]], SPRING, [1], [0.0]), "vehicle.damping: every entry must be finite"),
        ((I2, np.zeros((3, 3)), SPRING, [1], [0.0]), r"vehicle.damping has shape \(3, 3\)"),
        ((I2, O2, SPRING, [2], [0.0]), "different dofs from 0 to 1"),
        ((I2, O2, SPRING, [-1], [0.0]), "different dofs from 0 to 1"),
        ((I2, O2, SPRING, [1, 1], [0.0, 1.0]), "different dofs"),
        ((I2, O2, SPRING, [1.0], [0.0]), "whole number"),
        ((I2, O2, SPRING, [], []), "at least one"),
        ((I2, O2, SPRING, [0, 1], [0.0, -1.0]), "vehicle.wheel_offsets"),
        ((I2, O2, SPRING, [0, 1], [1.0, 0.0]), "0 for wheel 1"),
        ((I2, O2, SPRING, [0, 1], [0.0]), "one entry a wheel"),
        ((I2, O2, SPRING, [1], [0.0], [1.0]), "vehicle.weight has shape"),
    ],
)
def test_impossible_matrices_are_refused_by_name(arguments, words):
    with pytest.raises(ValueError, match=words):
        Vehicle(*arguments)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Vehicle.coach("no-such"), "'no-such' is not in the catalogue; it has seed-multiwheel"),
        (lambda: Vehicle.coach(carbody_mass=1.0), "carbody_inertia, bogie_mass"),
        (lambda: Vehicle.coach("manchester", wheelset_mass=-1), r"vehicle.wheelset_mass = -1: must be above 0 \[kg\]"),
        (lambda: Vehicle.coach("manchester", primary=1e6), r"vehicle.primary = 1000000.0: must be a pair"),
        (lambda: Vehicle.coach("manchester", primary=(1e6, -1.0)), r"vehicle.primary damping = -1.0"),
        (lambda: Vehicle.coach("manchester", secondary=(0.0, 1.0)), r"vehicle.secondary stiffness = 0.0"),
        (lambda: Vehicle.coach("manchester", rails=3), "vehicle.rails = 3"),
    ],
)
def test_impossible_parameters_are_refused_by_name(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_vehicle_is_constant():
    vehicle = Vehicle.coach("manchester")
    with pytest.raises(ValueError, match="read-only"):
        vehicle.mass[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        vehicle.mass = np.eye(10)  # type: ignore[misc]


def test_side_view_bodies_stand_over_their_wheels():
    vehicle = Vehicle.coach("zhai-high-speed")
    kinds = [body.kind for body in vehicle.bodies]
    assert kinds == ["carbody", "bogie", "bogie"] + ["wheelset"] * 4
    front, rear = vehicle.bodies[1:3]
    assert front.offset == pytest.approx(vehicle.wheel_offsets[:2].mean())
    assert rear.offset == pytest.approx(vehicle.wheel_offsets[2:].mean())
    assert vehicle.bodies[0].offset == pytest.approx(vehicle.wheel_offsets.mean())


def test_description_says_half_or_whole_and_the_frequencies():
    text = dict(Vehicle.coach("seed-multiwheel").describe_rows())
    assert text["vehicle rails"] == "whole (two rails)"
    assert text["rigid-rail frequencies"] == "0.6704, 0.9570, 3.9789, 3.9789, 5.5185, 5.5240 Hz"
