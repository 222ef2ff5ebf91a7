import re
import subprocess
import sys
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from synthetic_run import synthetic_record

from tbatch.view.record import RunRecord
from tbatch.view.timeline import write_recording
from tbatch.view.timeline.contact import SHORTEST
from tbatch.view.viewer import find_binary

GRAIN = 2.0**-12  # stated rounding of plotted values
TOLERANCE = 2.0**-11  # stated: what a line misses, as a share of a plot's range


@pytest.fixture(scope="module", autouse=True)
def strict():
    """Turn what rerun would drop with a warning into errors."""
    import rerun as rr

    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def written(record, tmp_path_factory):
    return write_recording(record, tmp_path_factory.mktemp("written") / f"{record.name}.rrd")


@pytest.fixture(scope="module")
def content(written):
    return read(written)


def read(path) -> dict:
    """All columns of a recording: entity -> column -> list of rows, chunks one after another."""
    from rerun.chunk import RrdReader

    reader = RrdReader(str(path))
    columns = defaultdict(lambda: defaultdict(list))
    for chunk in reader.store(store=reader.recordings()[0]).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            column = batch.column(name)
            # Nanoseconds as whole numbers: Python's own time spans stop at microseconds.
            column = column.cast("int64") if column.type == "duration[ns]" else column
            columns[chunk.entity_path][name] += column.to_pylist()
    return columns


def rerun(*arguments) -> int:
    return subprocess.run([str(find_binary()), *map(str, arguments)], capture_output=True, timeout=120).returncode


def test_a_recording_is_not_put_into_a_folder_of_its_name(record, tmp_path):
    with pytest.raises(IsADirectoryError, match=re.escape(str(tmp_path))):
        write_recording(record, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_recording_verifies_and_is_the_same_when_written_again(record, written, tmp_path):
    again = write_recording(record, tmp_path / "again.rrd")
    assert rerun("rrd", "verify", written, again) == 0
    assert rerun("rrd", "compare", "--unordered", written, again) == 0
    other = write_recording(replace(record, contact_force=1.01 * record.contact_force), tmp_path / "other.rrd")
    assert rerun("rrd", "compare", "--unordered", written, other) == 1  # the comparison can fail


def kept_samples(record, content, entity: str) -> np.ndarray:
    """The samples of a run at which a plot has rows."""
    seconds = np.array(content[entity]["sim_time"], "timedelta64[ns]") / np.timedelta64(1, "s")
    samples = np.round(seconds / record.time[1]).astype(int)
    np.testing.assert_allclose(record.time[samples], seconds, atol=1e-9)
    return samples


def assert_forces_are_those_of(record, content) -> None:
    """Peaks and zeros are exact, and lines between the rows miss no sample by more than is stated."""
    force = np.array(content["/force"]["Scalars:scalars"])
    samples = kept_samples(record, content, "/force")
    n = record.samples
    ratio = record.force_ratio[:n]
    np.testing.assert_allclose(force, ratio[samples], atol=GRAIN)
    assert np.all(force.max(axis=0) >= ratio.max(axis=0))  # peaks are rounded away from zero, never down
    line = np.column_stack([np.interp(np.arange(n), samples, column) for column in force.T])
    np.testing.assert_allclose(line, ratio, atol=TOLERANCE * np.ptp(ratio) + GRAIN)
    np.testing.assert_array_equal(line == 0.0, ratio == 0.0)  # contact is lost and found at the same samples


def test_forces_have_their_peaks_and_are_zero_only_where_separated(record, content):
    assert_forces_are_those_of(record, content)
    assert len(content["/force"]["sim_time"]) < len(record.time)


@pytest.mark.parametrize("speed", [20 / 3.6, 400 / 3.6])
def test_a_separation_and_a_peak_of_one_sample_are_exact_at_any_speed(speed, tmp_path):
    time = np.arange(8001) * 1e-4
    force = 5e4 + 50.0 * np.sin(2 * np.pi * 40.0 * time[:, None] + np.arange(2))
    force[3001, 0] = 0.0
    force[5003, 1] = 9e4
    force[[6000, 6002], 1] = 0.0
    run = RunRecord(
        name="spikes", time=time, position=30.0 + speed * time, wheel_offsets=np.array([0.0, 2.5]),
        static_load=np.full(2, 5e4), contact_force=force,
    )  # fmt: skip
    content = read(write_recording(run, tmp_path / "run.rrd"))
    assert_forces_are_those_of(run, content)
    samples = set(kept_samples(run, content, "/force").tolist())
    assert {3000, 3001, 3002, 5002, 5003, 5004, 5999, 6000, 6001, 6002, 6003} <= samples
    assert len(samples) < 2000
    assert np.max(content["/force"]["Scalars:scalars"]) == pytest.approx(1.8, abs=GRAIN)
    starts = [time for time in content["/contact/wheel_2"]["sim_time"] if time is not None]
    assert np.timedelta64(600_200_000, "ns") in np.array(starts, "timedelta64[ns]")
    assert len(content["/force/separation"]["Scalars:scalars"]) == 3


def test_deflection_irregularity_and_motion_keep_their_peaks(record, content):
    bodies = [body.vertical_dof for body in record.bodies if body.kind != "wheelset"]
    curves = {
        "/rail_deflection": record.rail_under_wheel,
        "/slab_deflection": record.slab_under_wheel,
        "/irregularity": record.irregularity,
        "/displacement": record.vehicle[:, bodies],
    }
    for entity, values in curves.items():
        rows = np.array(content[entity]["Scalars:scalars"])
        samples = kept_samples(record, content, entity)
        span = 1e3 * np.ptp(values)
        line = np.column_stack([np.interp(np.arange(len(values)), samples, column) for column in rows.T])
        np.testing.assert_allclose(line, 1e3 * values, atol=TOLERANCE * span + span / 4096)
        np.testing.assert_allclose(rows.max(axis=0), 1e3 * values.max(axis=0), atol=span / 4096)


def test_two_timelines_and_no_wall_clock(record, content):
    assert {name for name in content["/force"] if name in ("sim_time", "chainage_mm", "log_time", "log_tick")} == {
        "sim_time",
        "chainage_mm",
    }
    samples = kept_samples(record, content, "/force")
    np.testing.assert_allclose(content["/force"]["chainage_mm"], 1e3 * record.position[samples], atol=0.5)


def test_lines_never_average_their_samples(content):
    import rerun as rr

    policy = rr.components.AggregationPolicy.MinMax.value
    plots = [entity for entity in content if "SeriesLines:names" in content[entity]]
    expected = {"force", "rail_deflection", "slab_deflection", "irregularity", "displacement", "acceleration"}
    ranges = {f"range/{name}" for name in ("force", "rail_deflection", "slab_deflection")}
    assert {f"/{name}" for name in (*expected, "wheel_acceleration", *ranges)} == set(plots)
    for entity in plots:
        assert content[entity]["SeriesLines:aggregation_policy"] == [[policy]]


def test_lanes_and_event_list_tell_of_every_separation(record, content):
    for j in range(record.wheel_count):
        events = [event for event in record.events if event.wheel == j]
        lane = content[f"/contact/wheel_{j + 1}"]
        states = [state for (state,) in lane["StateChange:state"]]
        assert states == ["contact", *["separated", "contact"] * len(events)]
        times = np.array([time for time in lane["sim_time"] if time is not None], "timedelta64[ns]")
        at = times / np.timedelta64(1, "s")
        np.testing.assert_allclose(at[1::2], [event.start for event in events], atol=1e-9)
        shortest = SHORTEST * (record.time[-1] - record.time[0])  # stated: the viewer leaves out what is shorter
        ends = [max(event.end, event.start + shortest) for event in events]
        np.testing.assert_allclose(at[2::2], ends, atol=1e-9)
    texts = [text for (text,) in content["/events"]["TextLog:text"]]
    assert len(texts) == len(record.events) + 2
    assert sum(text.startswith(f"{record.events[0].start:.4f} s  wheel 1 off") for text in texts) == 1


def test_a_separated_wheel_is_drawn_in_the_warning_colour(record, content):
    from tbatch.view.palette import WARNING

    warning = int.from_bytes(bytes([*WARNING, 255]), "big")
    rim = content["/side/vehicle/wheel_1/rim"]
    colours = [cell[0] for cell in rim["LineStrips3D:colors"] if cell]
    assert colours.count(warning) == sum(event.wheel == 0 for event in record.events)
    assert colours[0] != warning


def test_properties_name_and_sheet_are_there(record, content):
    run = content["/__properties/run"]
    assert {key: run[key][0][0] for key in record.properties} == dict(record.properties)
    assert content["/__properties"]["RecordingInfo:name"] == [[record.name]]
    (sheet,) = content["/sheet"]["TextDocument:text"][0]
    assert "| 1 | 132.4 |" in sheet


def test_a_property_may_be_whole_in_one_run_and_broken_in_the_next(record, tmp_path):
    for value in (250, 250.5, "unknown"):
        path = write_recording(replace(record, properties={"force_max": value}), tmp_path / "p.rrd")
        assert read(path)["/__properties/run"]["force_max"] == [[value]]


SHORT = 0.4e6  # stated: what a short run may have beside its share of 3 MB per 100 m [bytes]


@pytest.mark.parametrize(
    ("speed", "step", "way"), [(20, 1e-4, 8.0), (20, 0.5e-4, 5.0), (80, 1e-4, 25.0), (160, 1e-4, 25.0)]
)
def test_a_recording_stays_below_3_megabytes_per_100_m_at_low_speeds(speed, step, way, tmp_path):
    run = synthetic_record(seed=2, speed=speed / 3.6, step=step, length=45.0 + way)
    assert run.position[-1] - run.position[0] == pytest.approx(way, abs=0.1)
    assert write_recording(run, tmp_path / "run.rrd").stat().st_size < 3.0e6 * way / 100.0 + SHORT


@pytest.mark.parametrize("step", [1e-4, 0.5e-4])
def test_a_fast_recording_of_100_m_with_many_separations_stays_below_3_megabytes(step, tmp_path):
    run = synthetic_record(seed=2, speed=400 / 3.6, step=step, length=145.0, scale=1.5)
    assert len(run.events) > 200
    path = write_recording(run, tmp_path / "run.rrd")
    assert path.stat().st_size < 3.0e6
    assert_forces_are_those_of(run, read(path))


def test_a_long_run_has_an_overview_that_keeps_its_peaks(record, tmp_path, monkeypatch):
    from tbatch.view.timeline import recording

    monkeypatch.setattr(recording, "POINTS_MAX", 4000)
    content = read(write_recording(record, tmp_path / "long.rrd"))
    overview = np.array(content["/force_overview"]["Scalars:scalars"])
    assert overview.size <= 4000
    np.testing.assert_allclose(overview.max(axis=0), record.force_ratio.max(axis=0), atol=GRAIN)
    assert np.all(overview.min(axis=0) == 0.0)
    assert_forces_are_those_of(record, content)


def test_a_bare_record_of_one_wheel_that_ended_early_is_written(record, tmp_path):
    force = record.contact_force[:, :1].copy()
    force[4000:] = np.nan
    bare = replace(
        record, wheel_offsets=record.wheel_offsets[:1], static_load=record.static_load[:1], contact_force=force,
        bodies=(), vehicle=None, vehicle_acceleration=None, lift_off=None, rail=None, rail_at=None, slab=None,
        base=None, rail_under_wheel=None, slab_under_wheel=None, irregularity=None, line=None, separations=None,
        properties={},
    )  # fmt: skip
    path = write_recording(bare, tmp_path / "deep" / "bare.rrd")
    assert rerun("rrd", "verify", path) == 0
    assert kept_samples(bare, read(path), "/force")[-1] == 3999


def test_a_run_that_diverged_says_so_on_the_sheet_and_in_the_log(record, tmp_path):
    force = record.contact_force.copy()
    force[4000:] = np.nan
    sick = replace(record, contact_force=force, properties={**record.properties, "status": "diverged"})
    content = read(write_recording(sick, tmp_path / "sick.rrd"))
    assert f"**Diverged at {record.time[3999]:.4f} s**" in content["/sheet"]["TextDocument:text"][0][0]
    lines = [row[0] for row in content["/events"]["TextLog:text"]]
    assert sum(line.startswith("diverged: ") for line in lines) == 1
    assert not any(line.startswith("end") for line in lines)


def test_a_failure_leaves_the_old_file_and_nothing_else(record, tmp_path, monkeypatch):
    from tbatch.view.timeline import recording

    path = write_recording(record, tmp_path / "run.rrd")
    before = path.read_bytes()
    monkeypatch.setattr(recording, "run_sheet", lambda record: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_recording(record, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_nothing_in_a_layout_is_true_of_one_run_alone(record):
    """Recordings of one campaign share a layout in the viewer: another run's ranges and numbers must not be in it."""
    from tbatch.view.timeline.canvas import Axis, Canvas
    from tbatch.view.timeline.dashboard import dashboard

    charts = {"track": Canvas("along_track", Axis(0.0, 1.0, 400.0), Axis(0.0, 1.0, 100.0))}
    other = replace(record, irregularity=3.0 * record.irregularity, contact_force=5.0 * record.contact_force)
    names = [view_names(dashboard(one, charts).root_container) for one in (record, other)]
    assert names[0] == names[1]
    assert len(names[0]) > 8
    assert not any(re.search("[0-9]", re.sub("Q/Q0|wheel 1", "", name)) for name in names[0])


def view_names(part) -> list[str]:
    """Names of all views of a layout."""
    below = getattr(part, "contents", None)
    if not isinstance(below, (list, tuple)) or any(isinstance(one, str) for one in below):
        return [str(part.name)]
    return [name for one in below for name in view_names(one)]


def test_rerun_is_imported_only_when_a_recording_is_written():
    code = (
        "import sys, tbatch.view.record, tbatch.view.scene, tbatch.view.timeline, tbatch.view.viewer, "
        "tbatch.view.progress; tbatch.view.viewer.find_binary(); "
        "print([name for name in ('rerun', 'rerun_bindings', 'taichi', 'matplotlib') if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
