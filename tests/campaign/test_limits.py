"""A campaign is judged by its limits, speed by speed and wheelset by wheelset."""

import math
from xml.etree import ElementTree

import pytest
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.estimates import Estimate
from tbatch.campaign.limits import Verdict, judge, stored_limits, verdict
from tbatch.campaign.run import run
from tbatch.scenario import Scenario, ScenarioError
from tbatch.scenario.limits import LIMITABLE, Limit, limits_of
from tbatch.view.verdicts import github_annotations, junit_xml, step_summary, verdicts_text

PLACE = "300 km/h, wheelset 1"


def estimate(value, low, high, *, runs=100, count=1, unit="", needed=0):
    return Estimate("x", unit, value, low, high, "exact", runs, count, runs_needed=needed)


@pytest.fixture
def campaign(tmp_path):
    scenario = ToyScenario()
    return run(scenario, out=tmp_path, executor=ToyExecutor(scenario, diverging=frozenset({(0, 5)})))


@pytest.mark.parametrize(
    ("limit", "passed"),
    [
        ({"max": 0.06}, True),
        ({"max": 0.05}, True),
        ({"max": 0.04}, False),
        ({"max": 0.06, "bound": "upper"}, False),
        ({"max": 0.12, "bound": "upper"}, True),
        ({"min": 0.01, "bound": "lower"}, True),
        ({"min": 0.03, "bound": "lower"}, False),
        ({"min": 0.03, "max": 0.06}, True),
    ],
)
def test_a_limit_holds_the_estimate_or_an_end_of_its_interval(limit, passed):
    assert verdict(estimate(0.05, 0.016, 0.113), "x", Limit(**limit), PLACE).passed is passed


def test_what_these_runs_do_not_bound_fails_a_limit_on_the_bound():
    open_ended = estimate(4.0, 3.0, math.inf, needed=1996)
    found = verdict(open_ended, "x", Limit(max=5.0, bound="upper"), PLACE)
    assert not found.passed
    assert "1996 needed" in found.message
    assert verdict(open_ended, "x", Limit(max=5.0), PLACE).passed


def test_no_event_passes_and_no_evaluation_fails():
    assert verdict(estimate(math.nan, -math.inf, math.inf, count=0), "x", Limit(max=1.0), PLACE).passed
    assert not verdict(estimate(math.nan, -math.inf, math.inf, runs=0, count=0), "x", Limit(max=1.0), PLACE).passed
    assert not verdict(None, "x", Limit(max=1.0), PLACE).passed


def test_each_speed_and_wheelset_is_judged_and_the_campaign(campaign):
    verdicts = judge(campaign, stored_limits(campaign, ["limits.separation.probability.max=0.3"]))
    assert [one.limit for one in verdicts] == ["complete", "diverged", *4 * ["separation.probability"]]
    assert [one.passed for one in verdicts] == [True, False, True, True, False, False]
    assert verdicts[2].place == "180 km/h, wheelset 1"
    change = ['limits."separation.probability" = {max = 0.9, wheelset = "any"}', "limits.diverged.max=1"]
    verdicts = judge(campaign, stored_limits(campaign, change))
    assert [one.place for one in verdicts[2:]] == ["180 km/h, any wheelset", "360 km/h, any wheelset"]
    assert all(one.passed for one in verdicts)


def test_only_limits_can_be_changed_afterwards_and_all_errors_are_said(campaign):
    with pytest.raises(ScenarioError) as caught:
        stored_limits(campaign, ["run.start=3", "limits.separation.probabilty.max=1", "limits.diverged.max=1"])
    assert "only limits can be changed" in str(caught.value)
    assert 'did you mean "separation.probability"?' in str(caught.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("limits.diverged.max.x=3", "limits.diverged.max.x: cannot be set: limits.diverged.max is not a table"),
        ('limits."separation.probability"=3', "is a whole number, not a table; accepted: max, min, bound"),
        ("limits.diverged=3", "is a whole number, not a table; accepted: max"),
        ('limits."separation.probability".most=3', "most = 3: is not a known key; accepted: max, min, bound"),
    ],
)
def test_a_change_that_is_no_limit_says_what_is_one(campaign, change, said):
    campaign.store.resolved["limits"] = {"diverged": {"max": 1}}
    with pytest.raises(ScenarioError) as caught:
        stored_limits(campaign, [change])
    assert said in str(caught.value)


def test_an_incomplete_campaign_does_not_pass(campaign):
    campaign.store.resolved["campaign"]["runs"] = 120
    complete, *_ = judge(campaign, stored_limits(campaign))
    assert not complete.passed
    assert "40 missing" in complete.message


def test_every_estimate_may_have_a_limit_and_nothing_else(folder_of_quick):
    found = {one.name: one for one in folder_of_quick.estimates(0, 1)}
    assert found.keys() == LIMITABLE.keys()
    for name, (unit, has_interval) in LIMITABLE.items():
        assert found[name].unit.replace("1/km", "") == unit
        assert has_interval != found[name].method.endswith("seen"), name


@pytest.fixture(scope="module")
def folder_of_quick(tmp_path_factory):
    """A real campaign of two short runs a speed."""
    short = ["campaign.runs=2", "run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"']
    return run(Scenario.load("quick", overrides=short), out=tmp_path_factory.mktemp("quick"))


def limits(text):
    scenario = Scenario.load("quick", overrides=[f"limits={text}"])
    assert Scenario.from_tables(scenario.resolved()).resolved() == scenario.resolved()
    return limits_of(scenario.document.limits)


def test_a_limit_may_be_written_with_quotes_or_dots_and_units():
    quoted = limits(
        '{"separation.probability" = {max = 0.05, bound = "upper"}, "contact_force.max" = {max = "250 kN"}}'
    )
    dotted = limits('{separation.probability = {max = 0.05, bound = "upper"}, contact_force.max = {max = 250e3}}')
    assert quoted == dotted
    assert quoted["contact_force.max"].max == 250e3
    deep = limits("{load_ratio.max.p99.85 = {max = 3, source = 'EN 14363'}, load_ratio.max.p99.max = 2}")
    assert (deep["load_ratio.max.p99.85"].max, deep["load_ratio.max.p99"].max) == (3.0, 2.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{'separation.probabilty' = {max = 1}}", "did you mean"),
        ("{'separation.probability' = {}}", "limits nothing"),
        ("{'separation.probability' = {max = '3 kN'}}", "is a string"),
        ("{'contact_force.max' = {max = '3 km'}}", "measures length"),
        ("{'contact_force.max' = {max = 1, bound = 'upper'}}", "no interval"),
        ("{'separation.per_km' = {max = 1, bound = 'lower'}}", "needs min"),
        ("{'separation.per_km' = {max = 1, min = 2}}", "is below min"),
        ("{'separation.per_km' = 3}", "not a table"),
        ("{diverged = {max = -1}}", "out of range"),
    ],
)
def test_a_limit_that_makes_no_sense_is_refused(text, said):
    with pytest.raises(ScenarioError) as caught:
        limits(text)
    assert said in str(caught.value)
    assert str(caught.value).count("\n") == 0


VERDICTS = [
    Verdict("complete", "campaign", True, "8 runs stored, 0 missing"),
    Verdict("contact_force.max", PLACE, False, "381 kN, limit 300 kN\n100 % <sure>", "a | standard"),
]


def test_junit_xml_has_a_test_case_for_each_verdict():
    root = ElementTree.fromstring(junit_xml(VERDICTS, "öpnv & co", {"seed": "1"}))
    suite = root.find("testsuite")
    assert (suite.get("name"), suite.get("tests"), suite.get("failures")) == ("öpnv & co", "2", "1")
    assert [case.get("name") for case in suite.iter("testcase")] == ["complete", "contact_force.max"]
    (failure,) = suite.iter("failure")
    assert "100 % <sure>" in failure.get("message")
    assert "a | standard" in failure.text


def test_annotations_are_escaped_and_only_for_failures():
    (line,) = github_annotations(VERDICTS, "quick")
    title, _, message = line.removeprefix("::error title=").partition("::")
    assert title == "quick%3A contact_force.max at 300 km/h%2C wheelset 1"
    assert message == "381 kN, limit 300 kN%0A100 %25 <sure>"


def test_the_summary_is_a_table_with_the_failures_first():
    lines = step_summary(VERDICTS, "quick", "8 runs").splitlines()
    assert "1 limits exceeded" in lines[0]
    assert lines[6].startswith("| ❌")
    assert "a \\| standard" in lines[6]
    assert verdicts_text(VERDICTS).splitlines()[-1] == "2 judged, 1 failed"
