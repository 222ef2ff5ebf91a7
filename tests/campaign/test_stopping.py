"""A rule to stop is asked at fixed numbers of runs, so that what a campaign holds depends on nothing else."""

from dataclasses import dataclass, field
from typing import Any

import pytest
from toy import ToyExecutor, ToyScenario, contents

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates.intervals import exact_interval
from tbatch.campaign.part import Part
from tbatch.campaign.run import run
from tbatch.campaign.shards import SHARD_SAMPLES, Shard
from tbatch.campaign.stopping import StopRule, Tally
from tbatch.campaign.summary import status_text, summary_text
from tbatch.scenario import Scenario, ScenarioError


@dataclass
class Stopping(ToyScenario):
    """A toy with a rule to stop."""

    samples: int = 10
    stop: dict[str, Any] = field(default_factory=lambda: {"min_events": 0, "rel_ci": 0.1, "max_runs": 1000})

    def resolved(self) -> dict[str, Any]:
        """With the rule."""
        tables = super().resolved()
        tables["campaign"]["stop"] = self.stop
        return tables


def campaign_of(folder, scenario=None, **options):
    scenario = scenario or Stopping()
    executor = options.pop("executor", None) or ToyExecutor(scenario, **options)
    return run(scenario, out=folder, executor=executor)


def rule(**changes):
    return StopRule(**{"minimum": 100, "maximum": 5000, "min_events": 0, "rel_ci": 0.1, **changes})


def test_looks_are_multiples_of_the_shard_size_from_the_minimum_to_the_maximum():
    looks = list(rule().looks())
    assert looks[:4] == [128, 192, 256, 320]
    assert looks[-1] == 5000
    assert all(look % SHARD_SAMPLES == 0 for look in looks[:-1])
    assert looks == sorted(set(looks))
    assert list(rule(minimum=128, maximum=128).looks()) == [128]
    assert list(rule(minimum=90, maximum=100).looks()) == [100]


def test_enough_is_both_events_and_a_narrow_interval():
    tally = Tally(runs=1000, separated=500, events=900)
    low, high = exact_interval(500, 1000)
    assert rule(rel_ci=(high - low) / 2 / 0.5 + 1e-12).satisfied(tally)
    assert not rule(rel_ci=(high - low) / 2 / 0.5 - 1e-12).satisfied(tally)
    assert rule(min_events=900).satisfied(tally)
    assert not rule(min_events=901).satisfied(tally)
    assert not rule(rel_ci=10.0).satisfied(Tally(runs=1000))


def test_each_speed_stops_at_the_first_look_at_which_it_has_enough(tmp_path):
    campaign = campaign_of(tmp_path)
    whole = run(ToyScenario(samples=1000), out=tmp_path / "whole", executor=ToyExecutor(ToyScenario(samples=1000)))
    wheels = whole.table("wheels").to_pylist()
    for case, planned in enumerate(campaign.planned):
        separated = {row["sample"] for row in wheels if row["case"] == case and row["separations"] > 0}
        counts = {look: sum(sample < look for sample in separated) for look in rule(minimum=10, maximum=1000).looks()}
        enough = [look for look, count in counts.items() if rule().satisfied(Tally(look, count, count))]
        assert planned == enough[0]
    assert campaign.planned[0] > campaign.planned[1]
    assert campaign.runs_stored == campaign.runs_total == sum(campaign.planned)
    assert campaign.missing() == []


def test_batches_interruptions_and_other_speeds_do_not_matter(tmp_path):
    expected = contents(campaign_of(tmp_path / "plain"))
    assert contents(campaign_of(tmp_path / "small", limit=1)) == expected
    assert contents(campaign_of(tmp_path / "large", limit=10_000)) == expected

    class Stop(Exception):
        pass

    scenario, asked = Stopping(), 0

    class Interrupted(ToyExecutor):
        def simulate(self, pairs, **options):
            nonlocal asked
            asked += 1
            if asked % 2 == 0:
                raise Stop
            return super().simulate(pairs, **options)

    for _ in range(50):
        try:
            stopped = campaign_of(tmp_path / "stopped", scenario, executor=Interrupted(scenario, limit=64))
            break
        except Stop:
            continue
    assert contents(stopped) == expected


def test_nothing_is_simulated_again_and_the_maximum_holds(tmp_path):
    campaign_of(tmp_path)
    executor = ToyExecutor(Stopping())
    campaign_of(tmp_path, executor=executor)
    assert executor.asked == []
    never = Stopping(stop={"min_events": 10**6, "rel_ci": 0.1, "max_runs": 150})
    assert campaign_of(tmp_path / "never", never).planned == (150, 150)


def test_a_larger_minimum_extends_to_what_it_would_have_been_at_once(tmp_path):
    campaign_of(tmp_path / "twice")
    more = Stopping(samples=500)
    assert contents(campaign_of(tmp_path / "twice", more)) == contents(campaign_of(tmp_path / "once", more))


def test_diverged_runs_do_not_count(tmp_path):
    scenario = Stopping()
    whole = frozenset((0, sample) for sample in range(64))
    campaign = campaign_of(tmp_path, scenario, diverging=whole)
    assert campaign.planned[0] > campaign_of(tmp_path / "sound").planned[0]


def test_parts_run_up_to_the_first_look_and_one_process_finishes(tmp_path):
    expected = contents(campaign_of(tmp_path / "plain"))
    scenario = Stopping()
    for index in range(2):
        run(scenario, out=tmp_path / "parts", executor=ToyExecutor(scenario), part=Part(index, 2))
    assert contents(campaign_of(tmp_path / "parts", scenario)) == expected


def test_status_and_summary_say_what_a_rule_made(tmp_path):
    campaign = campaign_of(tmp_path)
    assert "complete" in status_text(campaign, [])
    assert "campaign.stop" in summary_text(campaign)
    assert campaign.pair(f"c00-s{campaign.planned[0] - 1:06d}")
    with pytest.raises(ValueError, match="this campaign has runs"):
        campaign.pair(f"c01-s{campaign.planned[1]:06d}")
    assert Campaign.open(tmp_path).planned == campaign.planned


def test_a_gap_is_filled_before_the_next_look():
    shards = [Shard(0, 64, 0), Shard(128, 192, 0)]
    assert rule(minimum=10).planned(shards, lambda shard: Tally(64, 0, 0)) == 128


def test_the_scenario_s_rule_has_defaults_and_limits():
    scenario = Scenario.load("quick", overrides=["campaign.stop.min_events=20"])
    assert scenario.resolved()["campaign"]["stop"] == {"min_events": 20, "rel_ci": 0.1, "max_runs": 100_000}
    assert "stop" not in Scenario.load("quick").resolved()["campaign"]
    with pytest.raises(ScenarioError, match=r"campaign\.stop\.max_runs = 3: is too few"):
        Scenario.load("quick", overrides=["campaign.stop.max_runs=3"])
    with pytest.raises(ScenarioError, match=r"campaign\.stop"):
        Scenario.load("quick", overrides=["campaign.stop=3"])
