"""The table of separations follows from the full-rate history by the stated rules."""

import numpy as np
import pytest
from engine_cases import corrugation, model, reference, wheel
from separation_rules import separations

from tbatch.engine.model import Model
from tbatch.engine.result import Result
from tbatch.engine.runs import Runs, State
from tbatch.engine.simulate import simulate
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle


def assert_table_follows(result: Result, of: Model, runs: Runs, duration, initial: str | State = "static") -> int:
    """Compare every row with the rules applied to the reference's history; returns the number of separations."""
    rows = result.separations.to_pylist()
    summary = result.summary.to_pylist()
    expected = []
    for run in range(len(runs)):
        one = reference(of, runs, duration, run, initial)
        for number in range(of.vehicle.wheel_count):
            constants = of.rest.constants
            found = separations(
                one.force[:, number],
                one.overlap[:, number],
                one.position[:, number],
                beyond=runs.start[run] + runs.evaluate_from[run],
                separation=constants.separation[number],
                step=of.step,
            )
            expected += [
                {
                    "run": run,
                    "wheel": number + 1,
                    "start": event.start * of.step,
                    "end": event.end * of.step,
                    "position": event.position,
                    "gap": event.gap,
                    "landing_force": event.landing_force,
                    "censored": event.censored,
                }
                for event in found
            ]
            line = summary[run * of.vehicle.wheel_count + number]
            assert (line["run"], line["wheel"]) == (run, number + 1)
            assert line["separations"] == len(found)
            assert line["censored"] == sum(event.censored for event in found)
            ended = [event.end * of.step - event.start * of.step for event in found if not event.censored]
            # A difference of two times, each a product: one rounding apart.
            assert line["longest"] == pytest.approx(max(ended, default=0.0), rel=1e-12)
            assert line["largest_gap"] == max((event.gap for event in found), default=0.0)
            assert line["largest_landing_force"] == max((event.landing_force for event in found), default=0.0)
    assert rows == expected
    return len(rows)


@pytest.mark.parametrize("law", ["hertz", "linear", "affine"])
@pytest.mark.parametrize("chunk", [1, 7, None])
def test_every_separation_is_logged_by_the_rules(law, chunk):
    of = model("bar", "winkler", law)
    runs = Runs(
        speed=[55.0, 47.0, 30.0],
        irregularity=[corrugation(0.5e-3, phase) for phase in (0.0, 1.0, 2.0)],
        start=5.0,
        evaluate_from=[0.0, 0.5, 1.0],
    )
    duration = [0.04, 0.05, 0.05]
    result = simulate(of, runs, duration, chunk=chunk, threads=1)
    assert assert_table_follows(result, of, runs, duration) > 20


def test_a_separation_open_at_the_end_is_censored():
    of = model("wheel", "rigid")
    runs = Runs(speed=[50.0], irregularity=[Irregularity.flat(5e-3, 0.5, 10.02)], start=10.0)
    result = simulate(of, runs, 0.005, threads=1)
    assert assert_table_follows(result, of, runs, 0.005) == 1
    event = result.separations.to_pylist()[0]
    assert event["censored"]
    assert event["end"] == pytest.approx(0.005, rel=1e-12)
    assert event["landing_force"] == 0.0
    # It counts, but its length is not known.
    assert result.summary["longest"].to_pylist() == [0.0]
    assert result.summary["separations"].to_pylist() == [1]


def test_a_separation_open_where_evaluation_begins_is_censored():
    of = model("wheel", "rigid")
    # In the air from 10.0x m on, evaluated from 10.1 m on.
    runs = Runs(speed=[50.0], irregularity=[Irregularity.flat(1e-3, 0.3, 10.02)], start=10.0, evaluate_from=[0.1])
    result = simulate(of, runs, 0.02, threads=1)
    assert assert_table_follows(result, of, runs, 0.02) >= 1
    event = result.separations.to_pylist()[0]
    assert event["censored"]
    assert 10.1 < event["position"] <= 10.105 + 1e-9
    assert event["landing_force"] > 0.0


def test_a_run_that_starts_in_the_air_begins_censored():
    of = model("wheel", "rigid")
    runs = Runs(speed=[20.0], start=[5.0])
    lifted = State(vehicle=np.array([-2e-4]))
    result = simulate(of, runs, 0.01, initial=lifted, threads=1)
    assert_table_follows(result, of, runs, 0.01, lifted)
    assert result.separations["censored"].to_pylist()[0]
    assert result.separations["start"].to_pylist()[0] == of.step


def test_a_separation_that_begins_where_evaluation_begins_is_whole():
    of = model("wheel", "rigid")
    smooth = Irregularity.flat(1e-3, 0.3, 10.02)
    probe = Runs(speed=[50.0], irregularity=[smooth], start=10.0)
    one = reference(of, probe, 0.02, 0)
    start = int(np.argmax(one.force[:, 0] == 0.0))
    # Evaluation begins within the step at whose end the wheel has lost contact.
    half_way = 0.5 * (one.position[start - 1, 0] + one.position[start, 0]) - 10.0
    runs = Runs(speed=[50.0], irregularity=[smooth], start=10.0, evaluate_from=[half_way])
    result = simulate(of, runs, 0.02, threads=1)
    assert assert_table_follows(result, of, runs, 0.02) >= 1
    assert not result.separations["censored"].to_pylist()[0]
    assert result.separations["start"].to_pylist()[0] == start * of.step


def test_a_landing_that_the_run_s_end_cuts_is_written_as_it_stands():
    of = model("wheel", "rigid")
    rough = Irregularity.flat(1e-3, 0.3, 10.02)
    one = reference(of, Runs(speed=[50.0], irregularity=[rough], start=10.0), 0.02, 0)
    force = one.force[:, 0]
    start = int(np.argmax(force == 0.0))
    end = start + int(np.argmax(force[start:] > 0.0))
    # Two steps after touching down: still rising.
    runs = Runs(speed=[50.0], irregularity=[rough], start=10.0)
    result = simulate(of, runs, (end + 2) * of.step, threads=1)
    assert assert_table_follows(result, of, runs, (end + 2) * of.step) == 1
    event = result.separations.to_pylist()[0]
    assert not event["censored"]
    assert event["end"] == end * of.step
    assert event["landing_force"] < 0.9 * force[end + 3]


@pytest.mark.parametrize(("step", "window"), [(1e-4, 50), (7e-5, 71), (1e-3, 5)])
def test_a_landing_is_watched_for_5_ms(step, window):
    # On a spring this soft the force rises for 20 ms after touch-down.
    of = Model.build(wheel(), Track.rigid(length=60.0), Contact.linear(2e6), step=step)
    runs = Runs(speed=[20.0], start=[5.0])
    lifted = State(vehicle=np.array([-of.static_vehicle[0] - 1e-4]))
    result = simulate(of, runs, 0.03, initial=lifted, threads=1)
    force = reference(of, runs, 0.03, 0, lifted).force[:, 0]
    event = result.separations.to_pylist()[0]
    end = round(event["end"] / step)
    assert event["landing_force"] == force[end + window]
    assert force[end + window + 1] > force[end + window]


@pytest.mark.parametrize("chunk", [1, 2, 3, 64, 1000])
def test_the_log_holds_a_separation_every_second_step(chunk):
    # A heavy wheel on a stiff linear spring over a sawtooth of two steps' length: contact at every second step end.
    step, speed = 1e-4, 50.0
    vehicle = Vehicle([[2000.0]], [[0.0]], [[0.0]], [0], [0.0], [100e3])
    # It starts where a touch every second step carries its weight on the average.
    start = State(vehicle=np.array([-1e-4]))
    of = Model.build(vehicle, Track.rigid(length=60.0), Contact.linear(1e9), step=step)
    teeth = Irregularity.cosines(1.0 / (2.0 * speed * step), 2e-4)
    runs = Runs(speed=[speed] * 9, irregularity=[teeth] * 9, start=10.0)
    result = simulate(of, runs, 400 * step, initial=start, chunk=chunk, threads=1)
    counts = result.summary["separations"].to_numpy()
    assert (counts == 200).all()
    assert assert_table_follows(result, of, runs, 400 * step, start) == counts.sum()


def test_a_smooth_run_has_no_separations_and_empty_tables_have_types():
    of = model("column", "winkler")
    result = simulate(of, Runs(speed=[40.0], start=5.0), 0.01, threads=1)
    assert result.separations.num_rows == 0
    assert [str(field.type) for field in result.separations.schema] == [
        "int32", "int32", "double", "double", "double", "double", "double", "bool",
    ]  # fmt: skip
    line = result.summary.to_pylist()[0]
    assert (line["separations"], line["longest"], line["largest_gap"], line["largest_landing_force"]) == (0, 0, 0, 0)
