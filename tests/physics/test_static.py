"""Rest on a rigid rail: equilibrium, also where the contact decides who carries what."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbatch.physics.contact import Contact
from tbatch.physics.static import rest_on_rigid_rail
from tbatch.physics.vehicle import Vehicle

LAWS = [Contact.hertz(), Contact.linear(), Contact.linear(2e9), Contact.affine(), Contact.affine(stiffness=2e9)]


def assert_at_rest(vehicle, rest):
    """Forces balance at every dof, and each wheel's load is its law's at its own displacement."""
    balance = vehicle.weight - vehicle.stiffness @ rest.displacement
    wheels = list(vehicle.wheel_dofs)
    balance[wheels] -= rest.load
    np.testing.assert_allclose(balance, 0.0, atol=1e-7 * np.abs(vehicle.weight).max())
    np.testing.assert_allclose(rest.constants.force(rest.displacement[wheels]), rest.load, rtol=1e-9)


@pytest.mark.parametrize("contact", LAWS, ids=str)
def test_seed_coach_loads_its_wheels_equally(contact):
    vehicle = Vehicle.coach("seed-multiwheel")
    rest = rest_on_rigid_rail(vehicle, contact, 2)
    np.testing.assert_allclose(rest.load, 132435.0, rtol=1e-12)
    assert_at_rest(vehicle, rest)


def test_seed_coach_compresses_its_springs_by_their_loads():
    rest = rest_on_rigid_rail(Vehicle.coach("seed-multiwheel"), Contact.hertz(), 2)
    z, approach = rest.displacement, 69.12e-6
    assert z[6] == pytest.approx(approach, rel=1e-4)
    assert z[2] - z[6] == pytest.approx((20000.0 + 3000.0) * 9.81 / 3.2e6, rel=1e-10)
    assert z[0] - z[2] == pytest.approx(20000.0 * 9.81 / 0.4e6, rel=1e-10)
    np.testing.assert_allclose(z[[1, 3, 5]], 0.0, atol=1e-14)


@pytest.mark.parametrize("contact", LAWS, ids=str)
def test_uneven_weight_is_shared_so_that_every_dof_balances(contact):
    even = Vehicle.coach("seed-multiwheel")
    weight = even.weight.copy()
    weight[1] = 4.0e5
    weight[3] = -2.0e4
    vehicle = Vehicle(
        even.mass, even.damping, even.stiffness, even.wheel_dofs, even.wheel_offsets, weight, wheel_radius=0.4575
    )
    rest = rest_on_rigid_rail(vehicle, contact, 2)
    assert np.ptp(rest.load) > 1e4
    assert rest.load.sum() == pytest.approx(4 * 132435.0, rel=1e-12)
    assert_at_rest(vehicle, rest)


def test_loads_of_a_stiff_indeterminate_vehicle_follow_the_contact():
    # A rigid beam (springs 1000 times the contact) on three wheels, weight above the middle one: by the contact's
    # springs, all three wheels share equally. Soft springs leave nearly all to the middle wheel.
    def outer_share(stiffness):
        bar = np.array([[1.0, 0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0, -1.0]])
        bar[:, 1] = [2.0, 0.0, -2.0]
        K = stiffness * bar.T @ bar
        weight = [0.0, 0.0, 0.0, 3e5, 0.0]
        vehicle = Vehicle(np.eye(5), 0 * K, K, [2, 3, 4], [0.0, 2.0, 4.0], weight)
        rest = rest_on_rigid_rail(vehicle, Contact.linear(1e9), 1)
        assert_at_rest(vehicle, rest)
        return rest.load[0] / 3e5

    assert outer_share(1e12) == pytest.approx(1 / 3, rel=2e-3)
    assert outer_share(1e5) == pytest.approx(0.0, abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(LAWS))
def test_any_chain_of_springs_between_wheels_comes_to_rest(seed, contact):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    stretch = np.diff(np.eye(n), axis=0)
    K = stretch.T @ (10.0 ** rng.uniform(4, 11, n - 1)[:, None] * stretch)
    vehicle = Vehicle(np.eye(n), 0 * K, K, range(n), np.arange(n) * 2.0, weight=rng.uniform(1e4, 1e5, n))
    assert_at_rest(vehicle, rest_on_rigid_rail(vehicle, contact, 1))


def test_column_carries_its_weight_on_its_wheel():
    vehicle = Vehicle.column("koh-column")
    rest = rest_on_rigid_rail(vehicle, Contact.hertz(), 1)
    assert rest.load == pytest.approx([4100.0 * 9.81], rel=1e-12)
    assert_at_rest(vehicle, rest)


def test_a_body_without_weight_rests_where_it_is():
    vehicle = Vehicle([[1.0]], [[0.0]], [[0.0]], [0], [0.0], weight=[0.0])
    rest = rest_on_rigid_rail(vehicle, Contact.hertz(constant=1e11), 1)
    assert rest.load.tolist() == [0.0]
    assert rest.displacement.tolist() == [0.0]


def test_a_wheel_that_the_weight_would_lift_is_refused():
    even = Vehicle.coach("seed-multiwheel")
    weight = even.weight.copy()
    weight[5] = 1e6
    vehicle = Vehicle(even.mass, even.damping, even.stiffness, even.wheel_dofs, even.wheel_offsets, weight)
    with pytest.raises(ValueError, match=r"static load of wheel 4 = -.* N"):
        rest_on_rigid_rail(vehicle, Contact.hertz(), 2)


def test_weight_that_no_spring_carries_is_refused():
    vehicle = Vehicle(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [1], [0.0], weight=[1.0, 1.0])
    with pytest.raises(ValueError, match=r"dof 0 .*no spring carries it"):
        rest_on_rigid_rail(vehicle, Contact.hertz(), 1)
