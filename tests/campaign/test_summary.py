"""What is printed at the end of a campaign."""

import json
import math

import pyarrow as pa
import pytest
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.run import run
from tbatch.campaign.statistics import STATISTICS_SCHEMA
from tbatch.campaign.summary import columns, replay_text, status_text, summary_document, summary_text
from tbatch.scenario import Scenario


@pytest.fixture
def campaign(tmp_path):
    scenario = ToyScenario()
    return run(scenario, out=tmp_path, executor=ToyExecutor(scenario, diverging=frozenset({(0, 5)})))


def test_there_is_a_line_for_each_speed_and_wheelset_and_one_for_any(campaign):
    lines = summary_text(campaign).splitlines()
    table = [line.split()[:3] for line in lines[2 : lines.index("", 6)]]
    assert table == [
        *[["180", wheel, "99"] for wheel in ("1", "2", "any")],
        [],
        *[["360", wheel, "100"] for wheel in ("1", "2", "any")],
    ]
    text = "\n".join(lines)
    assert "diverged: 1 (left out of the statistics)" in text
    assert "45 m evaluated" in text
    assert "Step 1 ms; contact hertz; whole model (two rails)." in text
    assert "paired" in text


def test_no_and_only_separated_runs_are_printed_with_one_sided_looking_intervals(campaign, monkeypatch):
    row = dict.fromkeys(STATISTICS_SCHEMA.names, 0)
    none = {**row, "wheel": 1, "runs": 100, "probability_high": 0.0362, "force_max": math.nan, "probability": 0.0}
    full = {**row, "wheel": 2, "runs": 100, "separated_runs": 100, "probability": 1.0, "probability_low": 0.9638}
    full |= {"probability_high": 1.0, "longest": 2.5e-3, "force_max": 250e3}
    table = pa.Table.from_pylist([none, full, row], schema=STATISTICS_SCHEMA)
    monkeypatch.setattr(campaign, "statistics_of", lambda wheels: table)
    lines = summary_text(campaign).splitlines()
    assert lines[2].split() == "0 1 100 0 0.000 0.000 to 0.036 0 0 to 0 - -".split()
    assert lines[3].split() == "0 2 100 100 1.000 0.964 to 1.000 0 0 to 0 2.50 250.0".split()


def test_the_document_is_json_with_null_where_there_is_no_number(campaign, monkeypatch):
    row = {**dict.fromkeys(STATISTICS_SCHEMA.names, 0), "wheel": 1, "probability": math.nan}
    table = pa.Table.from_pylist([row], schema=STATISTICS_SCHEMA)
    monkeypatch.setattr(campaign, "statistics_of", lambda wheels: table)
    document = json.loads(json.dumps(summary_document(campaign), allow_nan=False))
    assert document["wheelsets"][0]["probability"] is None
    assert document["campaign"]["runs"] == 200


def test_an_incomplete_campaign_says_how_to_go_on(campaign):
    campaign.store.resolved["campaign"]["runs"] = 120
    assert f"Not complete: tbatch resume {campaign.folder}" in summary_text(campaign)
    text = status_text(campaign, ["runs/x.parquet: missing"])
    assert "200 of 240 runs stored, 40 missing" in text
    assert "damaged: runs/x.parquet: missing" in text


def test_a_replayed_run_is_compared_bit_by_bit_with_the_stored_one(campaign):
    result = campaign.executor.simulate([campaign.pair("c01-s000003")])
    result.status, result.steps = [0], [1000]
    assert "bit for bit the stored run" in replay_text(campaign, "c01-s000003", result)
    forces = result.summary["force_max"].to_numpy().copy()
    forces[0] = math.nextafter(forces[0], math.inf)
    at = result.summary.column_names.index("force_max")
    result.summary = result.summary.set_column(at, "force_max", pa.array(forces))
    assert "differing: wheels.force_max" in replay_text(campaign, "c01-s000003", result)


def test_columns_line_up():
    assert columns(["a", "bb"], ["", ""], [["1", "2"], [], ["333", "4"]]) == ["  a  bb", "  1   2", "", "333   4"]


def test_a_scenario_and_its_folder_agree_on_the_identity_of_a_campaign():
    from tbatch.campaign.identity import changed_keys, identity

    scenario = Scenario.load("quick")
    resolved = json.loads(json.dumps(scenario.resolved()))
    assert identity(resolved) == scenario.hash
    assert changed_keys(resolved, Scenario.from_tables(resolved).resolved()) == []
    same = ["campaign.runs=9", 'keep.timelines="none"', 'limits."contact_force.max".max="250 kN"']
    assert identity(Scenario.load("quick", overrides=same).resolved()) == scenario.hash
