"""A campaign with varied numbers stores them beside each run, replays them, and says what separation depends on."""

import numpy as np
import pytest

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates.sensitivity import sensitivities
from tbatch.campaign.run import run
from tbatch.scenario import Scenario


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    changes = [
        "campaign.runs=16",
        'campaign.sampling="latin-hypercube"',
        "campaign.plan=16",
        "run.distance=9 m",
        "run.evaluate_from=1 m",
        'keep.timelines="none"',
        'speed={distribution={kind="uniform", low="200 km/h", high="350 km/h"}}',
        'vary."vehicle.carbody_mass"={kind="uniform", low="30 t", high="50 t"}',
        'vary.irregularity.scale={kind="uniform", low=0.5, high=1.5}',
    ]
    return run(Scenario.load("quick", overrides=changes), out=tmp_path_factory.mktemp("varied"))


def test_the_runs_table_holds_what_each_run_was_given(campaign):
    runs = campaign.table("runs")
    for row in runs.to_pylist():
        numbers = campaign.scenario.varied(row["sample"])
        assert row["speed"] == numbers["speed"]
        assert row["vehicle.carbody_mass"] == numbers["vehicle.carbody_mass"]
        assert row["duration"] == pytest.approx(9.0 / row["speed"])
    parts = np.sort(((runs["irregularity.scale"].to_numpy() - 0.5) * 16).astype(int))
    assert parts.tolist() == list(range(16))


def test_a_heavier_carbody_loads_its_wheels_more(campaign):
    units = campaign.records.units(0, 1)
    load = campaign.table("wheels").filter(campaign.table("wheels")["wheel"].to_numpy() == 1)["static_load"]
    mass = units.inputs["vehicle.carbody_mass"]
    # A quarter of the carbody's weight rests on each wheelset.
    slope = np.polyfit(mass, load.to_numpy(), 1)[0]
    assert slope == pytest.approx(9.81 / 4, rel=1e-9)


def test_a_varied_run_is_replayed_bit_for_bit(campaign):
    opened = Campaign.open(campaign.folder)
    assert opened.differs_from_stored("c00-s000011", opened.replay("c00-s000011")) == []


def test_the_report_can_say_what_the_wheel_load_depends_on(campaign):
    found = {(one.varied, one.outcome): one for one in sensitivities(campaign.records.units(0))}
    assert {name for name, _ in found} == {"speed", "vehicle.carbody_mass", "irregularity.scale"}
    assert found["irregularity.scale", "ratio_max"].correlation > 0.3
