"""The stated intervals hold the truth as often as they say, on toys whose truth is known."""

import math

import numpy as np
import pytest
from scipy.stats import binom

from tbatch.campaign.estimates.intervals import (
    exact_interval,
    order_statistics,
    percentile_interval,
    quantile,
    rate_interval,
    resampled_quantiles,
    runs_needed,
)


def random(name: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(key=[2019, name]))


@pytest.mark.parametrize(
    ("share", "confidence", "runs"),
    [(0.9985, 0.95, 1996), (0.9985, 0.99, 3068), (0.0015, 0.95, 1996), (0.95, 0.95, 59)],
)
def test_wilks_number_of_runs(share, confidence, runs):
    """The largest of n runs exceeds the quantile q with probability 1 - q^n."""
    needed = runs_needed(share, confidence)
    assert needed == runs
    rare = max(share, 1 - share)
    assert 1 - rare**needed >= confidence > 1 - rare ** (needed - 1)


@pytest.mark.parametrize("count", [5, 59, 60, 100, 300, 1995, 1996, 2457, 2458, 10_000])
@pytest.mark.parametrize("share", [0.0015, 0.05, 0.5, 0.95, 0.9985])
def test_order_statistics_cover_a_quantile_exactly_as_often_as_they_say(count, share):
    """P(value[low] <= quantile <= value[high]) = P(low < X <= high) for X, the values at or below it, binomial."""
    low, high = order_statistics(count, share)
    missed = (0.0 if low is None else binom.cdf(low, count, share)) + (
        0.0 if high is None else binom.sf(high, count, share)
    )
    assert missed <= 0.05 + 1e-12
    if share == 0.9985:
        assert (high is not None) == (count >= 1996)
    if low is not None and high is not None and count != 1996:
        # One value further in on either side would break the promise: the interval is not needlessly wide.
        assert binom.cdf(low + 1, count, share) > 0.025 - 1e-3 or binom.sf(high - 1, count, share) > 0.025


def test_ten_thousand_runs_bound_the_99_85_per_cent_value_by_their_9977th_to_9993rd():
    low, high = order_statistics(10_000, 0.9985)
    assert (low + 1, high + 1) == (9977, 9993)


@pytest.mark.parametrize(("share", "runs"), [(0.5, 20), (0.95, 100), (0.95, 60)])
def test_quantile_intervals_cover_the_true_quantile(share, runs):
    source = random(runs)
    covered = 0
    for _ in range(1000):
        _, low, high = quantile(source.gumbel(size=runs), share)
        covered += low <= -math.log(-math.log(share)) <= high
    # 1000 campaigns scatter by 0.007 about 0.95; the interval itself is conservative.
    assert covered >= 940


def test_a_quantile_without_enough_runs_has_an_open_end():
    value, low, high = quantile(np.arange(100.0), 0.9985)
    assert value == 99.0
    assert low > 90.0
    assert high == math.inf
    assert all(map(math.isnan, quantile([], 0.5)[:1]))
    assert quantile([1.0, math.nan, 3.0], 0.5)[0] == 1.0


def clustered(source, runs, busy):
    """Runs that separate with a probability, and then several times: the run is the unit, not the event."""
    return np.where(source.random(runs) < busy, source.geometric(0.4, runs), 0).astype(float)


@pytest.mark.parametrize(("busy", "runs"), [(0.01, 100), (0.05, 100), (0.3, 100), (0.9, 100), (0.02, 1000)])
def test_rate_intervals_cover_the_true_rate_where_events_come_in_clusters(busy, runs):
    source = random(int(1e3 * busy) + runs)
    distance = np.full(runs, 0.04)
    true = busy / 0.4 / 0.04
    covered = sum(
        low <= true <= high
        for low, high in (rate_interval(clustered(source, runs, busy), distance, 1.0) for _ in range(400))
    )
    # 400 campaigns scatter by 0.011; a percentile bootstrap of a skewed mean covers a per cent or two less than 0.95.
    assert covered >= 0.92 * 400


def test_a_rate_from_runs_without_an_event_is_bounded_by_the_exact_interval():
    low, high = rate_interval(np.zeros(1000), np.full(1000, 0.04), 1.0)
    assert low == 0.0
    assert high == pytest.approx(exact_interval(0, 1000)[1] / 0.04)
    assert exact_interval(0, 1000)[1] == pytest.approx(0.0037, abs=5e-5)


def test_runs_resampled_together_beyond_the_bound_give_the_same_spread():
    counts = clustered(random(9), 20_000, 0.3)
    low, high = rate_interval(counts, np.ones(20_000), 1.0)
    # A normal approximation is exact enough here; a bootstrap of 1000 resamples knows the width to some per cent.
    assert high - low == pytest.approx(2 * 1.96 * counts.std() / math.sqrt(20_000), rel=0.08)


def test_event_quantiles_treat_the_run_as_the_unit():
    """All events of a run are equal: the interval is that of the runs, wider by the root of the cluster's size."""
    source = random(4)
    covered = 0
    for _ in range(300):
        of_run = source.exponential(size=100)
        run = np.repeat(np.arange(100), 5)
        low, high = percentile_interval(resampled_quantiles(of_run[run], run, 100, 0.5))
        covered += low <= math.log(2.0) <= high
    assert covered >= 0.92 * 300  # scatter 0.013 about 0.95


@pytest.mark.slow
@pytest.mark.parametrize("probability", [1e-3, 1e-2, 0.1])
def test_a_thousand_campaigns_of_a_known_probability(probability):
    source = random(int(1e4 * probability))
    separated = source.binomial(1000, probability, 1000)
    covered = sum(low <= probability <= high for low, high in (exact_interval(int(k), 1000) for k in separated))
    assert covered >= 940
    rare = [quantile(source.gumbel(size=2500), 0.9985) for _ in range(1000)]
    assert sum(low <= -math.log(-math.log(0.9985)) <= high for _, low, high in rare) >= 940
