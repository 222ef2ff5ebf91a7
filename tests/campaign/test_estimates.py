"""Estimates of tables worked by hand, and of toys whose truth is known."""

import math

import numpy as np
import pyarrow as pa
import pytest
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.estimates import FILTERED, RAW, Records, estimates
from tbatch.campaign.estimates.convergence import convergence, sizes
from tbatch.campaign.estimates.curves import along_line, events_exceeding, exceedance, time_above
from tbatch.campaign.estimates.loads import section_percentiles
from tbatch.campaign.run import run


def records(forces, events=(), status=None, cases=1, varied=None):
    """Records of runs of 50 m at 50 m/s from the largest Q/Q0 of each run and wheel, and events (sample, wheel, s)."""
    forces = np.asarray(forces, float)
    runs, wheels = forces.shape
    sample = np.tile(np.arange(runs), cases)
    case = np.repeat(np.arange(cases), runs)
    count = np.zeros((runs, wheels))
    for at, wheel, _ in events:
        count[at, wheel - 1] += 1
    per_wheel = {"case": np.repeat(case, wheels), "sample": np.repeat(sample, wheels)}
    ratio = np.tile(forces.ravel(), cases)
    bins = np.zeros((len(ratio), 101), int)
    bins[:, 20] = 900
    bins[np.arange(len(ratio)), np.minimum((np.nan_to_num(ratio) / 0.05).astype(int), 100)] += 100
    wheel_table = pa.table(
        {
            **per_wheel,
            "wheel": np.tile(np.arange(1, wheels + 1), runs * cases),
            "static_load": np.full(len(ratio), 1e5),
            "evaluated_time": np.where(np.isnan(ratio), 0.0, 1.0),
            "evaluated_distance": np.where(np.isnan(ratio), 0.0, 50.0),
            "separations": np.tile(count.ravel(), cases),
            "separated_time": np.tile(count.ravel(), cases) * 1e-3,
            "longest": np.zeros(len(ratio)),
            "force_max": 1e5 * ratio,
            "force_min": np.full(len(ratio), 5e4),
            "force_20hz_max": np.full(len(ratio), 1.2e5),
            "force_20hz_min": np.full(len(ratio), -1e3),
            "time_below_0.4": np.zeros(len(ratio)),
            "histogram": pa.array(bins.tolist()),
            "histogram_20hz": pa.array(bins.tolist()),
        }
    )
    event_table = pa.table(
        {
            "case": np.repeat(np.arange(cases), len(events)),
            "sample": np.tile(np.array([event[0] for event in events], int), cases),
            "wheel": np.tile(np.array([event[1] for event in events], int), cases),
            "start": np.zeros(len(events) * cases),
            "end": np.tile(np.array([event[2] for event in events], float), cases),
            "gap": np.full(len(events) * cases, 1e-4),
            "landing_force": np.full(len(events) * cases, 2e5),
            "position": np.full(len(events) * cases, 61.0),
            "censored": np.full(len(events) * cases, False),
        }
    )
    run_table = {
        "case": case,
        "sample": sample,
        "status": np.zeros(len(case), int) if status is None else np.asarray(status),
        "speed": np.full(len(case), 50.0),
        **(varied or {}),
    }
    return Records(pa.table(run_table), wheel_table, event_table)


def by_name(units):
    return {estimate.name: estimate for estimate in estimates(units)}


def test_separations_of_a_table_worked_by_hand():
    found = by_name(records(np.ones((4, 2)), [(0, 1, 2e-3), (0, 1, 0.4e-3), (2, 2, 20e-3)]).units(0))
    assert found["separation.probability"].value == 0.5
    assert found["separation.per_km"].value == pytest.approx(3 / 0.4)
    assert (found["separation.per_km"].count, found["separation.per_km_1ms"].count) == (3, 2)
    assert found["separation.per_km_15ms"].count == found["separation.per_km_100mm"].count - 1 == 1
    assert found["separation.share"].value == pytest.approx(3e-3 / 8)
    assert found["separation.duration.p50"].value == pytest.approx(2e-3)
    assert found["separation.length.p95"].value == pytest.approx(20e-3 * 50)


def test_a_wheelset_and_any_wheelset_and_the_whole_campaign_have_runs_as_units():
    data = records([[1.0, 3.0], [2.0, 1.5]], [(1, 2, 1e-3)], cases=3)
    one, some, whole = by_name(data.units(1, 1)), by_name(data.units(1)), by_name(data.units())
    assert one["load_ratio.max.p50"].value == 1.0
    assert some["load_ratio.max.p50"].value == 2.0
    assert one["separation.probability"].count == 0
    assert some["separation.probability"].count == 1
    assert [found["separation.probability"].runs for found in (one, some, whole)] == [2, 2, 2]
    assert whole["separation.per_km"].value == pytest.approx(3 / (3 * 4 * 0.05))


def test_diverged_runs_and_samples_that_diverged_at_one_speed_do_not_count():
    data = records(np.ones((3, 2)), [(0, 1, 1e-3)], status=[1, 0, 0, 0, 0, 0], cases=2)
    assert by_name(data.units(0))["separation.probability"].count == 0
    assert by_name(data.units(1))["separation.probability"].count == 1
    assert by_name(data.units())["separation.probability"].runs == 2
    assert by_name(data.units())["separation.per_km"].count == 0


def test_the_filtered_family_is_kept_apart_and_never_clipped():
    found = by_name(records(np.ones((4, 2))).units(0))
    for name, estimate in found.items():
        assert (estimate.family == FILTERED) == ("20hz" in name), name
    assert found["force_20hz.min"].value == -1e3
    assert found["contact_force.min"].value == 5e4
    assert not any("20hz" in name for name in found if name.startswith("separation"))
    assert {estimate.family for estimate in found.values()} == {RAW, FILTERED}


def test_a_99_85_per_cent_value_is_flagged_below_1996_runs():
    few = by_name(records(np.random.default_rng(1).gumbel(3, 0.2, (100, 1))).units(0, 1))["load_ratio.max.p99.85"]
    assert few.flag == "100 runs, 1996 needed for an interval"
    assert math.isinf(few.high)
    assert few.row()["high"] is None
    many = by_name(records(np.random.default_rng(1).gumbel(3, 0.2, (2000, 1))).units(0, 1))["load_ratio.max.p99.85"]
    assert many.flag == ""
    assert math.isfinite(many.high)


def test_percentiles_of_a_section_come_from_its_bins():
    histogram = np.zeros((3, 101))
    histogram[0, 20:40] = 50  # 1000 steps evenly over Q/Q0 = 1 to 2
    histogram[1, 20], histogram[1, 100] = 1, 999
    value = section_percentiles(histogram, np.array([2.0, 7.5, 1.0]), 0.9985)
    assert value[0] == pytest.approx(1.9985)
    assert value[1] == 7.5
    assert math.isnan(value[2])


def test_exceedance_curves_are_counts_with_exact_bands():
    curve = exceedance([3.0, 1.0, 2.0, np.nan, 4.0])
    assert curve.x.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert curve.value.tolist() == [1.0, 0.75, 0.5, 0.25]
    assert (curve.low <= curve.value).all()
    assert (curve.value <= curve.high).all()
    below = exceedance([3.0, 1.0, 2.0], below=True)
    assert dict(zip(below.x, below.value, strict=True))[1.0] == pytest.approx(1 / 3)
    assert len(exceedance(np.arange(10_000.0)).x) <= 200
    assert exceedance([]).runs == 0


def test_event_curves_fall_from_all_events_to_one():
    run_of = np.array([0, 0, 3])
    curve = events_exceeding(np.array([1e-3, 2e-3, 5e-3]), run_of, np.full(4, 50.0))
    assert curve.value[0] == pytest.approx(3 / 0.2)
    assert curve.value[-1] == pytest.approx(1 / 0.2)
    edges, line = along_line(np.array([41.0, 42.0, 58.0]), run_of, 4, length=5.0)
    assert edges.tolist() == [40.0, 45.0, 50.0, 55.0, 60.0]
    assert line.value.tolist() == [0.5, 0.0, 0.0, 0.25]


def test_time_above_a_ratio_starts_at_one_and_falls():
    histogram = np.zeros((5, 101))
    histogram[:, 10], histogram[:, 30] = 75, 25
    curve = time_above(histogram, 0.05)
    assert curve.value[0] == 1.0
    assert curve.value[11] == pytest.approx(0.25)
    assert curve.x[-1] == pytest.approx(1.5)


def test_estimates_from_all_runs_are_the_last_point_of_their_convergence():
    source = np.random.default_rng(3)
    data = records(source.gumbel(2.0, 0.3, (50, 2)), [(k, 1, 1e-3) for k in range(0, 50, 3)])
    units = data.units(0)
    followed = convergence(units)
    assert [*followed] == sizes(50)
    for count in (8, 50):  # as texts: some are NaN in these records
        assert str(followed[count]) == str(by_name(units.first(count)))
    assert sizes(5) == [5]
    assert sizes(8) == [8]


def test_a_campaign_gives_its_estimates(tmp_path):
    scenario = ToyScenario()
    campaign = run(scenario, out=tmp_path, executor=ToyExecutor(scenario))
    row = campaign.statistics().to_pylist()[0]
    found = {estimate.name: estimate for estimate in campaign.estimates(0, 1)}
    for name in ("probability", "per_km"):
        columns = ("probability",) if name == "probability" else ("separations_per_km",)
        one = found[f"separation.{name}"]
        assert (one.value, one.low, one.high) == tuple(row[columns[0] + end] for end in ("", "_low", "_high"))


def test_a_wheelset_that_is_never_evaluated_has_no_estimates():
    forces = np.array([[1.5, np.nan], [1.6, np.nan], [1.7, np.nan]])
    whole = records(forces, [(0, 1, 2e-3)])
    found = by_name(whole.units(0, 2))
    assert found["separation.probability"].runs == 0
    assert math.isnan(found["separation.probability"].value)
    assert (found["separation.probability"].low, found["separation.probability"].high) == (0.0, 1.0)
    assert by_name(whole.units(0))["separation.probability"].value == pytest.approx(1 / 3)
