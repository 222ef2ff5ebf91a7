"""What a recording of a kept run is made from."""

import numpy as np
import pytest

from tbatch.campaign.run import run
from tbatch.scenario import Scenario
from tbatch.view.kept import MOST_MEMORY, histories_to_keep, record_of, replay_with_histories, write_kept
from tbatch.view.scene import MARGIN, OVERHANG

SHORT = ["run.distance=6 m", "run.evaluate_from=1 m", "campaign.runs=2", "speed.values=['300 km/h']"]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Two short runs of a coach on slab track."""
    return run(Scenario.load("quick", overrides=SHORT), out=tmp_path_factory.mktemp("kept"))


@pytest.fixture(scope="module")
def result(campaign):
    return replay_with_histories(campaign, ["c00-s000000", "c00-s000001"])


@pytest.mark.parametrize("index", [0, 1])
def test_a_record_holds_the_stored_run_and_its_separations(campaign, result, index):
    name = f"c00-s{index:06d}"
    record = record_of(campaign, name, result, index)
    assert campaign.differs_from_stored(name, result, index) == []
    events = [row for row in campaign.table("events").to_pylist() if row["sample"] == index]
    assert record.separations.num_rows == len(events)
    for event in events:
        during = (record.time >= event["start"] - 1e-9) & (record.time < event["end"] - 1e-9)
        assert (record.contact_force[during, event["wheel"] - 1] == 0.0).all()
    assert record.position[0] == campaign.store.resolved["run"]["start"]
    speed = 300 / 3.6
    assert record.position[-1] == pytest.approx(record.position[0] + speed * record.time[-1])
    assert record.properties["separations"] == len(events)


def test_the_line_is_the_irregularity_that_the_wheels_meet(campaign, result):
    record = record_of(campaign, "c00-s000001", result, 1)
    places, level = record.line
    # Drawn places are 20 mm apart and the shortest wave is 0.3 m: linear interpolation is off by (2 pi/0.3)^2 0.02^2/8
    # of a wave's amplitude, 2 %.
    met = np.interp(record.wheel_position, places, level)
    assert np.abs(met - record.irregularity).max() < 0.02 * np.abs(level).max()


def test_the_track_is_kept_where_the_side_view_looks_within_the_memory_allowed(campaign, result):
    record = record_of(campaign, "c00-s000000", result, 0)
    assert record.rail_at[0] <= max(0.65, record.wheel_position[0].min() - MARGIN - OVERHANG)
    assert record.rail_at[-1] >= min(campaign.scenario.model().track.length - 0.65, record.position[-1] + MARGIN)
    assert np.diff(record.rail_at) == pytest.approx(record.bay)
    assert len(record.track_time) < len(record.time) / 5
    samples = len(record.time)
    assert 8 * 3 * samples * len(histories_to_keep(campaign).rail_at) <= MOST_MEMORY


def test_the_recorder_writes_a_file_for_each_name(campaign, tmp_path):
    write_kept(campaign, ["c00-s000001"], tmp_path)
    (path,) = tmp_path.iterdir()
    assert path.name == "c00-s000001.rrd"
    assert path.stat().st_size > 10_000
