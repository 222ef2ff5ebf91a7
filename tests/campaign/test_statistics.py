"""Statistics of tables whose answers are known."""

import math

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import beta, binom

from tbatch.campaign.statistics import exact_interval, separation_statistics


def tables(separations, *, status=None, longest=None, distance=40.0):
    """Runs and wheels tables of one case from separations (run, wheel)."""
    separations = np.asarray(separations)
    runs, wheels = separations.shape
    sample = np.repeat(np.arange(runs), wheels)
    count = separations.ravel()
    column = np.full(count.shape, 1.0)
    run_table = pa.table(
        {
            "case": np.zeros(runs, int),
            "sample": np.arange(runs),
            "status": np.zeros(runs, int) if status is None else np.asarray(status),
            "evaluated_length": np.full(runs, distance),
        }
    )
    wheel_table = pa.table(
        {
            "case": np.zeros(len(count), int),
            "sample": sample,
            "wheel": np.tile(np.arange(1, wheels + 1), runs),
            "evaluated_distance": distance * column,
            "evaluated_time": column,
            "separations": count,
            "censored": np.zeros(len(count), int),
            "separated_time": 2e-3 * count,
            "longest": 2e-3 * count if longest is None else np.asarray(longest).ravel(),
            "largest_gap": 1e-4 * count,
            "largest_landing_force": 1e5 * count,
            "force_max": 1e5 + count,
            "force_min": 5e4 - count,
        }
    )
    return run_table, wheel_table


def rows_of(runs, wheels, speeds, *, any_wheelset=False):
    """The statistics as plain rows."""

    def tables_of(case):
        return tuple(table.filter(pa.array(table["case"].to_numpy() == case)) for table in (runs, wheels))

    numbers = [0] if any_wheelset else sorted(set(wheels["wheel"].to_pylist()))
    return separation_statistics(tables_of, speeds, numbers).to_pylist()


def test_counts_rates_and_extremes_of_a_table_worked_by_hand():
    runs, wheels = tables([[0, 3], [1, 0], [0, 2], [0, 0]])
    first, second = rows_of(runs, wheels, [50.0])
    assert (first["wheel"], second["wheel"]) == (1, 2)
    assert (first["runs"], first["separated_runs"], first["probability"]) == (4, 1, 0.25)
    assert (second["separated_runs"], second["separations"]) == (2, 5)
    assert second["separations_per_km"] == pytest.approx(5 / 0.160)
    assert second["longest"] == 6e-3
    assert second["separated_share"] == pytest.approx(10e-3 / 4.0)
    assert second["force_max"] == 1e5 + 3
    assert second["force_min"] == 5e4 - 3
    assert second["speed"] == 50.0


def test_any_wheelset_counts_a_run_once_and_kilometres_of_all_wheelsets():
    runs, wheels = tables([[2, 3], [1, 0], [0, 0], [0, 0]])
    (row,) = rows_of(runs, wheels, [50.0], any_wheelset=True)
    assert (row["wheel"], row["runs"], row["separated_runs"], row["separations"]) == (0, 4, 2, 6)
    assert row["separations_per_km"] == pytest.approx(6 / (8 * 0.040))


def test_diverged_runs_are_left_out_of_everything_and_counted():
    runs, wheels = tables([[9, 9], [1, 0], [0, 0]], status=[1, 0, 0])
    first = rows_of(runs, wheels, [50.0])[0]
    assert (first["runs"], first["diverged"], first["separated_runs"], first["separations"]) == (2, 1, 1, 1)
    assert first["force_max"] == 1e5 + 1
    assert first["evaluated_distance"] == 80.0


def test_a_wheelset_that_is_never_evaluated_has_not_shown_that_it_keeps_contact():
    runs, wheels = tables([[1, 0], [0, 0], [0, 0]])
    for name in ("evaluated_time", "evaluated_distance"):
        column = np.where(wheels["wheel"].to_numpy() == 2, 0.0, wheels[name].to_numpy())
        wheels = wheels.set_column(wheels.column_names.index(name), name, pa.array(column))
    first, second = rows_of(runs, wheels, [50.0])
    assert (first["runs"], second["runs"]) == (3, 0)
    assert math.isnan(second["probability"])
    assert (second["probability_low"], second["probability_high"]) == (0.0, 1.0)
    (any_wheelset,) = rows_of(runs, wheels, [50.0], any_wheelset=True)
    assert (any_wheelset["runs"], any_wheelset["separated_runs"]) == (3, 1)


def test_a_case_without_runs_says_so_instead_of_failing():
    runs, wheels = tables([[0, 1]])
    rows = rows_of(runs, wheels, [50.0, 60.0])
    assert [row["case"] for row in rows] == [0, 0, 1, 1]
    assert rows[2]["runs"] == 0
    assert math.isnan(rows[2]["probability"])
    assert (rows[2]["probability_low"], rows[2]["probability_high"]) == (0.0, 1.0)


def test_a_wheel_that_met_nothing_evaluated_does_not_spoil_the_extremes():
    runs, wheels = tables([[1], [1]])
    forces = wheels["force_max"].to_numpy().copy()
    forces[0] = np.nan
    wheels = wheels.set_column(wheels.column_names.index("force_max"), "force_max", pa.array(forces))
    assert rows_of(runs, wheels, [1.0])[0]["force_max"] == forces[1]


@pytest.mark.parametrize(("successes", "trials"), [(0, 100), (3, 100), (50, 100), (99, 100), (100, 100)])
def test_the_interval_is_the_beta_quantile_form_of_clopper_and_pearson(successes, trials):
    low, high = exact_interval(successes, trials)
    assert low == pytest.approx(beta.ppf(0.025, successes, trials - successes + 1) if successes else 0.0, rel=1e-9)
    assert high == pytest.approx(
        beta.ppf(0.975, successes + 1, trials - successes) if successes < trials else 1.0, rel=1e-9
    )


@pytest.mark.parametrize("probability", [1e-3, 0.02, 0.3])
def test_the_interval_covers_the_true_probability_at_least_as_often_as_it_says(probability):
    trials = 200
    outcomes = np.arange(trials + 1)
    covered = [low <= probability <= high for low, high in (exact_interval(int(k), trials) for k in outcomes)]
    assert binom.pmf(outcomes, trials, probability)[covered].sum() >= 0.95
