"""Extreme value fits find the distribution that made the maxima, and say so when none did."""

import numpy as np
import pytest
from scipy.stats import genextreme

from tbatch.campaign.estimates.extremes import block_maxima, cumulative, fit_extremes

SOURCE = np.random.Generator(np.random.Philox(key=[3, 3]))


def test_block_maxima_leave_out_an_unfinished_block():
    assert block_maxima([1.0, 5.0, 2.0, 3.0, np.nan, 9.0, 7.0], 3).tolist() == [5.0, 9.0]


@pytest.mark.parametrize("shape", [-0.2, 0.0, 0.2])
def test_the_distribution_is_scipys_with_the_other_sign_of_the_shape(shape):
    values = np.linspace(0.5, 4.0, 9)
    assert cumulative(values, (shape, 2.0, 0.5)) == pytest.approx(genextreme.cdf(values, -shape, 2.0, 0.5), rel=1e-12)


@pytest.mark.parametrize("shape", [-0.15, 0.1])
def test_a_fit_finds_the_parameters_and_the_return_value(shape):
    values = genextreme.rvs(-shape, 3.0, 0.4, size=1500, random_state=SOURCE)
    fit = fit_extremes(values)
    # Three standard errors of maximum likelihood at 1500 maxima (Prescott and Walden 1980): 0.06, 0.04, 0.03.
    assert fit.shape == pytest.approx(shape, abs=0.06)
    assert fit.location == pytest.approx(3.0, abs=0.04)
    assert fit.scale == pytest.approx(0.4, abs=0.03)
    assert fit.p_value > 0.01
    runs, value, low, high = fit.return_values[0]
    assert low <= genextreme.isf(1.0 / runs, -shape, 3.0, 0.4) <= high
    assert low <= value <= high


def test_blocks_of_several_runs_give_the_same_return_value():
    values = genextreme.rvs(0.0, 3.0, 0.4, size=2000, random_state=SOURCE)
    one, five = (fit_extremes(values, family="gumbel", runs_per_block=size) for size in (1, 5))
    assert five.blocks == 400
    assert five.return_values[1][1] == pytest.approx(one.return_values[1][1], rel=0.05)


def test_maxima_of_two_kinds_do_not_fit():
    values = np.concatenate([SOURCE.normal(1.0, 0.05, 150), SOURCE.normal(3.0, 0.05, 150)])
    fit = fit_extremes(values)
    assert fit.p_value < 0.05
    assert "does not fit" in fit.warning


def test_too_few_or_equal_maxima_are_not_fitted():
    assert fit_extremes(np.arange(19.0)) is None
    assert fit_extremes(np.ones(100)) is None
    with pytest.raises(ValueError, match="'gev' and 'gumbel'"):
        fit_extremes(np.arange(100.0), family="weibull")
