"""A dry run says what is missing, and with a rule to stop the least and the most of it."""

import pytest

from tbatch.campaign.forecast import forecast, forecast_text
from tbatch.campaign.part import Part
from tbatch.campaign.run import run
from tbatch.scenario import Scenario

SHORT = ("run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"')


def short(*changes):
    return Scenario.load("quick", overrides=[*SHORT, *changes])


@pytest.fixture(scope="module")
def stopping():
    """At most 200 runs a speed, at least 8."""
    return short("campaign.runs=8", "campaign.stop={min_events=100000, max_runs=200}")


def test_a_rule_to_stop_gives_a_range_from_its_next_look_to_its_maximum(stopping, tmp_path):
    found = forecast(stopping, tmp_path / "none", threads=2)
    assert (found.runs, found.most.runs) == (2 * 64, 2 * 200)  # the first look is at a whole shard
    assert found.most.run_steps == pytest.approx(found.run_steps * 400 / 128)
    assert found.most.disk == pytest.approx(found.disk * 400 / 128)
    assert found.seconds < found.most.seconds
    text = forecast_text(found, tmp_path / "none")
    assert "128 to 400 runs to do, by campaign.stop" in text
    assert not (tmp_path / "none").exists()


def test_what_is_stored_is_not_counted_again_and_parts_end_at_the_first_look(stopping, tmp_path):
    run(stopping, out=tmp_path, threads=2, part=Part(0, 2))
    whole = forecast(stopping, tmp_path, threads=2)
    assert (whole.runs, whole.most.runs) == (64 + 64, 400 - 64)  # one speed's first look, the other's second
    part = forecast(stopping, tmp_path, threads=2, part=Part(1, 2))
    assert (part.runs, part.most) == (64, None)


def test_the_rate_of_runs_shorter_than_the_trial_is_that_of_the_kernels(tmp_path):
    found = forecast(short("campaign.runs=64", "run.distance=1.2 m"), tmp_path / "none", threads=2)
    # A difference of two equally short trials would give anything; no machine steps this model so fast.
    assert 1e3 < found.run_steps_per_second < 1e9
    assert found.most is None
