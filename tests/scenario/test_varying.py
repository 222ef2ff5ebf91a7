"""Numbers that vary from sample to sample: what may vary, how they are distributed, what each sample depends on."""

import json

import numpy as np
import pytest
from scipy import stats

from tbatch.scenario import Scenario, ScenarioError
from tbatch.scenario.distribution import median, read_distribution, value_at
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Quantity
from tbatch.scenario.sampling import Sampling

STIFFNESS = Quantity("N/m", 1.0, 1e13)
UNIFORM = {"kind": "uniform", "low": 0.0, "high": 1.0}


def read(table, quantity=STIFFNESS):
    findings = Findings()
    found = read_distribution(table, quantity, ("vary", "x"), findings)
    return found, [str(problem) for problem in findings.problems]


@pytest.mark.parametrize(
    ("table", "same"),
    [
        ({"kind": "normal", "mean": "60 MN/m", "std": 6e6}, stats.norm(60e6, 6e6)),
        ({"kind": "uniform", "low": 2e6, "high": "4 MN/m"}, stats.uniform(2e6, 2e6)),
        ({"kind": "lognormal", "median": 1e6, "sigma": 0.3}, stats.lognorm(0.3, scale=1e6)),
        ({"kind": "triangular", "low": 1e6, "mode": 2e6, "high": 4e6}, stats.triang(1 / 3, 1e6, 3e6)),
        ({"kind": "loguniform", "low": 1e6, "high": 1e7}, stats.loguniform(1e6, 1e7)),
        ({"kind": "weibull_min", "c": 2.5, "scale": "1 MN/m", "loc": 1e5}, stats.weibull_min(2.5, 1e5, 1e6)),
        ({"kind": "gumbel_r", "loc": 1e7, "scale": 1e5}, stats.gumbel_r(1e7, 1e5)),
    ],
)
def test_distributions_are_those_of_scipy_up_to_one_in_a_million(table, same):
    found, problems = read(table)
    assert problems == []
    for share in (0.01, 0.3, 0.5, 0.99):
        # The ends take a millionth off each side.
        assert same.cdf(value_at(found, share)) == pytest.approx(share, abs=3e-6)
    assert median(found) == pytest.approx(same.ppf(0.5), rel=1e-5)
    assert read(found)[0] == found
    assert json.loads(json.dumps(found)) == found


def test_given_ends_cut_a_distribution_and_keep_its_shape():
    found, _ = read({"kind": "normal", "mean": 1e6, "std": 1e5, "low": 1e6, "high": 1.2e6})
    values = [value_at(found, share) for share in np.linspace(0, 1, 101)]
    assert (values[0], values[-1]) == (1e6, 1.2e6)
    expected = stats.truncnorm(0.0, 2.0, 1e6, 1e5).ppf(0.5)
    assert values[50] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (3.0, "is a number, not a table"),
        ({}, "kind"),
        ({"kind": "norml", "mean": 1}, "did you mean"),
        ({"kind": "binom", "n": 3, "p": 0.5}, "is not known"),
        ({"kind": "normal", "mean": 1e6}, "std: is missing"),
        ({"kind": "normal", "mean": 1e6, "std": 1e5, "width": 3}, "width"),
        ({"kind": "normal", "mean": "1 kg", "std": 1e5}, "measures mass"),
        ({"kind": "normal", "mean": 1e6, "std": -1.0}, "is no 'normal' distribution"),
        ({"kind": "normal", "mean": 1e6, "std": 1e6}, "low = -"),
        ({"kind": "uniform", "low": 2e6, "high": 1e6}, "low < high"),
        ({"kind": "normal", "mean": 1e6, "std": 1.0, "low": 2e6, "high": 3e6}, "next to nothing"),
        ({"kind": "cauchy", "loc": 1e6, "scale": 1e3}, "out of range"),
    ],
)
def test_what_is_no_distribution_or_leaves_the_accepted_range_is_refused(table, said):
    found, problems = read(table)
    assert found is None
    assert said in "\n".join(problems)


def test_a_pseudo_random_number_depends_on_seed_sample_and_key_alone():
    one = Sampling(7, distributions={"a": UNIFORM, "b": UNIFORM})
    more = Sampling(7, distributions={"c": UNIFORM, "a": UNIFORM})
    assert [one.numbers(k)["a"] for k in range(9)] == [more.numbers(k)["a"] for k in reversed(range(9))][::-1]
    assert one.numbers(3)["a"] != one.numbers(3)["b"] != Sampling(8, distributions={"b": UNIFORM}).numbers(3)["b"]


def test_each_plan_of_a_latin_hypercube_has_one_sample_in_each_part():
    sampling = Sampling(7, "latin-hypercube", 20, {"a": UNIFORM, "b": UNIFORM})
    for plan in range(3):
        for name in ("a", "b"):
            shares = [sampling.numbers(20 * plan + k)[name] for k in range(20)]
            assert sorted(int(20 * share) for share in shares) == list(range(20))
    assert len({sampling.numbers(k)["a"] for k in range(60)}) == 60


def test_sobol_points_are_one_scrambled_sequence_whichever_is_asked_first():
    distributions = {"a": UNIFORM, "b": UNIFORM}
    backwards = {k: Sampling(7, "sobol", 64, distributions).numbers(k) for k in (200, 3, 130)}
    points = [tuple(Sampling(7, "sobol", 64, distributions).numbers(k).values()) for k in range(256)]
    assert all(tuple(backwards[k].values()) == points[k] for k in backwards)
    # Every 16 x 16 box of the unit square holds one of the 256 points: a (0, 8, 2)-net, which scrambling keeps.
    assert len({(int(16 * x), int(16 * y)) for x, y in points}) == 256
    other = Sampling(8, "sobol", 64, distributions)
    assert tuple(other.numbers(0).values()) != points[0]


def test_a_mean_converges_faster_with_either_plan():
    spread = {}
    for method in ("random", "latin-hypercube", "sobol"):
        means = [
            np.mean([Sampling(seed, method, 64, {"a": UNIFORM}).numbers(k)["a"] for k in range(64)])
            for seed in range(30)
        ]
        spread[method] = np.std(means)
    assert spread["latin-hypercube"] < 0.2 * spread["random"]
    assert spread["sobol"] < 0.2 * spread["random"]


def varied(*overrides, runs=4):
    return Scenario.load("quick", overrides=[f"campaign.runs={runs}", *overrides])


PRIMARY = 'vary."vehicle.primary.stiffness"={kind="uniform", low="1 MN/m", high="2 MN/m"}'


def test_vehicle_contact_and_irregularity_vary_from_sample_to_sample_and_not_by_speed():
    scenario = varied(
        PRIMARY,
        'vary.contact.wheel_radius={kind="uniform", low=0.4, high=0.46}',
        'vary.irregularity.scale={kind="normal", mean=1, std=0.1}',
    )
    runs, _ = scenario.runs([(0, 0), (1, 0), (0, 1)])
    assert runs.vehicle[0] is runs.vehicle[1]
    assert runs.vehicle[0] is not runs.vehicle[2]
    numbers = scenario.varied(1)
    assert 1e6 <= numbers["vehicle.primary.stiffness"] <= 2e6
    assert runs.contact[2].wheel_radius == numbers["contact.wheel_radius"]
    plain = varied(runs=4).irregularity(1)(np.array([60.0]))
    assert scenario.irregularity(1)(np.array([60.0])) == pytest.approx(numbers["irregularity.scale"] * plain, rel=1e-9)
    wheel = runs.vehicle[2].stiffness[6, 6]
    assert wheel == pytest.approx(numbers["vehicle.primary.stiffness"], rel=1e-12)


def test_a_varied_scenario_resolves_and_reads_back():
    scenario = varied(PRIMARY, 'campaign.sampling="latin-hypercube"')
    resolved = json.loads(json.dumps(scenario.resolved()))
    assert resolved["campaign"]["plan"] == 64
    assert resolved["vary"]["vehicle.primary.stiffness"]["high"] == 2e6
    again = Scenario.from_tables(resolved)
    assert again.hash == scenario.hash
    assert again.varied(2) == scenario.varied(2)
    assert any("not whole plans of 64" in warning for warning in scenario.warnings)
    assert not varied(PRIMARY, 'campaign.sampling="sobol"', runs=8).warnings


def test_a_speed_may_be_distributed():
    scenario = varied('speed={distribution={kind="normal", mean="300 km/h", std="10 km/h"}}')
    assert scenario.speeds == pytest.approx((300 / 3.6,))
    runs, duration = scenario.runs([(0, 0), (0, 1)])
    assert runs.speed[0] != runs.speed[1]
    assert runs.speed * duration == pytest.approx(runs.speed[0] * duration[0])
    assert Scenario.from_tables(scenario.resolved()).hash == scenario.hash


def test_a_defect_s_number_may_vary():
    flat = 'irregularity.defect=[{kind="flat", at=50, depth=1e-3, length=0.15}]'
    scenario = varied(flat, 'vary."irregularity.defect[0].depth"={kind="uniform", low=1e-3, high=2e-3}')
    assert 1e-3 <= scenario.varied(0)["irregularity.defect[0].depth"] <= 2e-3
    assert scenario.irregularity(0)(np.array([50.07])) != scenario.irregularity(1)(np.array([50.07]))


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ('vary."track.fastener.stiffness"={kind="uniform", low=1, high=2}', "factorised once"),
        ('vary."vehicle.primary.stifness"={kind="uniform", low=1, high=2}', "is no number of this scenario"),
        ('vary."vehicle.model"={kind="uniform", low=1, high=2}', "is no number of this scenario"),
        ('vary."vehicle.count"={kind="uniform", low=1, high=2}', "is no number of this scenario"),
        ('vary."vehicle.axle_half_distance"={kind="uniform", low=1, high=2}', "cannot vary"),
        ('vary."irregularity.wavelengths[0]"={kind="uniform", low=1, high=2}', "cannot vary"),
        ('vary."irregularity.defect[3].depth"={kind="uniform", low=1, high=2}', "is no number of this scenario"),
        ('vary."contact.stiffness"={kind="uniform", low=1e9, high=2e9}', "is no number of this scenario"),
        ('vary."vehicle.primary.stiffness"=3', "not a table"),
        ('vary."x"={kind="uniform", low=1, high=2}', "is no number of this scenario"),
        ("vary=3", "not a table"),
        ('speed.distribution={kind="uniform", low=60, high=80}', "beside a distribution"),
        ('speed={distribution={kind="uniform", low=60, high=800}}', "out of range"),
        ("speed={}", "is missing"),
        ('campaign.sampling="sobol"', "nothing varies"),
        ('campaign.sampling="grid"', "is not known"),
    ],
)
def test_what_cannot_vary_is_refused_with_its_key(override, said):
    with pytest.raises(ScenarioError) as caught:
        varied(override)
    assert said in str(caught.value)
    assert override.partition("=")[0].replace('"', "").split(".")[0] in str(caught.value)


def test_a_plan_belongs_to_a_latin_hypercube():
    with pytest.raises(ScenarioError, match="no effect with 'sobol'"):
        varied(PRIMARY, 'campaign.sampling="sobol"', "campaign.plan=8")
