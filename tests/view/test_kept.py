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


TWO_SPEEDS = [*SHORT[:2], "campaign.runs=1", "speed.values=['200 km/h', '350 km/h']"]


def test_a_run_simulated_beside_a_longer_one_is_shown_as_if_alone(tmp_path):
    both = run(Scenario.load("quick", overrides=TWO_SPEEDS), out=tmp_path)
    names = ["c00-s000000", "c01-s000000"]
    beside = record_of(both, names[1], replay_with_histories(both, names), 1)
    alone = record_of(both, names[1], replay_with_histories(both, names[1:]))
    for field in ("time", "position", "contact_force", "vehicle", "irregularity", "track_time", "rail", "slab", "line"):
        np.testing.assert_array_equal(getattr(beside, field), getattr(alone, field), err_msg=field)
    # The last picture of the track is one of the run, not one half way to what is not known.
    assert beside.track_time[-1] == beside.time[-1]
    assert np.isfinite(beside.rail).all()


def test_a_measured_level_that_ends_with_the_slower_run_is_no_reason_to_stop(tmp_path):
    # 3 m beyond the wheels on either side; the faster run is 5 m further when the slower one ends.
    places = np.arange(3.0, 40.0, 0.1)
    np.savetxt(tmp_path / "level.csv", np.column_stack((places, np.sin(places))))
    text = """
        [vehicle]
        model = "seed-multiwheel"
        [track]
        model = "seed-slab"
        length = "80 m"
        [contact]
        law = "hertz"
        [irregularity]
        measured = { file = "level.csv", unit = "mm", window = 30.0 }
        [speed]
        values = ["200 km/h", "350 km/h"]
        [run]
        start = "30 m"
        distance = "6 m"
        evaluate_from = "1 m"
    """
    (tmp_path / "measured.toml").write_text(text)
    campaign = run(Scenario.load(tmp_path / "measured.toml"), out=tmp_path / "out")
    names = ["c00-s000000", "c01-s000000"]
    result = replay_with_histories(campaign, names)
    for index, name in enumerate(names):
        record = record_of(campaign, name, result, index)
        met = np.interp(record.wheel_position, *record.line)
        assert np.abs(met - record.irregularity).max() < 0.02 * np.abs(record.irregularity).max()


def test_the_rail_is_rough_ahead_of_the_wheels_to_the_end_of_the_picture(campaign, result):
    record = record_of(campaign, "c00-s000000", result, 0)
    places, level = record.line
    assert places[-1] == pytest.approx(record.position[-1] + MARGIN + OVERHANG)
    ahead = level[places > record.position[-1]]
    assert np.ptp(ahead) > 1e-4


def test_what_varies_is_shown_with_the_runs_own_numbers(tmp_path):
    vary = [
        "vary.'vehicle.carbody_mass'={kind='uniform', low=20000.0, high=60000.0}",
        "vary.'contact.wheel_radius'={kind='uniform', low=0.35, high=0.5}",
        "vary.'irregularity.scale'={kind='uniform', low=0.2, high=0.4}",
        "contact.wheel_radius=0.46",
        "irregularity.scale=0.3",
    ]
    campaign = run(Scenario.load("quick", overrides=[*SHORT, *vary]), out=tmp_path)
    for name, sample in (("c00-s000000", 0), ("c00-s000001", 1)):
        own = campaign.scenario.varied(sample)
        record = record_of(campaign, name, replay_with_histories(campaign, [name]))
        # The taper begins where wheel 1 stands: all wheels rest with their own static loads.
        np.testing.assert_allclose(record.force_ratio[0], 1.0, rtol=1e-9)
        load = record.static_load[0]
        assert load == pytest.approx((own["vehicle.carbody_mass"] + 2 * 3000 + 4 * 2000) * 9.81 / 4, rel=1e-9)
        constant = 2 * 3.86e-8**-1.5 * own["contact.wheel_radius"] ** (1.5 * 0.115)  # worn profile, both rails
        assert record.lift_off[0] == pytest.approx((load / constant) ** (2 / 3), rel=1e-3)
        assert f"carbody z {own['vehicle.carbody_mass']:.6g}"[:14] in record.parameters["vehicle masses"]
        assert record.parameters["irregularity.scale"].startswith(f"{own['irregularity.scale']:.6g} ")


def test_on_an_endless_track_rail_and_slab_are_known_under_the_wheels(tmp_path):
    endless = [*SHORT, "track.length=endless", "campaign.runs=1", 'keep.timelines="none"', "run.distance=2 m"]
    short = run(Scenario.load("quick", overrides=endless), out=tmp_path)
    record = record_of(short, "c00-s000000", replay_with_histories(short, ["c00-s000000"]))
    assert record.rail_at is None
    ratio = record.slab_under_wheel[0] / record.rail_under_wheel[0]
    assert ((ratio > 0.4) & (ratio < 0.9)).all()  # at rest a wheelset sinks 0.88 mm with the rail, 0.41 with the slab
