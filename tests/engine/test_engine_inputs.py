"""What cannot be simulated is refused before the start, by name, with what is accepted."""

import numpy as np
import pytest
from engine_cases import LAWS, corrugation, model, wheel

from tbatch.engine.model import Model
from tbatch.engine.runs import Runs, SaveAt, State
from tbatch.engine.simulate import simulate
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

SLOW = Runs(speed=[40.0, 50.0], start=5.0)


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"speed": [-1.0]}, r"runs\.speed.*>= 0 m/s"),
        ({"speed": [np.nan]}, r"runs\.speed.*finite"),
        ({"speed": [[30.0, 40.0]]}, r"runs\.speed.*one"),
        ({"speed": []}, r"runs\.speed.*one"),
        ({"speed": [30.0, 40.0], "start": [1.0, 2.0, 3.0]}, r"runs\.start: shape \(3,\).*each of 2 runs \[m\]"),
        ({"speed": [30.0], "start": np.inf}, r"runs\.start: finite numbers in m"),
        ({"speed": [30.0, 40.0], "evaluate_from": [0.0]}, r"runs\.evaluate_from: shape \(1,\)"),
        ({"speed": [30.0, 40.0], "irregularity": [None]}, r"runs\.irregularity: 1 entries given for 2 runs"),
        ({"speed": [30.0], "irregularity": np.sin}, r"runs\.irregularity: a sequence with one entry"),
        ({"speed": [30.0], "irregularity": Irregularity.zero()}, r"runs\.irregularity: a sequence with one entry"),
        ({"speed": [30.0], "vehicle": [wheel(), wheel()]}, r"runs\.vehicle: 2 entries given for 1 runs"),
        ({"speed": [30.0, 40.0], "contact": [LAWS["hertz"]]}, r"runs\.contact: 1 entries given for 2 runs"),
        ({"speed": [30.0, 40.0], "wheel_profile": [None]}, r"runs\.wheel_profile: 1 entries given for 2 runs"),
    ],
)
def test_a_table_of_runs_refuses_what_is_out_of_range(entries, says):
    with pytest.raises(ValueError, match=says):
        Runs(**entries)


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"every": 0.0}, r"save\.every = 0\.0: a positive time in s"),
        ({"every": np.nan}, r"save\.every = nan"),
        (
            {"every": 1e-4, "channels": ("force",)},
            r"save\.channels: 'force' is unknown; known are contact_force, vehicle",
        ),
        ({"every": 1e-4, "channels": ("rail",)}, r"save\.rail_at: channel 'rail' needs at least one point in m"),
        ({"every": 1e-4, "channels": ("base",)}, r"save\.rail_at: channel 'base'"),
    ],
)
def test_what_to_save_refuses_what_is_out_of_range(entries, says):
    with pytest.raises(ValueError, match=says):
        SaveAt(**entries)


@pytest.mark.parametrize(
    ("save", "says"),
    [
        (SaveAt(1.5e-4), r"save\.every = 0\.00015 s: a whole multiple of the step 0\.0001 s"),
        (SaveAt(0.5e-4), r"save\.every = 5e-05 s: a whole multiple"),
        (SaveAt(1e-4, ("slab",), (5.0,)), r"save\.channels: 'slab' is not a layer of a winkler track"),
        (SaveAt(1e-4, ("base_under_wheel",)), r"save\.channels: 'base' is not a layer of a winkler track"),
        (SaveAt(1e-4, ("rail",), (-0.1,)), r"0 to 20 \[m\]"),
        (SaveAt(1e-4, ("rail",), (5.0, 20.1)), r"0 to 20 \[m\]"),
        (SaveAt(1e-4, ("rail",), (np.nan,)), r"0 to 20 \[m\]"),
    ],
)
def test_what_to_save_must_fit_the_model(save, says):
    with pytest.raises(ValueError, match=says):
        simulate(model("column", "winkler"), SLOW, 0.01, save=save, threads=1)


@pytest.mark.parametrize(
    ("duration", "says"),
    [
        (0.0, "duration: positive, finite times in s"),
        (-1.0, "duration: positive"),
        (np.nan, "duration: positive"),
        ([0.1, np.inf], "duration: positive"),
        ([0.1, 0.1, 0.1], r"duration: shape \(3,\).*each of 2 runs"),
        ([[0.1], [0.1]], r"duration: shape \(2, 1\)"),
        (1e6, "duration: 10000000000 steps; at most 2147483646"),
    ],
)
def test_durations_are_positive_and_one_a_run(duration, says):
    with pytest.raises(ValueError, match=says):
        simulate(model("column", "winkler"), SLOW, duration, threads=1)


def test_wheels_that_would_leave_the_track_are_refused_before_the_start():
    of = model("coach", "slab")
    length, back = of.track.length, of.vehicle.wheel_offsets.max()
    with pytest.raises(ValueError, match=r"run 0: its wheels would be on x = -1\.000 \.\.\."):
        simulate(of, Runs([30.0], start=back - 1.0), 0.001, threads=1)
    with pytest.raises(
        ValueError, match=rf"run 1: its wheels would be on x = .* the track is on 0 \.\.\. {length:.3f} m"
    ):
        simulate(of, Runs([10.0, 90.0], start=back), [0.1, 0.5], threads=1)
    # Standing is fine, also with the last wheel on the very end of the track.
    assert simulate(of, Runs([0.0], start=back), 0.001, threads=1).steps.tolist() == [10]


@pytest.mark.parametrize(
    ("initial", "says"),
    [
        ("flying", "initial = 'flying': accepted are 'static', 'rest' or a State"),
        (State(vehicle=np.zeros(4)), r"initial\.vehicle: shape \(4,\) given, \(3,\) or \(2, 3\) required"),
        (State(np.zeros(3), np.zeros((3, 3))), r"initial\.vehicle_velocity: shape \(3, 3\)"),
        (State(np.zeros(3), track=np.zeros((20, 2))), r"initial\.track: shape \(20, 2\) given, \(21, 2\)"),
        (State(np.zeros(3), track_velocity=np.zeros(42)), r"initial\.track_velocity: shape \(42,\)"),
        (State(np.array([0.0, np.nan, 0.0])), r"initial\.vehicle.*finite"),
        (State(np.zeros(3), np.array([0.0, np.inf, 0.0])), r"initial\.vehicle_velocity.*finite"),
        (State(np.zeros(3), track=np.full((21, 2), np.nan)), r"initial\.track.*finite"),
    ],
)
def test_a_start_must_fit_the_model(initial, says):
    with pytest.raises(ValueError, match=says):
        simulate(model("column", "winkler"), SLOW, 0.01, initial=initial, threads=1)


def test_half_and_whole_are_not_mixed():
    half, whole = Vehicle.column("koh-column"), Vehicle.coach("seed-multiwheel")
    slab, winkler = Track.slab("seed-slab", length=30.0), Track.winkler("koh-winkler", length=30.0)
    for vehicle, track in ((half, slab), (whole, winkler)):
        with pytest.raises(ValueError, match="rails"):
            Model.build(vehicle, track, LAWS["hertz"], step=1e-4)
    either = Vehicle(half.mass, half.damping, half.stiffness, half.wheel_dofs, half.wheel_offsets, wheel_radius=0.4575)
    assert Model.build(either, slab, LAWS["hertz"], step=1e-4).rails == 2
    # A run's vehicle must be of the model's kind too.
    of = model("column", "winkler")
    double = Vehicle.column("koh-column", rails=2)
    with pytest.raises(ValueError, match=r"run 1: .*rails"):
        simulate(of, Runs([40.0, 40.0], start=5.0, vehicle=[of.vehicle, double]), 0.01, threads=1)
    beam = Model.build(half, Track.beam(length=20.0, elements=8, EI=2e9, mass=2000.0), LAWS["hertz"], step=1e-4)
    with pytest.raises(ValueError, match=r"run 0: .*2 rail\(s\), the model for 1"):
        simulate(beam, Runs([40.0], start=5.0, vehicle=[double]), 0.01, threads=1)


def test_a_run_s_vehicle_has_the_model_s_dofs():
    of = model("column", "winkler")
    column = of.vehicle
    moved = Vehicle(column.mass, column.damping, column.stiffness, [0], [0.0], rails=1)
    for other in (wheel(), moved):
        with pytest.raises(ValueError, match="run 1: its vehicle must have the dofs and wheel dofs of the model's"):
            simulate(of, Runs([40.0, 40.0], start=5.0, vehicle=[column, other]), 0.01, threads=1)


def test_a_run_s_vehicle_is_named_if_it_cannot_rest():
    of = model("wheel", "rigid")
    lifted = Vehicle([[300.0]], [[0.0]], [[0.0]], [0], [0.0], [-1.0])
    with pytest.raises(ValueError, match=r"run 1: static load of wheel 1 = -1 N"):
        simulate(of, Runs([40.0, 40.0], start=5.0, vehicle=[wheel(), lifted]), 0.01, threads=1)


def test_an_irregularity_must_reach_as_far_as_its_run():
    of = model("column", "winkler")
    short = Irregularity.spectrum("china-trunk-line", wavelengths=(1.0, 3.0), period=8.0)
    ends = Irregularity.measured(np.linspace(0.0, 6.0, 61), np.zeros(61))
    for rough, says in ((short, "run 1: a span of 10 m .* period = 8 m"), (ends, "run 1: .*6")):
        with pytest.raises(ValueError, match=says):
            simulate(of, Runs([40.0, 40.0], [None, rough], start=5.0), 0.25, threads=1)


def test_wheel_profiles_need_a_radius_and_one_entry_a_wheel():
    of = model("bar", "winkler")
    oval = corrugation(0.1e-3)
    with pytest.raises(ValueError, match="run 0: wheel_profile: 3 entries given for 2 wheels"):
        simulate(of, Runs([40.0], start=5.0, wheel_profile=[(oval, None, None)]), 0.01, threads=1)
    free = Model.build(of.vehicle, of.track, type(of.contact).hertz(constant=1e11), step=1e-4)
    with pytest.raises(ValueError, match=r"run 0: wheel_profile: needs contact\.wheel_radius \[m\]"):
        simulate(free, Runs([40.0], start=5.0, wheel_profile=[oval]), 0.01, threads=1)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"step": 0.0}, "step = 0.0: a positive, finite time step in s"),
        ({"step": np.inf}, "step = inf"),
        ({"step": 1e-4, "splitting": 0.0}, r"splitting = 0\.0: a number between 0 and 1"),
        ({"step": 1e-4, "splitting": 1.0}, r"splitting = 1\.0"),
        ({"step": 1e-4, "splitting": np.nan}, "splitting = nan"),
    ],
)
def test_the_scheme_refuses_what_is_out_of_range(options, says):
    with pytest.raises(ValueError, match=says):
        Model.build(wheel(), Track.rigid(length=10.0), LAWS["hertz"], **options)


def test_threads_are_at_least_one():
    with pytest.raises(ValueError, match="threads = 0: at least 1"):
        simulate(model("column", "winkler"), SLOW, 0.01, threads=0)


def test_standing_on_a_rough_rail_is_accepted():
    of = model("column", "winkler")
    result = simulate(of, Runs([0.0], [corrugation(0.3e-3)], start=5.0), 0.002, save=SaveAt(1e-4), threads=1)
    # A start in equilibrium stays in it.
    np.testing.assert_allclose(result.contact_force, of.static_load[0], rtol=1e-9)
