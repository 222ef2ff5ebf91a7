"""What an outcome goes with is found, and its intervals hold the truth as often as they say."""

import math

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import sobol_indices, spearmanr, uniform

from tbatch.campaign.estimates import Records
from tbatch.campaign.estimates.sensitivity import first_order, sensitivities


def outcomes(ratio, **varied):
    """What each outcome goes with, of runs of one wheel whose largest Q/Q0 is given."""
    runs = len(ratio)
    sample = np.arange(runs)
    wheels = {"case": np.zeros(runs, int), "sample": sample, "wheel": np.ones(runs, int), "static_load": np.ones(runs)}
    wheels |= {"separations": np.zeros(runs), "force_max": np.asarray(ratio), "force_min": np.zeros(runs)}
    table = {"case": np.zeros(runs, int), "sample": sample, "status": np.zeros(runs, int)}
    table |= {name.replace("_", "."): values for name, values in varied.items()}
    events = {"case": np.zeros(0, int), "sample": np.zeros(0, int)}
    found = sensitivities(Records(pa.table(table), pa.table(wheels), pa.table(events)).units(0))
    return {(one.varied, one.outcome): one for one in found}


def random(name):
    return np.random.Generator(np.random.Philox(key=[2020, name]))


def test_a_number_that_decides_is_told_from_one_that_does_not():
    source = random(1)
    deciding, idle = source.uniform(size=200), source.uniform(size=200)
    found = outcomes(2.0 + deciding + 0.1 * source.normal(size=200), a_b=deciding, c_d=idle)
    strong, weak = found["a.b", "ratio_max"], found["c.d", "ratio_max"]
    assert strong.low > 0.8
    assert strong.share_low > 0.8
    assert weak.low < 0.0 < weak.high
    assert weak.share_low == 0.0
    assert math.isnan(found["c.d", "separations"].correlation)
    assert found["c.d", "separations"].row()["share"] is None


def test_rank_correlation_is_scipys():
    source = random(2)
    x = source.uniform(size=60)
    y = x**3 + source.normal(size=60)
    assert outcomes(y, a_b=x)["a.b", "ratio_max"].correlation == pytest.approx(spearmanr(x, y).statistic, rel=1e-12)


def test_what_acts_by_its_deviation_has_a_share_without_a_correlation():
    source = random(3)
    x = source.uniform(-1.0, 1.0, 400)
    one = outcomes(x**2 + 0.1 * source.normal(size=400), a_b=x)["a.b", "ratio_max"]
    assert one.low < 0.0 < one.high
    assert one.share_low > 0.8


def model(x):
    """Two numbers that act, one of them together with the other, one that does not; shape (3, run)."""
    return np.exp(x[0]) + (x[1] - 0.5) ** 2 * (1.0 + 2.0 * x[0])


def test_shares_from_plain_runs_are_scipys_sobol_indices_from_a_design_for_them():
    design = sobol_indices(func=model, n=2**13, dists=[uniform()] * 3, rng=np.random.default_rng(4))
    x = random(4).uniform(size=(3, 4000))
    for number, expected in enumerate(design.first_order):
        share, low, high = first_order(x[number], model(x))
        # 4000 runs know a share to about 0.02, 8192 points of the design to 0.005.
        assert share == pytest.approx(expected, abs=0.025)
        assert low - 0.01 <= expected <= high + 0.01


CASES = {
    "line": (lambda x, z: math.sqrt(12 * 0.5) * (x - 0.5) + math.sqrt(0.5) * z, 0.5),
    "nothing": (lambda x, z: z, 0.0),
    "parabola": (lambda x, z: math.sqrt(180 * 0.4) * (x - 0.5) ** 2 + math.sqrt(0.6) * z, 0.4),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("runs", [64, 300])
def test_intervals_of_the_share_cover_the_truth(name, runs):
    source = random(runs)
    outcome, truth = CASES[name]
    covered = 0
    for _ in range(300):
        x = source.random(runs)
        _, low, high = first_order(x, outcome(x, source.normal(size=runs)))
        covered += low <= truth <= high
    # 300 scatter by 0.013; the numbers are drawn and not fixed, as the distribution supposes, which costs a per cent.
    assert covered >= 0.90 * 300


def test_whether_a_run_separates_is_an_outcome_like_others():
    """Of a probability p(x) = 0.05 + 0.3 x the share is Var p / (mean p (1 - mean p)), for 0 or 1."""
    source = random(7)
    covered = 0
    for _ in range(200):
        x = source.random(200)
        _, low, high = first_order(x, (source.random(200) < 0.05 + 0.3 * x).astype(float))
        covered += low <= (0.09 / 12) / (0.2 * 0.8) <= high
    assert covered >= 0.91 * 200
