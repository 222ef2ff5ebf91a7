"""Figures of the report that rest on runs simulated again: rare loads, and the carbody's ride."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("matplotlib")

import tbatch as tb
from tbatch.campaign.run import run
from tbatch.numerics.ride import weighting_response
from tbatch.scenario import Scenario
from tbatch.view.passages import Passages
from tbatch.view.report import write_report
from tbatch.view.report.drawing import Picture
from tbatch.view.report.rare_loads import rare_loads, rare_loads_picture
from tbatch.view.report.ride import carbody_places, ride_picture

WAVE, SPEED = 10.0, 20.0  # [m], [m/s]: 2 Hz


@pytest.fixture(scope="module")
def waves(tmp_path_factory):
    """The seed coach on a rigid rail with one long wave, as measured: ten seconds of it."""
    folder = tmp_path_factory.mktemp("waves")
    x = np.arange(0.0, 290.0, 0.25)
    np.savetxt(folder / "level.csv", np.column_stack([x, 1e-3 * np.cos(2.0 * math.pi * x / WAVE)]), delimiter=",")
    scenario = folder / "waves.toml"
    scenario.write_text(
        f"""
        campaign = {{ name = "waves", runs = 1, seed = 1 }}
        vehicle = {{ model = "seed-multiwheel" }}
        track = {{ model = "rigid", length = "290 m" }}
        contact = {{ law = "linear" }}
        irregularity = {{ measured = {{ file = "level.csv", unit = "m", up = false, window = 0.0 }} }}
        speed = {{ values = [{SPEED}, 60.0] }}
        run = {{ start = 30.0, distance = 240.0, taper = 5.0, evaluate_from = 40.0 }}
        integration = {{ step = 5e-4 }}
        keep = {{ timelines = "none" }}
        """
    )
    return run(Scenario.load(scenario), out=folder / "out")


def test_the_ride_on_a_wave_is_the_frequency_response_of_the_coach(waves):
    """K̂(ω) z = force of the wave through the contact springs, solved in the frequency domain."""
    picture = ride_picture(waves, [0, 1])
    assert isinstance(picture, Picture)
    ElementTree.fromstring(picture.svg)
    # At 60 m/s the evaluated part lasts 3.3 s, too short.
    assert [row[0] for row in picture.rows] == pytest.approx([3.6 * SPEED] * len(picture.rows))
    model = waves.scenario.model()
    vehicle, omega = model.vehicle, 2.0 * math.pi * SPEED / WAVE
    stiffness = float(model.rest.constants.stiffness[0])
    wheels = list(vehicle.wheel_dofs)
    dynamic = vehicle.stiffness + 1j * omega * vehicle.damping - omega**2 * vehicle.mass
    dynamic[wheels, wheels] += stiffness
    load = np.zeros(len(dynamic), complex)
    load[wheels] = stiffness * 1e-3 * np.exp(-2j * math.pi * np.asarray(vehicle.wheel_offsets) / WAVE)
    response = -(omega**2) * np.linalg.solve(dynamic, load)
    weight = abs(weighting_response(np.array([omega / (2.0 * math.pi)]))[0])
    for place, dofs in carbody_places(vehicle).items():
        expected = abs(dofs @ response) / math.sqrt(2.0)
        found = {row[2][:8]: row[4] for row in picture.rows if row[1] == place and row[3] == 0.5}
        # What is left of the start after 2 s, and the last part of a period.
        assert found["0.4 to 1"] == pytest.approx(expected, rel=0.02)
        assert found["weighted"] == pytest.approx(expected * weight, rel=0.02)


def test_without_five_seconds_or_a_carbody_there_is_a_reason_instead(waves):
    assert "5 s at least" in ride_picture(waves, [1])
    bare = tb.Vehicle([[1e3]], [[0.0]], [[0.0]], wheel_dofs=[0], wheel_offsets=[0.0], rails=2)
    assert carbody_places(bare) == {}
    column = carbody_places(tb.Vehicle.column("koh-column"))
    assert {name: weights.tolist() for name, weights in column.items()} == {"centre": [1.0, 0.0, 0.0]}


def test_rare_loads_are_the_order_statistics_of_the_leading_wheelset():
    runs = 2000
    random = np.random.default_rng(1)
    largest, least = random.normal(2.0, 0.1, (runs, 2, 3)), random.normal(0.5, 0.1, (runs, 2, 3))
    largest[:, 1] += 9.0  # another wheelset
    passages = Passages(np.array([1.0, 2.0, 3.0]), least, 0.5 * (least + largest), largest)
    high, middle, low = rare_loads(passages)
    ordered = np.sort(largest[:, 0], axis=0)
    np.testing.assert_array_equal(high.value, ordered[1996])  # 99.85 % of 2000: the 1997th
    np.testing.assert_array_equal(high.high, ordered[-1])  # 1,996 runs and more: the largest bounds it
    assert np.isfinite(low.low).all()
    assert (np.abs(middle.value - 1.25) < 0.01).all()


def test_few_runs_are_said_to_be_few(waves):
    picture = rare_loads_picture(waves, 0)
    ElementTree.fromstring(picture.svg)
    assert "Fewer than 1,996 runs" in picture.caption
    assert {row[-1] for row in picture.rows} == {1}
    highest = max(row[2] for row in picture.rows)
    assert highest == pytest.approx(waves.records.units(0, 1)["ratio_max"][0], rel=1e-9)


@pytest.mark.parametrize("distance", ["3 m", "5.2 m", "6 m"])
def test_a_run_as_short_as_its_taper_has_a_report(tmp_path, distance):
    short = [f"run.distance={distance}", "run.evaluate_from=1 m", "campaign.runs=2", 'keep.timelines="none"']
    campaign = run(Scenario.load("quick", overrides=short), out=tmp_path / "short")
    page = write_report(campaign, tmp_path / "report").read_text(encoding="utf-8")
    assert "No ride values" in page
    assert page.count("<svg") >= 10
