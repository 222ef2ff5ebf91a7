"""Each shipped scenario runs, and shows what its heading says: one number pins each."""

import numpy as np
import pytest

import tbatch as tb
from tbatch.engine.result import Result
from tbatch.scenario import Scenario


def run(name: str, pairs: list[tuple[int, int]], *overrides: str) -> tuple[Scenario, Result]:
    scenario = Scenario.load(name, overrides=overrides)
    runs, durations = scenario.runs(pairs)
    result = tb.simulate(scenario.model(), runs, durations)
    assert not result.status.any()
    return scenario, result


def test_smooth_track_keeps_the_static_load() -> None:
    _, result = run("smooth_track", [(0, 0)])
    (row,) = result.summary.to_pylist()
    assert row["separations"] == 0
    # A constant force that moves along a uniform bed stays the weight, 9.81 m/s2 x 4100 kg. The elements' length and
    # the start at rest leave less than 1e-4 of it.
    assert row["force_max"] == pytest.approx(9.81 * 4100.0, rel=1e-4)
    assert row["force_min"] == pytest.approx(9.81 * 4100.0, rel=1e-4)


def test_wheel_flat_leaves_the_rail_at_its_beginning_and_lands_on_its_far_flank() -> None:
    _, result = run("wheel_flat", [(0, 0)])
    first, *_ = result.separations.to_pylist()
    assert 150.0 < first["position"] < 150.02
    landing = 130.0 + 32.5 * first["end"]
    assert 150.075 < landing < 150.15
    # 2.75 ms with the step of 0.05 ms, and with half of it: a step of start and of end are the sampling's.
    assert first["end"] - first["start"] == pytest.approx(2.75e-3, abs=1e-4)


def test_slab_irregular_lifts_wheel_1_for_some_milliseconds() -> None:
    # One of the four runs, on one element a bay with twice the step: 5.4 ms where the scenario as shipped has 5.35.
    _, result = run("slab_irregular", [(0, 0)], "track.elements_per_bay=1", "integration.step=0.1 ms")
    wheels = result.summary.to_pylist()
    assert [wheel["evaluated_distance"] for wheel in wheels] == pytest.approx([45.1, 42.6, 27.6, 25.1], abs=0.02)
    assert wheels[0]["longest"] == pytest.approx(5.4e-3, abs=2e-4)


def test_quick_separates_more_at_the_higher_speed() -> None:
    scenario, result = run("quick", [(case, sample) for case in (0, 1) for sample in range(4)])
    separations = np.array(result.summary["separations"]).reshape(2, 4, 4)
    slow, fast = separations.sum(axis=(1, 2))
    assert scenario.speeds[0] < scenario.speeds[1]
    assert slow < 10 < fast
    # Static load and irregularity have no upward mean: over a run the wheels carry the weight, to the length of a run.
    mean = np.array(result.summary["force_mean"])
    assert mean.mean() == pytest.approx(132.435e3, rel=0.01)


def test_separation_goes_from_almost_never_to_always_with_speed() -> None:
    scenario = Scenario.load("separation_vs_speed")
    ends = (0, len(scenario.speeds) - 1)
    _, result = run("separation_vs_speed", [(case, sample) for case in ends for sample in range(4)])
    separated = np.array(result.summary["separations"]).reshape(2, 4, 4).sum(axis=2) > 0
    assert scenario.samples >= 100
    assert [round(3.6 * scenario.speeds[case]) for case in ends] == [160, 400]
    assert separated[0].sum() <= 1
    assert separated[1].all()
