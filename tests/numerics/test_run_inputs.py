"""One run's constants: where its wheels are, what lies under them, its vehicle's tables; and the scheme's numbers."""

from dataclasses import replace

import numpy as np
import pytest

from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation
from tbatch.engine.runs import Runs
from tbatch.numerics.run_inputs import VehicleTables
from tbatch.numerics.two_step import EQUAL_SPLITTING, TwoStep, effective
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

COACH = Vehicle.coach("seed-multiwheel")
MODEL = Model.build(COACH, Track.rigid(length=80.0), Contact.hertz(wheel_radius=0.4575), step=1e-4)


def test_wheels_stand_behind_the_first_by_their_offsets():
    inputs = Preparation(MODEL, Runs([40.0], start=[30.0]), np.array([100]), "rest").inputs(0)
    np.testing.assert_allclose(inputs.positions(0.01), 30.4 - np.array([0.0, 2.5, 17.5, 20.0]), rtol=1e-14)
    np.testing.assert_array_equal(inputs.levels(0.01), 0.0)


def test_every_wheel_meets_the_rail_s_level_at_its_own_place_and_its_own_profile():
    rough = Irregularity.cosines(0.13, 1e-3)
    turn = 2.0 * np.pi * 0.4575
    oval = Irregularity.cosines(2.0 / turn, 0.2e-3)
    runs = Runs([40.0], [rough], start=30.0, wheel_profile=[(None, oval, None, oval)])
    inputs = Preparation(MODEL, runs, np.array([2000]), "rest").inputs(0)
    assert inputs.circumference == pytest.approx(turn, rel=1e-15)
    for time in (0.0, 0.011, 0.0718, 0.19):
        expected = rough(inputs.positions(time)) + np.array([0.0, 1.0, 0.0, 1.0]) * oval(40.0 * time)
        # Splines are within 1e-9 m of cosines.
        np.testing.assert_allclose(inputs.levels(time), expected, atol=3e-9)


def test_a_callable_for_all_wheels_is_one_profile():
    oval = Irregularity.cosines(1.0 / (2.0 * np.pi * 0.4575), 0.2e-3)
    inputs = Preparation(MODEL, Runs([40.0], start=30.0, wheel_profile=[oval]), np.array([10]), "rest").inputs(0)
    assert len({id(profile) for profile in inputs.wheel_profiles}) == 1


@pytest.mark.parametrize("splitting", [EQUAL_SPLITTING, 0.5])
def test_a_vehicle_s_tables_invert_its_effective_matrices(splitting):
    scheme = TwoStep(1e-4, splitting)
    tables = VehicleTables.of(COACH, scheme)
    for rate, inverse in zip(scheme.rates, tables.inverse, strict=True):
        K = effective(COACH.stiffness, COACH.damping, COACH.mass, rate)
        np.testing.assert_allclose(K @ inverse, np.eye(10), atol=1e-9)
        np.testing.assert_array_equal(inverse, inverse.T)
    np.testing.assert_array_equal(tables.stiffness, -2.0 * COACH.stiffness)


def test_a_singular_effective_matrix_is_refused_by_the_vehicle_s_name():
    scheme = TwoStep(1e-4)
    # K + c C + c² M = 0 for this rate: damping that drives exactly as hard as the mass resists.
    mass = np.eye(1)
    with pytest.raises(ValueError, match=r"vehicle 'odd'.*singular"):
        VehicleTables.of(Vehicle(mass, -scheme.c3 * mass, [[0.0]], [0], [0.0], [1.0], name="odd"), scheme)


def test_equal_splitting_alone_shares_one_matrix():
    assert len(TwoStep(1e-4).rates) == 1
    assert len(TwoStep(3.7e-3).rates) == 1
    for splitting in (0.3, 0.5, 0.58, 0.59, 0.9):
        assert len(TwoStep(1e-4, splitting).rates) == 2


@pytest.mark.parametrize("splitting", [0.3, 0.5, EQUAL_SPLITTING])
def test_the_backward_difference_is_exact_for_parabolas(splitting):
    scheme = TwoStep(0.1, splitting)
    c, t = np.array([scheme.c1, scheme.c2, scheme.c3]), np.array([0.0, splitting, 1.0]) * 0.1
    # Round-off of numbers of some 1/Δt.
    np.testing.assert_allclose(c.sum(), 0.0, atol=1e-13)
    np.testing.assert_allclose(c @ t, 1.0, rtol=1e-13)
    np.testing.assert_allclose(c @ t**2, 0.2, rtol=1e-13)
    assert scheme.first == splitting * 0.1


@pytest.mark.parametrize("splitting", [0.4, 0.5, EQUAL_SPLITTING])
def test_a_free_oscillator_converges_with_the_square_of_the_step(splitting):
    errors = []
    for steps in (160, 320, 640):
        matrix = np.linalg.matrix_power(TwoStep(1.0 / steps, splitting).amplification(2.0 * np.pi, 0.05), steps)
        omega = 2.0 * np.pi * np.sqrt(1.0 - 0.05**2)
        exact = np.exp(-0.05 * 2.0 * np.pi) * (np.cos(omega) + 0.05 / np.sqrt(1.0 - 0.05**2) * np.sin(omega))
        errors.append(abs(matrix[0, 0] - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.06)


def test_another_step_is_another_model_of_the_same_parts():
    slower = MODEL.with_step(2e-4)
    assert slower.step == 2e-4
    assert slower.vehicle is MODEL.vehicle
    np.testing.assert_array_equal(
        slower.tables.inverse, Model.build(COACH, MODEL.track, MODEL.contact, step=2e-4).tables.inverse
    )
    assert replace(slower.scheme, step=1e-4) == MODEL.scheme
