"""Imported tracks in the batch engine: the reference's bits, the built-in track's forces."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from finite_elements import exported, reduced, sleeper_track, solid_rail

import tbatch as tb
from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation, step_counts
from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs
from tbatch.numerics.reference import ReferenceRun
from tbatch.numerics.rows import shape_at
from tbatch.numerics.two_step import EQUAL_SPLITTING

HERTZ = tb.Contact.hertz(wheel_radius=0.4575)
STEP = 1e-4
X = 10.0 + np.cumsum(np.append(0.0, np.tile([0.6, 0.45, 0.7, 0.2], 6)))
"""Nodes at uneven distances, not from 0."""


def pair() -> tb.Vehicle:
    """A sprung mass on two wheels 0.3 m apart."""
    k, c, half = 2e6, 2e4, 0.15
    links = np.array([[1.0, half, -1.0, 0.0], [1.0, -half, 0.0, -1.0]])
    pairs = links.T @ links
    return tb.Vehicle(np.diag([4000.0, 300.0, 400.0, 400.0]), c * pairs, k * pairs, [2, 3], [0.0, 2.0 * half])


TRACKS = {
    "cubic": lambda: sleeper_track(X).shuffled(1),
    "straight": lambda: solid_rail(10.0 + 0.6 * np.arange(20)).shuffled(2),
    "reduced": lambda: reduced(sleeper_track(X), 6).shuffled(3),
}


@cache
def model(track: str, splitting: float = EQUAL_SPLITTING) -> Model:
    """A pair of wheels on an imported track."""
    export = TRACKS[track]()
    EI = None if export.theta is None else 6.4e6
    made = replace(export, EI=EI).track()
    return Model.build(pair(), made, HERTZ, step=STEP, splitting=splitting)


def rough_runs(count: int) -> Runs:
    """Runs rough enough that wheels leave the rail; the second block keeps one course."""
    place = np.where(np.arange(count) // LANES == 1, LANES, np.arange(count))
    rough = [
        tb.Irregularity.cosines([1.0 / 0.21, 1.0 / 0.083], [0.6e-3, 0.1e-3], [0.7 * run, 1.0 + 1.4 * run])
        for run in range(count)
    ]
    return Runs(speed=38.0 + 0.7 * place, irregularity=rough, start=11.5 + 0.037 * place)


@pytest.mark.parametrize(("track", "splitting"), [*((name, EQUAL_SPLITTING) for name in TRACKS), ("cubic", 0.5)])
def test_kernels_equal_the_reference_bit_for_bit(track, splitting):
    of, count, steps = model(track, splitting), LANES + 1, 60
    runs, points = rough_runs(count), np.array([10.0, 10.3, 12.05, 20.9])
    save = tb.SaveAt(STEP, ("contact_force", "vehicle", "rail", "rail_under_wheel", "irregularity"), points)
    result = tb.simulate(of, runs, steps * STEP, save=save)
    assert (result.contact_force == 0.0).any()
    preparation = Preparation(of, runs, step_counts(of, runs, steps * STEP), "static")
    element, _, n = shape_at(of.track, points)
    rows = of.track.layer_rows(element)
    for run in (1, LANES):
        inputs = preparation.inputs(run)
        oracle = ReferenceRun(
            of.factor, of.scheme, inputs, preparation.start(run, inputs), line=of.track, compliance=of.compliance
        )
        for step in range(steps):
            assert oracle.advance(step)
            np.testing.assert_array_equal(result.contact_force[run, step + 1], oracle.force)
            np.testing.assert_array_equal(result.vehicle[run, step + 1], oracle.q)
            np.testing.assert_array_equal(result.irregularity[run, step + 1], oracle.level)
            u = oracle.u.ravel()[rows]
            rail = (n[:, 0] * u[:, 0] + n[:, 1] * u[:, 1]) + (n[:, 2] * u[:, 2] + n[:, 3] * u[:, 3])
            np.testing.assert_array_equal(result.rail[run, step + 1], rail)


def test_a_run_does_not_depend_on_its_batch():
    of, runs = model("cubic"), rough_runs(2 * LANES + 1)
    save = tb.SaveAt(STEP, ("contact_force",))
    together = tb.simulate(of, runs, 0.006, save=save)
    for run in (3, LANES + 2, 2 * LANES):
        alone = tb.simulate(
            of,
            Runs(speed=[runs.speed[run]], irregularity=[runs.irregularity[run]], start=float(runs.start[run])),
            0.006,
            save=save,
            chunk=7,
        )
        np.testing.assert_array_equal(alone.contact_force[0], together.contact_force[run])


@pytest.mark.parametrize("per_bay", [1, 2])
def test_the_slab_track_as_matrices_in_any_order_gives_the_same_forces(per_bay):
    slab = tb.Track.slab("seed-slab", length=39.0, elements_per_bay=per_bay)
    coach = tb.Vehicle.coach("seed-multiwheel")
    rough = tb.Irregularity.spectrum("china-trunk-line", wavelengths=(0.3, 50.0), tail=3, scale=3.0, seed=1)
    save = tb.SaveAt(STEP, ("contact_force", "rail", "rail_acceleration"), [25.0, 30.13])
    forces = []
    for track in (slab, exported(slab).shuffled(5).track(rails=2)):
        of = Model.build(coach, track, HERTZ, step=STEP)
        assert of.compliance > 0.0
        forces.append(tb.simulate(of, Runs([83.0], [rough], 22.0), 0.1, save=save))
    built_in, imported = forces
    assert (built_in.contact_force < 0.3 * 132.435e3).any()
    # Round-off of two orders of elimination, carried through 1000 steps with contact.
    for channel, tolerance in (("contact_force", 1e-9), ("rail", 1e-9), ("rail_acceleration", 1e-8)):
        a, b = (one.channels[channel] for one in (imported, built_in))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * np.abs(b).max())


def test_where_x_begins_does_not_matter():
    save = tb.SaveAt(STEP, ("contact_force",))
    forces = []
    for ahead in (0.0, 64.0):
        export = sleeper_track(X)
        track = tb.Track.from_matrices(
            *export.matrices, rail_x=X - 74.0 + ahead, rail_w=export.w, rail_theta=export.theta
        )
        assert (track.begin, track.length) == (-64.0 + ahead, pytest.approx(X[-1] - X[0]))
        of = Model.build(pair(), track, HERTZ, step=STEP)
        forces.append(tb.simulate(of, Runs([40.0], [None], -62.0 + ahead), 0.02, save=save).contact_force)
    # Round-off of x at 64 m in the local coordinate.
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-9)


def test_wheels_must_stay_on_the_rail_of_the_matrices():
    with pytest.raises(ValueError, match=r"x = 9\.700 \.\.\. 11\.000 m, the track is on 10 \.\.\. 21\.700 m"):
        tb.simulate(model("cubic"), Runs([10.0], [None], 10.0), 0.1)
    with pytest.raises(ValueError, match=r"x = .*: must be from 10 to 21\.7 \[m\]"):
        tb.simulate(model("cubic"), Runs([10.0], [None], 11.0), 0.01, save=tb.SaveAt(STEP, ("rail",), [9.0]))


@pytest.mark.parametrize("layer", ["slab", "base"])
def test_layers_that_matrices_do_not_name_are_refused(layer):
    with pytest.raises(ValueError, match=f"{layer!r} is not a layer of a matrices track"):
        tb.simulate(model("cubic"), Runs([10.0], [None], 11.0), 0.01, save=tb.SaveAt(STEP, (layer,), [11.0]))


def test_half_or_whole_is_what_the_vehicle_says_unless_said():
    export = sleeper_track(X)
    assert model("cubic").rails == 1
    coach = tb.Vehicle.coach("seed-multiwheel")
    assert Model.build(coach, export.track(), HERTZ, step=STEP).rails == 2
    with pytest.raises(ValueError, match="both must be half or both whole"):
        Model.build(coach, export.track(rails=1), HERTZ, step=STEP)


def test_describe_says_what_was_imported():
    text = model("cubic").describe()
    assert "25 nodes, 0.2 to 0.7 m apart; cubic" in text
    assert "75 given, 75 stepped" in text
    assert "in series with the contact" in text
    slab = exported(tb.Track.slab("seed-slab", length=13.0)).shuffled(2).track()
    assert "held at x = 0, 13 m" in str(slab.describe_rows())
    assert "straight lines between the nodes" in model("straight").describe()
    assert "local rail compliance     off" in model("straight").describe()
