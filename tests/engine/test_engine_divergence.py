"""A run that cannot be continued is stopped at its step; its neighbours in the block never notice."""

import numpy as np
import pytest
from engine_cases import corrugation, model, reference
from separation_rules import separations

from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs, SaveAt, State
from tbatch.engine.simulate import simulate
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.vehicle import Vehicle

STEPS = 150
COUNT = LANES + 1
SICK = 3


def unstable() -> Vehicle:
    """The column with dampers that drive: it grows by some e-folds a step until its numbers overflow."""
    sound = Vehicle.column("koh-column")
    driving = -3.0e4 * sound.mass
    return Vehicle(sound.mass, driving, sound.stiffness, sound.wheel_dofs, sound.wheel_offsets, wheel_radius=0.4575)


def cliff() -> Irregularity:
    """A surface that leaves every scale from 5.2 m on: the force of its first rise overflows."""
    waves = Irregularity.spectrum("china-trunk-line", wavelengths=(0.3, 0.5), tail=3, scale=1e220)
    return corrugation(0.7e-3, SICK) + waves.taper(5.2, 0.1)


def table(*, common: bool = False, **changes) -> Runs:
    """Rough runs of the column, a block and one more, on courses of their own or all on one."""
    number = np.full(COUNT, SICK) if common else np.arange(COUNT)
    entries = {
        "speed": 40.0 + 1.5 * number,
        "irregularity": [corrugation(0.7e-3, run) for run in range(COUNT)],
        "start": 5.0 + 0.01 * number,
        "evaluate_from": 0.02,
    }
    return Runs(**(entries | changes))


def sick_by_vehicle(*, common: bool) -> Runs:
    of = model("column", "winkler")
    vehicles = [of.vehicle] * COUNT
    vehicles[SICK] = unstable()
    return table(common=common, vehicle=vehicles)


def sick_by_surface(*, common: bool) -> Runs:
    surfaces = [corrugation(0.7e-3, run) for run in range(COUNT)]
    surfaces[SICK] = cliff()
    return table(common=common, irregularity=surfaces)


def simulated(runs: Runs, **options):
    of = model("column", "winkler")
    save = SaveAt(of.step, ("contact_force", "vehicle", "rail"), (5.5,))
    return simulate(of, runs, STEPS * of.step, save=save, threads=1, **options)


@pytest.fixture(scope="module", params=["own courses", "one course"])
def common(request):
    """Whether all runs keep one course, where the kernels serve all lanes at once."""
    return request.param == "one course"


@pytest.fixture(scope="module", params=[sick_by_vehicle, sick_by_surface], ids=lambda one: one.__name__)
def sick(request, common):
    """A table with one run that diverges, and what it gives."""
    runs = request.param(common=common)
    return runs, simulated(runs)


def test_it_is_stopped_at_the_step_where_the_reference_fails(sick):
    runs, result = sick
    one = reference(model("column", "winkler"), runs, STEPS * 1e-4, SICK)
    assert one.diverged
    assert result.status.tolist() == [int(run == SICK) for run in range(COUNT)]
    assert result.steps.tolist() == [one.steps if run == SICK else STEPS for run in range(COUNT)]
    assert 0 < one.steps < STEPS
    np.testing.assert_array_equal(result.contact_force[SICK, : one.steps + 1], one.force)
    np.testing.assert_array_equal(result.vehicle[SICK, : one.steps + 1], one.vehicle)


def test_its_histories_are_nan_from_there_on(sick):
    _, result = sick
    steps = result.steps[SICK]
    for history in result.channels.values():
        assert np.isfinite(history[SICK, : steps + 1]).all()
        assert np.isnan(history[SICK, steps + 1 :]).all()
        assert np.isfinite(np.delete(history, SICK, axis=0)).all()


@pytest.mark.parametrize("chunk", [1, 16, 1000])
def test_its_neighbours_are_those_of_a_sound_batch(sick, common, chunk):
    _, result = sick
    sound = simulated(table(common=common), chunk=chunk)
    assert (sound.status == 0).all()
    others = [run for run in range(COUNT) if run != SICK]
    for name, history in sound.channels.items():
        np.testing.assert_array_equal(history[others], result.channels[name][others])
    for one, other in ((sound.summary, result.summary), (sound.separations, result.separations)):
        rows, others_rows = one.to_pylist(), other.to_pylist()
        assert [row for row in rows if row["run"] != SICK] == [row for row in others_rows if row["run"] != SICK]


def test_its_statistics_are_those_of_the_steps_before(sick):
    runs, result = sick
    of = model("column", "winkler")
    one = reference(of, runs, STEPS * of.step, SICK)
    line = result.summary.to_pylist()[SICK]
    counts = one.position[1:, 0] > runs.start[SICK] + 0.02
    assert line["evaluated_time"] == pytest.approx(counts.sum() * of.step, rel=1e-14)
    assert line["force_max"] == one.force[1:][counts].max()
    assert sum(line["histogram"]) == counts.sum()
    found = separations(
        one.force[:, 0],
        one.overlap[:, 0],
        one.position[:, 0],
        beyond=runs.start[SICK] + 0.02,
        separation=0.0,
        step=of.step,
    )
    rows = [row for row in result.separations.to_pylist() if row["run"] == SICK]
    assert [(row["start"], row["end"], row["censored"]) for row in rows] == [
        (event.start * of.step, event.end * of.step, event.censored) for event in found
    ]


def test_all_runs_may_diverge():
    runs = table(vehicle=[unstable()] * COUNT)
    result = simulated(runs)
    assert (result.status == 1).all()
    assert (result.steps < STEPS).all()


def test_a_state_that_is_not_finite_is_refused():
    of = model("column", "winkler")
    broken = State(vehicle=np.array([0.0, np.nan, 0.0]))
    with pytest.raises(ValueError, match="initial"):
        simulate(of, table(), 0.01, initial=broken, threads=1)


def test_a_finished_run_stays_as_it_is_while_others_go_on():
    of = model("column", "winkler")
    save = SaveAt(of.step, ("contact_force", "vehicle", "irregularity"))
    runs = table()
    durations = np.full(COUNT, STEPS * of.step)
    durations[SICK] = 40 * of.step
    result = simulate(of, runs, durations, save=save, threads=1, chunk=13)
    assert result.steps[SICK] == 40
    for history in result.channels.values():
        assert np.isnan(history[SICK, 41:]).all()
        assert np.isfinite(history[SICK, :41]).all()
    alone = Runs(
        speed=runs.speed[SICK : SICK + 1],
        irregularity=runs.irregularity[SICK : SICK + 1],
        start=runs.start[SICK : SICK + 1],
        evaluate_from=0.02,
    )
    short = simulate(of, alone, 40 * of.step, save=save, threads=1)
    np.testing.assert_array_equal(short.contact_force[0], result.contact_force[SICK, :41])
    assert short.summary.drop_columns("run").equals(result.summary.slice(SICK, 1).drop_columns("run"))
    mine = [row | {"run": 0} for row in result.separations.to_pylist() if row["run"] == SICK]
    assert short.separations.to_pylist() == mine
