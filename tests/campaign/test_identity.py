"""What is done with the runs of a campaign may change; what they are may not."""

import dataclasses
import json
from dataclasses import dataclass, field

import pytest
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.faults import FolderUnusable
from tbatch.campaign.limits import judge, stored_limits
from tbatch.campaign.merging import merge
from tbatch.campaign.part import Part
from tbatch.campaign.run import run
from tbatch.campaign.verification import verify
from tbatch.scenario.keep import Keep


@dataclass
class Judged(ToyScenario):
    """A toy with [limits] and [keep]."""

    limits: dict = field(default_factory=lambda: {"diverged": {"max": 0}})
    keep: Keep = field(default_factory=lambda: Keep(timelines="worst:1", every=1e-3))

    @property
    def source_text(self):
        """What the scenario file says."""
        return f"# {self.limits} {self.keep}\n"

    def resolved(self):
        """With both tables."""
        return {**super().resolved(), "limits": self.limits, "keep": self.keep.model_dump(mode="json")}


class Recorder:
    """Notes what it was asked to record, and writes when samples are taken."""

    def __init__(self):
        self.asked = []

    def __call__(self, campaign, names, folder):
        """Writes a file for each name."""
        self.asked += names
        for name in names:
            (folder / f"{name}.rrd").write_text(str(campaign.store.resolved["keep"]["every"]))


def go_on(folder, scenario, **options):
    recorder, executor = Recorder(), ToyExecutor(scenario)
    said = []
    campaign = run(scenario, out=folder, executor=executor, recorder=recorder, message=said.append, **options)
    return campaign, executor.asked, recorder.asked, said


def test_other_limits_simulate_nothing_and_the_folder_follows_them(tmp_path):
    go_on(tmp_path, Judged())
    other = Judged(limits={"diverged": {"max": 0}, "separation.probability": {"max": 0.3}})
    campaign, simulated, recorded, said = go_on(tmp_path, other)
    assert (simulated, recorded) == ([], [])
    assert "other than before: limits.separation.probability.max absent -> 0.3" in said
    assert json.loads((tmp_path / "resolved.json").read_text())["limits"] == other.limits
    assert (tmp_path / "campaign.toml").read_text() == other.source_text
    assert {one.limit for one in judge(campaign, stored_limits(Campaign.open(tmp_path)))} >= {"separation.probability"}
    assert verify(tmp_path).damage == []


def test_another_keep_records_what_is_missing_and_removes_what_is_not_kept(tmp_path):
    _, _, first, _ = go_on(tmp_path, Judged())
    _, simulated, more, _ = go_on(tmp_path, Judged(keep=Keep(timelines="worst:3", every=1e-3)))
    assert simulated == []
    assert (len(first), len(more)) == (2, 4)
    assert not set(first) & set(more)
    go_on(tmp_path, Judged(keep=Keep(timelines="none", every=1e-3)))
    assert list((tmp_path / "rrd").iterdir()) == []
    assert verify(tmp_path).damage == []


def test_recordings_of_other_channels_or_samples_are_written_anew(tmp_path):
    _, _, first, _ = go_on(tmp_path, Judged())
    _, simulated, again, _ = go_on(tmp_path, Judged(keep=Keep(timelines="worst:1", every=2e-3)))
    assert (simulated, again) == ([], first)
    assert {path.read_text() for path in (tmp_path / "rrd").iterdir()} == {"0.002"}
    assert verify(tmp_path).damage == []


def test_parts_with_other_limits_join(tmp_path):
    for index, limit in enumerate((0, 3)):
        go_on(tmp_path / str(index), Judged(limits={"diverged": {"max": limit}}), part=Part(index, 2))
    merged = merge(tmp_path / "0", [tmp_path / "1"], message=print)
    assert merged.missing() == []
    assert verify(tmp_path / "0").damage == []


def test_parts_write_no_recordings_and_resuming_the_joined_folder_does(tmp_path):
    broken = frozenset({(0, 3)})
    for index in range(2):
        scenario = Judged()
        executor, recorder = ToyExecutor(scenario, diverging=broken), Recorder()
        run(scenario, out=tmp_path, executor=executor, recorder=recorder, part=Part(index, 2))
        assert recorder.asked == []
    assert not (tmp_path / "quarantine").exists()
    merge(tmp_path, [], message=print)
    executor, recorder = ToyExecutor(Judged(), diverging=broken), Recorder()
    campaign = run(Judged(), out=tmp_path, executor=executor, recorder=recorder)
    assert executor.asked == [(0, 3)]  # again, with histories, for its record
    assert len(recorder.asked) == 2
    assert [path.name for path in (tmp_path / "quarantine").iterdir()] == ["c00-s000003.json"]
    assert campaign.missing() == []
    assert verify(tmp_path).damage == []


def test_a_folder_of_an_older_format_is_named_so(tmp_path):
    go_on(tmp_path, dataclasses.replace(Judged(), samples=5))
    content = json.loads((tmp_path / "manifest.json").read_text())
    (tmp_path / "manifest.json").write_text(json.dumps({**content, "format": 1}, indent=1))
    with pytest.raises(FolderUnusable, match="before its first release"):
        Campaign.open(tmp_path)
