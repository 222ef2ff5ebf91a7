"""Runs that diverge are set apart: the others never notice, and each is run again to the same step."""

import json

import numpy as np
import pytest
from toy import STOPPED, ToyExecutor, ToyScenario

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.quarantine import LAST_STATES, MOST_RECORDS
from tbatch.campaign.run import run
from tbatch.campaign.summary import replay_text
from tbatch.campaign.verification import verify
from tbatch.physics.irregularity import Irregularity
from tbatch.scenario import Scenario

SHORT = ("run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"')


def short(samples):
    return Scenario.load("quick", overrides=[*SHORT, f"campaign.runs={samples}"])


def make_sick(monkeypatch, sick):
    """From 32 m on the surface of some samples leaves every scale: the force of its first rise overflows."""
    sound = Scenario.irregularity
    cliff = Irregularity.spectrum("china-trunk-line", wavelengths=(0.3, 0.5), tail=3, scale=1e220).taper(32.0, 0.1)

    def irregularity(self, sample):
        surface = sound(self, sample)
        return surface + cliff if sample in sick else surface

    monkeypatch.setattr(Scenario, "irregularity", irregularity)


def rows(campaign, kind, samples):
    return [row for row in campaign.table(kind).to_pylist() if row["sample"] in samples]


def check(tmp_path, monkeypatch, samples, sick):
    """The whole rule, with some samples sick."""
    sound = run(short(samples), out=tmp_path / "sound", threads=2)
    assert sound.diverged == 0
    assert not (tmp_path / "sound" / "quarantine").exists()
    make_sick(monkeypatch, sick)
    said = []
    campaign = run(short(samples), out=tmp_path / "sick", threads=2, message=said.append)
    status = {(row["case"], row["sample"]): row["status"] for row in campaign.table("runs").to_pylist()}
    assert status == {(case, sample): int(sample in sick) for case in range(2) for sample in range(samples)}
    others = set(range(samples)) - set(sick)
    for kind in ("runs", "wheels", "events"):
        # As text, which holds every bit of a number and takes NaN for equal.
        assert str(rows(campaign, kind, others)) == str(rows(sound, kind, others))
    records = sorted((tmp_path / "sick" / "quarantine").iterdir())
    assert len(records) == min(2 * len(sick), MOST_RECORDS)
    assert verify(tmp_path / "sick").damage == []
    assert any(f"{2 * len(sick)} runs diverged" in line for line in said)
    known = json.loads(records[0].read_text())
    assert known["seed"] == 1
    assert known["scenario"] == campaign.store.resolved
    states = known["last_states"]
    assert len(states["time"]) == min(LAST_STATES, known["step"] + 1)
    assert {"contact_force", "vehicle", "vehicle_acceleration", "irregularity"} < states.keys()
    stored = Campaign.open(tmp_path / "sick", threads=1)
    result = stored.replay(known["run"])
    assert (int(result.status[0]), int(result.steps[0])) == (1, known["step"])
    last = [np.nan if value is None else value for value in np.ravel(np.array(states["vehicle"], dtype=object))]
    again = result.vehicle[0, : known["step"] + 1][-LAST_STATES:]
    np.testing.assert_array_equal(np.array(last, float), np.where(np.isfinite(again), again, np.nan).ravel())
    text = replay_text(stored, known["run"], result)
    assert f"diverged at step {known['step']}" in text
    assert "bit for bit the stored run" in text


def test_a_sick_sample_in_ten_is_set_apart(tmp_path, monkeypatch):
    check(tmp_path, monkeypatch, 10, [7])


@pytest.mark.slow
@pytest.mark.parametrize("share", [1, 10, 100])
def test_a_percentage_of_sick_runs_is_set_apart(tmp_path, monkeypatch, share):
    check(tmp_path, monkeypatch, 100, range(0, 100, 100 // share))


def test_records_are_written_once_and_again_when_they_are_gone(tmp_path):
    scenario = ToyScenario()
    executor = ToyExecutor(scenario, diverging=frozenset({(1, 9), (0, 3)}))
    run(scenario, out=tmp_path, executor=executor)
    assert len(executor.asked) == 202
    record = tmp_path / "quarantine" / "c01-s000009.json"
    assert json.loads(record.read_text())["step"] == STOPPED
    run(scenario, out=tmp_path, executor=executor)
    assert len(executor.asked) == 202
    record.unlink()
    assert any(record.name in line for line in verify(tmp_path).damage)
    run(scenario, out=tmp_path, executor=executor)
    assert executor.asked[202:] == [(1, 9)]
    assert verify(tmp_path).damage == []
