"""What `tbatch view` shows of a campaign: its table, and recordings made when somebody looks, once."""

import json
import sys

import numpy as np
import pytest

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.run import run
from tbatch.campaign.verification import verify
from tbatch.scenario import Scenario
from tbatch.view import viewer
from tbatch.view.kept import write_kept
from tbatch.view.kept_runs import ORDERS, kept_runs, kept_runs_text
from tbatch.view.viewer import ViewerUnavailable, open_catalogue
from tbatch.view.views import Views

SHORT = ["run.distance=6 m", "run.evaluate_from=1 m"]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """The quick campaign, shortened; the worst run of each of its two speeds is kept."""
    return run(Scenario.load("quick", overrides=SHORT), out=tmp_path_factory.mktemp("campaign"), recorder=write_kept)


def other_than(kept: list[str]) -> str:
    return next(name for name in (f"c01-s00000{k}" for k in range(4)) if name not in kept)


def test_the_table_says_what_is_stored_in_the_order_asked_for(campaign):
    names = [f"c0{case}-s00000{sample}" for case in (0, 1) for sample in range(4)]
    wheels = campaign.table("wheels").to_pylist()
    for order in ORDERS:
        runs = kept_runs(campaign, names, order)
        assert sorted(one.name for one in runs) == names
        for one in runs:
            mine = [row for row in wheels if (row["case"], row["sample"]) == (one.case, one.sample)]
            assert one.separations == sum(row["separations"] for row in mine)
            assert one.force_max == max(row["force_max"] for row in mine)
    assert np.diff([one.force_max for one in kept_runs(campaign, names, "force")]).max() <= 0.0
    assert np.diff([one.separations for one in kept_runs(campaign, names)]).max() <= 0
    assert np.diff([one.speed for one in kept_runs(campaign, names, "speed")]).max() <= 0.0
    text = kept_runs_text(kept_runs(campaign, names, "run")).splitlines()
    assert [line.split()[0] for line in text[2:]] == names
    with pytest.raises(ValueError, match="--sort 'weight': one of separations"):
        kept_runs(campaign, names, "weight")
    assert kept_runs(campaign, []) == []


def test_a_kept_run_is_shown_as_it_is_and_another_is_simulated_again_once(campaign):
    said = []
    views = Views(Campaign.open(campaign.folder), said.append)
    kept = campaign.kept()
    assert views.run(kept[0]) == campaign.folder / "rrd" / f"{kept[0]}.rrd"
    assert said == []
    name = other_than(kept)
    path = views.run(name)
    assert said == [f"{name} was not kept: it is simulated again", f"{name} is bit for bit the stored run"]
    before = path.stat().st_mtime_ns
    assert views.run(name) == path
    assert path.stat().st_mtime_ns == before
    assert [one.stem for one in views.kept()] == [*sorted(kept), name]
    path.write_bytes(path.read_bytes()[:-1])  # not what was written: it is made again
    views.run(name)
    assert len(said) == 4
    with pytest.raises(ValueError, match="this campaign has runs c00-s000000 to c01-s000003"):
        views.run("c07-s000000")


def test_a_run_that_differs_from_the_stored_one_is_shown_and_said_to(campaign, monkeypatch):
    said = []
    monkeypatch.setattr(Campaign, "differs_from_stored", lambda *_: ["wheels.force_max"])
    views = Views(Campaign.open(campaign.folder), said.append)
    name = next(name for name in ("c00-s000000", "c00-s000001") if name not in campaign.kept())
    assert views.run(name).exists()
    assert "NOT the stored run" in said[1]
    assert "wheels.force_max" in said[1]


def test_envelopes_are_made_once_and_again_when_there_are_more_runs(campaign, tmp_path):
    scenario = Scenario.load("quick", overrides=[*SHORT, 'keep.timelines="none"', "campaign.runs=2"])
    grown = run(scenario, out=tmp_path)
    said = []
    paths = Views(Campaign.open(tmp_path), said.append).envelopes()
    assert [path.name for path in paths] == ["envelope-c00.rrd", "envelope-c01.rrd"]
    assert len(said) == 2
    Views(Campaign.open(tmp_path), said.append).envelopes()
    assert len(said) == 2
    grown = run(Scenario.load("quick", overrides=[*SHORT, 'keep.timelines="none"', "campaign.runs=3"]), out=tmp_path)
    Views(Campaign.open(tmp_path), said.append).envelopes()
    assert said[2:] == [f"envelope at {speed} km/h, from 3 runs simulated again" for speed in (200, 350)]
    assert verify(grown.folder).damage == []  # views are beside the result
    assert {"envelope-c00.rrd", "envelope-c01.rrd"} == set(json.loads((tmp_path / "views" / "index.json").read_text()))


def test_the_catalogue_serves_runs_and_envelopes_on_the_loopback_with_their_layouts(campaign):
    from tbatch.view.timeline.catalogue import Catalogue, _client

    runs = sorted((campaign.folder / "rrd").glob("*.rrd"))
    with Catalogue("quick, a name", runs, runs[:1]) as catalogue:
        assert catalogue.url.startswith("rerun+http://127.0.0.1:")
        client = _client(catalogue.url.partition("/entry/")[0])
        dataset = client.get_dataset("quick__a_name")
        assert str(dataset.id) in catalogue.url
        assert sorted(dataset.segment_ids()) == sorted(f"quick-{path.stem}" for path in runs)
        assert dataset.default_blueprint() is not None
        assert dataset.default_segment_table_blueprint() is not None
        assert client.get_dataset("quick__a_name-envelopes").segment_ids() == [f"quick-{runs[0].stem}"]


def program(folder, text: str):
    """A stand-in for the viewer's program."""
    path = folder / "rerun"
    path.write_text(f"#!{sys.executable}\n{text}\n")
    path.chmod(0o755)
    return path


def test_the_catalogue_s_viewer_stays_open_and_one_that_does_not_start_is_explained(campaign, tmp_path, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    runs = sorted((campaign.folder / "rrd").glob("*.rrd"))
    told = tmp_path / "told"
    text = f"import sys, time; open({str(told)!r}, 'w').write(' '.join(sys.argv[1:])); time.sleep(5)"
    monkeypatch.setattr(viewer, "find_binary", lambda: program(tmp_path, text))
    open_catalogue("quick", runs)
    assert told.read_text().startswith("--bind 127.0.0.1 --port auto rerun+http://127.0.0.1:")
    text = 'import sys; print("Error: no screen: none at all", file=sys.stderr); sys.exit(3)'
    monkeypatch.setattr(viewer, "find_binary", lambda: program(tmp_path, text))
    with pytest.raises(ViewerUnavailable, match="none at all"):
        open_catalogue("quick", runs)
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerUnavailable, match="no display"):
        open_catalogue("quick", runs)
