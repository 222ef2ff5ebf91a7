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


def test_seed_fig6_holds_the_static_load_with_a_step_of_1_ms() -> None:
    _, result = run("seed_fig6", [(0, 0)])
    (row,) = result.summary.to_pylist()
    # The start from standstill leaves a quarter of a per cent; 1 ms adds nothing to it.
    assert row["force_max"] == pytest.approx(9.81 * 4100.0, rel=3e-3)
    assert row["force_min"] == pytest.approx(9.81 * 4100.0, rel=3e-3)
    assert row["separations"] == 0


def test_seed_fig7_rings_by_newmark_and_not_by_two_step() -> None:
    scenario = Scenario.load("seed_fig7")
    runs, durations = scenario.runs([(0, 0)])
    model = scenario.model()
    given = {"speed": runs.speed[0], "irregularity": None, "start": runs.start[0], "duration": durations[0],
             "step": model.step, "save": tb.SaveAt(model.step, ("rail_acceleration",), [50.0])}  # fmt: skip
    parts = model.vehicle, model.track, model.contact
    level = [
        np.sqrt(np.mean(method(*parts, **given).rail_acceleration[0, 90:] ** 2))
        for method in (tb.methods.newmark_hertz, tb.methods.two_step)
    ]
    # 1.84 against 0.33 m/s2 rms from a tenth of the run on.
    assert level[1] == pytest.approx(0.33, abs=0.01)
    assert level[0] / level[1] > 4.0


@pytest.mark.parametrize(("name", "most"), [("seed_fig8_smooth", 135.4e3), ("seed_fig8_rough", 296e3)])
def test_seed_fig8_runs_with_and_without_irregularity(name: str, most: float) -> None:
    changes = ("track.elements_per_bay=1", "integration.step=0.1 ms", "keep.every=0.1 ms")
    _, result = run(name, [(0, 0)], *changes)
    assert max(result.summary["force_max"].to_pylist()) == pytest.approx(most, rel=0.02)


def test_seed_fig9_counts_separations_on_one_line_and_none_on_the_other() -> None:
    ends = [(0, 0), (0, 1), (4, 0), (4, 1)]
    counts = {}
    for name in ("seed_fig9_trunk_line", "seed_fig9_ballastless"):
        _, result = run(name, ends)
        counts[name] = np.array(result.summary["separations"]).reshape(4, 4).sum(axis=1)
    assert not counts["seed_fig9_ballastless"].any()
    assert counts["seed_fig9_trunk_line"][:2].sum() < counts["seed_fig9_trunk_line"][2:].sum()
