"""Where a run starts: in static equilibrium, at rest on an undeformed track, or in a given state."""

import numpy as np
import pytest

from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation
from tbatch.engine.runs import Runs, State
from tbatch.numerics.initial import InitialState
from tbatch.numerics.run_inputs import RunInputs
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

LAWS = {
    "hertz": Contact.hertz(wheel_radius=0.4575),
    "linear": Contact.linear(wheel_radius=0.4575),
    "affine": Contact.affine(wheel_radius=0.4575),
}
TRACKS = {
    "slab": Track.slab("seed-slab", length=45.5),
    "rigid": Track.rigid(length=60.0),
    "beam": Track.beam(length=45.0, elements=30, EI=2e11, mass=5000.0),
}
WAVES = Irregularity.cosines([0.05, 0.4], [3e-3, 0.3e-3], [0.3, 1.0])


def three_axles() -> Vehicle:
    """A body on three sprung wheels, one spring too many to be statically determinate."""
    k, arms = 1.6e6, np.array([2.0, 0.0, -2.0])
    links = np.zeros((3, 5))
    links[:, 0], links[:, 1], links[:, 2:] = 1.0, arms, -np.eye(3)
    return Vehicle(
        np.diag([24e3, 3e4, 2e3, 2e3, 2e3]),
        2e4 * links.T @ links,
        k * links.T @ links,
        [2, 3, 4],
        2.0 - arms,
        rails=2,
        wheel_radius=0.4575,
    )


VEHICLES = {"coach": Vehicle.coach("seed-multiwheel"), "three axles": three_axles()}


def started(
    track: str, law: str, rough, initial="static", vehicle: str = "coach", **options
) -> tuple[Model, RunInputs, InitialState]:
    """A vehicle's model, the constants of one run, and its start."""
    of = Model.build(VEHICLES[vehicle], TRACKS[track], LAWS[law], step=1e-4, **options)
    preparation = Preparation(of, Runs([50.0], [rough], start=31.3), np.array([10]), initial)
    inputs = preparation.inputs(0)
    return of, inputs, preparation.start(0, inputs)


def assert_in_balance(of: Model, inputs: RunInputs, state: InitialState) -> None:
    """Every dof of vehicle and track is in balance, and the forces are the law's at the overlaps."""
    vehicle, load = inputs.vehicle, inputs.rest.load
    pull = np.zeros(vehicle.dof_count)
    pull[list(vehicle.wheel_dofs)] = load - state.force
    # The equilibrium is sought to 1e-14 of the largest load that r alone would make; soft springs carry it on.
    np.testing.assert_allclose(vehicle.stiffness @ state.displacement, pull, atol=1e-8 * load.max())
    positions = inputs.positions(0.0)
    if of.track.node_dofs:
        pushed = of.ground.loads(positions) @ state.force
        pushed[of.track.pinned] = 0.0
        np.testing.assert_allclose(of.track.stiffness.dot(state.track), pushed, atol=1e-8 * load.max())
        assert (state.track[of.track.pinned] == 0.0).all()
    assert_compatible(of, inputs, state)


def assert_compatible(of: Model, inputs: RunInputs, state: InitialState) -> None:
    """δ = δ₀ + q_w - N u - r - (local compliance) F, and F = law(δ)."""
    positions, constants = inputs.positions(0.0), inputs.rest.constants
    rail = np.einsum("ndw,nd->w", of.ground.loads(positions), state.track)
    wheels = state.displacement[list(inputs.vehicle.wheel_dofs)]
    give = of.ground.compliance(positions) @ state.force
    overlap = constants.approach + wheels - rail - inputs.levels(0.0) - give
    # Terms of some millimetres: round-off of 1e-18 m each.
    np.testing.assert_allclose(state.overlap, overlap, atol=1e-15)
    np.testing.assert_allclose(state.force, constants.force(state.overlap), rtol=1e-12)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("rough", [None, WAVES], ids=["smooth", "rough"])
def test_a_static_start_is_in_balance(track, law, vehicle, rough):
    of, inputs, state = started(track, law, rough, vehicle=vehicle)
    assert_in_balance(of, inputs, state)
    assert (state.velocity == 0.0).all()
    assert (state.track_velocity == 0.0).all()
    assert state.force.sum() == pytest.approx(inputs.rest.load.sum(), rel=1e-9)
    if vehicle == "coach":
        # Two bogies of two wheelsets are statically determinate: no rail, however rough, changes their loads.
        np.testing.assert_allclose(state.force, inputs.rest.load, rtol=1e-9)
    elif rough is not None:
        assert np.ptp(state.force) > 100.0
    if rough is None and track == "rigid":
        # Level: the vehicle is where it was.
        np.testing.assert_allclose(state.displacement, 0.0, atol=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_a_wheel_over_a_hole_hangs_and_the_others_carry_it(law):
    # 31.3 m is wheel 1; the hole is under wheel 2, 2 m behind.
    hole = Irregularity.flat(0.2, 1.0, 28.8)
    of, inputs, state = started("slab", law, hole, vehicle="three axles")
    assert_in_balance(of, inputs, state)
    assert state.force[1] == 0.0
    np.testing.assert_allclose(state.force[[0, 2]], 1.5 * inputs.rest.load[0], rtol=1e-9)
    assert state.overlap[1] < inputs.rest.constants.separation[1]


@pytest.mark.parametrize("local", [True, False])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("track", TRACKS)
def test_at_rest_the_track_is_undeformed_and_the_forces_are_static(track, law, local):
    of, inputs, state = started(track, law, WAVES, "rest", local_compliance=local)
    np.testing.assert_array_equal(state.force, inputs.rest.load)
    assert (state.track == 0.0).all()
    assert_compatible(of, inputs, state)
    others = np.setdiff1d(np.arange(10), of.vehicle.wheel_dofs)
    assert (state.displacement[others] == 0.0).all()


@pytest.mark.parametrize("law", LAWS)
def test_a_given_state_decides_its_contact_forces(law):
    random = np.random.default_rng(2)
    free = TRACKS["slab"].free
    given = State(
        vehicle=1e-4 * random.standard_normal(10),
        vehicle_velocity=random.standard_normal(10),
        track=1e-4 * random.standard_normal(free.shape) * free,
        track_velocity=random.standard_normal(free.shape) * free,
    )
    of, inputs, state = started("slab", law, WAVES, given)
    assert_compatible(of, inputs, state)
    for part, expected in (
        (state.displacement, given.vehicle),
        (state.velocity, given.vehicle_velocity),
        (state.track, given.track),
        (state.track_velocity, given.track_velocity),
    ):
        np.testing.assert_array_equal(part, expected)


def test_a_static_state_given_again_has_the_same_forces():
    _, _, state = started("slab", "hertz", WAVES)
    _, _, again = started("slab", "hertz", WAVES, State(state.displacement, track=state.track))
    np.testing.assert_allclose(again.force, state.force, rtol=1e-9)


def test_the_static_flexibility_is_symmetric_and_has_the_closed_form_of_a_simple_beam():
    ground = Model.build(Vehicle.coach("seed-multiwheel"), TRACKS["beam"], LAWS["hertz"], step=1e-4).ground
    x = np.array([3.0, 4.1, 20.2, 44.0])
    flexibility = ground.flexibility(x)
    np.testing.assert_allclose(flexibility, flexibility.T, rtol=1e-9)
    EI, length = 2e11, 45.0
    low, high = np.minimum(x[:, None], x[None, :]), np.maximum(x[:, None], x[None, :])
    b = length - high
    # Cubic elements with the loaded element's own deflection are exact for point loads.
    exact = b * low * (length**2 - b**2 - low**2) / (6.0 * EI * length)
    np.testing.assert_allclose(flexibility, exact, rtol=1e-7)


def test_equal_starts_are_computed_once():
    of = Model.build(Vehicle.coach("seed-multiwheel"), TRACKS["slab"], LAWS["hertz"], step=1e-4)
    rough = WAVES.taper(31.3, 2.0)
    preparation = Preparation(
        of, Runs([50.0, 60.0, 60.0], [rough] * 3, start=[31.3, 31.3, 31.4]), np.full(3, 10), "static"
    )
    states = [preparation.start(run, preparation.inputs(run)) for run in range(3)]
    assert states[0] is states[1]
    assert states[2] is not states[0]
