"""The summary of each wheel follows from the full-rate history of its contact force."""

import numpy as np
import pytest
from engine_cases import corrugation, model
from scipy.signal import butter, sosfilt, sosfilt_zi

from tbatch.engine.kernels.accumulators import BIN_WIDTH, BINS, RATIOS, LowPass
from tbatch.engine.runs import Runs, SaveAt
from tbatch.engine.simulate import simulate

STEPS = 500


@pytest.fixture(scope="module", params=["hertz", "affine"])
def case(request):
    """Nine rough runs of the bar, every force kept: three speeds, three lengths, three places to evaluate from."""
    of = model("bar", "winkler", request.param)
    runs = Runs(
        speed=np.repeat([35.0, 45.0, 55.0], 3),
        irregularity=[corrugation(0.35e-3, run) for run in range(9)],
        start=4.0 + 0.1 * np.arange(9),
        evaluate_from=np.tile([0.0, 0.4, -1.0], 3),
    )
    durations = np.tile([0.05, 0.04, 0.03], 3)
    result = simulate(of, runs, durations, save=SaveAt(of.step, ("contact_force",)), threads=1)
    assert (result.status == 0).all()
    return of, runs, durations, result


def evaluated(case, run, wheel):
    """Forces [N] of one wheel at t_1 ... t_n, and which of those step ends count."""
    of, runs, durations, result = case
    steps = round(durations[run] / of.step)
    time = np.arange(1, steps + 1) * of.step
    x = runs.start[run] + runs.speed[run] * time - of.vehicle.wheel_offsets[wheel]
    return result.contact_force[run, 1 : steps + 1, wheel], x > runs.start[run] + runs.evaluate_from[run]


def rows(case):
    """Each row of the summary with the forces of its wheel and which of them count."""
    for line in case[3].summary.to_pylist():
        yield line, *evaluated(case, line["run"], line["wheel"] - 1)


def test_rows_stand_by_run_and_wheel(case):
    of, runs, _, result = case
    assert result.summary["run"].to_pylist() == np.repeat(np.arange(len(runs)), 2).tolist()
    assert result.summary["wheel"].to_pylist() == [1, 2] * len(runs)
    assert result.summary["static_load"].to_pylist() == of.static_load.tolist() * len(runs)


def test_each_wheel_counts_from_its_own_arrival(case):
    of, runs, *_ = case
    lengths = {}
    for line, _, counts in rows(case):
        lengths[line["run"], line["wheel"]] = int(counts.sum())
        # Products of a count: one rounding each.
        assert line["evaluated_time"] == pytest.approx(counts.sum() * of.step, rel=1e-14)
        distance = counts.sum() * of.step * runs.speed[line["run"]]
        assert line["evaluated_distance"] == pytest.approx(distance, rel=1e-14)
    assert len(set(lengths.values())) > 6
    # 0.3 m behind: at 35 m/s 86 steps later; with evaluate_from a metre before the start both count from the first on.
    assert (lengths[0, 1], lengths[0, 2]) == (500, 500 - 85)
    assert (lengths[2, 1], lengths[2, 2]) == (300, 300)


def test_extrema_are_exact(case):
    for line, force, counts in rows(case):
        assert line["force_max"] == force[counts].max()
        assert line["force_min"] == force[counts].min()


def test_mean_and_deviation_are_those_of_every_evaluated_step(case):
    for line, force, counts in rows(case):
        # A sum of some hundred terms of either sign: some hundred roundings of the largest.
        assert line["force_mean"] == pytest.approx(force[counts].mean(), rel=1e-12)
        assert line["force_std"] == pytest.approx(force[counts].std(), rel=1e-12)


def test_histogram_counts_every_evaluated_step(case):
    of, *_ = case
    for line, force, counts in rows(case):
        ratio = force[counts] / of.static_load[line["wheel"] - 1]
        place = np.minimum(np.floor(ratio / BIN_WIDTH), BINS - 1).astype(int)
        assert line["histogram"] == np.bincount(place, minlength=BINS).tolist()
        assert sum(line["histogram"]) == counts.sum()
    assert any(line["histogram"][-1] for line, *_ in rows(case))


def test_unloading_times_count_the_steps_below_each_ratio(case):
    of, *_ = case
    for line, force, counts in rows(case):
        kept, load = force[counts], of.static_load[line["wheel"] - 1]
        assert line["separated_time"] == (kept == 0.0).sum() * of.step
        for ratio in RATIOS:
            assert line[f"time_below_{ratio}"] == (kept < ratio * load).sum() * of.step
        assert 0.0 <= line["separated_time"] <= line["time_below_0.1"] <= line["time_below_0.8"]
    assert any(line["separated_time"] > 0.0 for line, *_ in rows(case))


def test_20_hz_force_is_scipy_s_low_pass(case):
    of, *_ = case
    sections = butter(4, 20.0, output="sos", fs=1.0 / of.step)
    for line, force, counts in rows(case):
        load = of.static_load[line["wheel"] - 1]
        passed, _ = sosfilt(sections, force, zi=sosfilt_zi(sections) * load)
        # The filter's poles lie within 1e-2 of the unit circle: round-off grows by some 1e4.
        assert line["force_20hz_max"] == pytest.approx(passed[counts].max(), rel=1e-10)
        assert line["force_20hz_min"] == pytest.approx(passed[counts].min(), rel=1e-10)
        place = np.clip(np.floor(passed[counts] / load / BIN_WIDTH), 0, BINS - 1).astype(int)
        # A value within round-off of a bin's edge may fall on either side.
        moved = np.abs(np.bincount(place, minlength=BINS) - line["histogram_20hz"]).sum()
        assert moved <= 2
        assert sum(line["histogram_20hz"]) == counts.sum()


def test_a_step_too_long_for_20_hz_passes_the_force_as_it_is():
    rows_at_start = LowPass().start(0.03, np.array([5e4]))
    np.testing.assert_array_equal(rows_at_start[:7, 0], [1, 0, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(rows_at_start[7:14, 0], [1, 0, 0, 0, 0, 0, 0])


def test_nothing_evaluated_is_nan_and_zero():
    of = model("bar", "winkler")
    runs = Runs(speed=[50.0, 0.0], irregularity=[corrugation(0.5e-3), None], start=5.0, evaluate_from=[3.0, 0.0])
    result = simulate(of, runs, 0.02, threads=1)
    for line in result.summary.to_pylist():
        for name in ("force_max", "force_min", "force_mean", "force_std", "force_20hz_max", "force_20hz_min"):
            assert np.isnan(line[name])
        for name in ("evaluated_time", "evaluated_distance", "separated_time", "separations", "time_below_0.8"):
            assert line[name] == 0.0
        assert sum(line["histogram"]) == sum(line["histogram_20hz"]) == 0
    assert result.separations.num_rows == 0
