"""Which runs become recordings."""

import pyarrow as pa
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.keep import worst_runs
from tbatch.campaign.run import run
from tbatch.scenario.keep import Keep


def test_the_worst_run_has_the_longest_separation_then_the_largest_force_then_the_lowest_sample():
    runs = pa.table({"case": [0] * 5 + [1], "sample": [0, 1, 2, 3, 4, 0], "status": [0, 0, 0, 0, 1, 0]})
    wheels = pa.table(
        {
            "case": [0, 0, 0, 0, 0, 0, 1],
            "sample": [0, 0, 1, 2, 3, 4, 0],
            "longest": [0.0, 1.0, 2.0, 1.0, 1.0, 9.0, 0.0],
            "force_max": [5.0, 1.0, 1.0, 6.0, 5.0, 9.0, float("nan")],
        }
    )
    assert worst_runs(runs, wheels, 3) == [(0, 1), (0, 2), (0, 0), (1, 0)]
    assert worst_runs(runs, wheels, 0) == []


def record(folder, **options):
    """Runs the toy campaign with a recorder that writes a file for each run asked for."""
    scenario = ToyScenario(**options)
    recorded = []

    def recorder(campaign, names, folder):
        for name in names:
            assert campaign.pair(name)
            (folder / f"{name}.rrd").write_text(name)
            recorded.append(name)

    campaign = run(scenario, out=folder, executor=ToyExecutor(scenario), recorder=recorder)
    return campaign, recorded


def test_kept_runs_are_recorded_once_and_again_when_their_recording_is_gone(tmp_path):
    campaign, names = record(tmp_path, keep=Keep(timelines="worst:2"))
    assert names == campaign.kept()
    assert [name[:3] for name in names] == ["c00", "c00", "c01", "c01"]
    assert sorted(campaign.store.manifest.recordings) == sorted(f"{name}.rrd" for name in names)
    assert record(tmp_path, keep=Keep(timelines="worst:2"))[1] == []
    (tmp_path / "rrd" / f"{names[2]}.rrd").unlink()
    assert record(tmp_path, keep=Keep(timelines="worst:2"))[1] == [names[2]]


def test_an_extension_replaces_recordings_of_runs_that_are_no_longer_the_worst(tmp_path):
    record(tmp_path, keep=Keep(timelines="worst:2"), samples=10)
    campaign, _ = record(tmp_path, keep=Keep(timelines="worst:2"), samples=400)
    assert sorted(path.stem for path in (tmp_path / "rrd").iterdir()) == sorted(campaign.kept())


def test_named_runs_or_none_are_kept(tmp_path):
    assert record(tmp_path / "named", keep=Keep(timelines=("c01-s000003", "c00-s000001")))[1] == [
        "c01-s000003",
        "c00-s000001",
    ]
    assert record(tmp_path / "none", keep=Keep(timelines="none"))[1] == []
