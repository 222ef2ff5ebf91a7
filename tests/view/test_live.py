"""A campaign that is watched: what is shown is what happens, and whoever looks or goes changes nothing of it."""

import signal
import socket
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import psutil
import pytest
from toy import ToyExecutor, ToyScenario, contents

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.run import run
from tbatch.scenario import Scenario
from tbatch.view.live import LiveView
from tbatch.view.live.address import Address
from tbatch.view.live.feed import Feed
from tbatch.view.live.news import Piece, State

SHORT = ["run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"']


class Said(list):
    """What was told to the user."""

    __call__ = list.append


def wait_until(condition, seconds: float = 60.0) -> bool:
    until = time.monotonic() + seconds
    while not condition() and time.monotonic() < until:
        time.sleep(0.02)
    return bool(condition())


def stored(folder: Path) -> dict[str, bytes]:
    """The bytes of all tables of a campaign folder."""
    return {f"{path.parent.name}/{path.name}": path.read_bytes() for path in folder.glob("*/*.parquet")}


@pytest.fixture(scope="module")
def scenario():
    return Scenario.load("quick", overrides=SHORT)


@pytest.fixture(scope="module")
def unwatched(scenario, tmp_path_factory):
    return run(scenario, out=tmp_path_factory.mktemp("unwatched"))


@pytest.fixture(scope="module")
def strict():
    """What rerun would drop with a warning ends the process that draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RERUN_STRICT", "1")
        yield


@pytest.fixture(scope="module")
def watched(scenario, tmp_path_factory, strict):
    """A watched campaign, what was said of it, and what was drawn of it."""
    folder = tmp_path_factory.mktemp("watched")
    said = Said()
    with LiveView(said, window=False, record=folder / "live.rrd", log=folder / "live.log") as live:
        campaign = run(scenario, out=folder / "campaign", progress=live.progress, observer=live)
        left_out = live._feed.left_out
    assert left_out == 0
    assert (folder / "live.log").read_text() == ""
    return campaign, said, folder / "live.rrd"


@pytest.fixture(scope="module")
def drawn(watched):
    """All columns of what was drawn: entity -> column -> list of rows."""
    from rerun.chunk import RrdReader

    reader = RrdReader(str(watched[2]))
    columns = defaultdict(lambda: defaultdict(list))
    for chunk in reader.store(store=reader.recordings()[0]).stream():
        batch = chunk.to_record_batch()
        for name in (name for name in batch.schema.names if ":" in name):
            columns[chunk.entity_path][name] += batch.column(name).to_pylist()
    return columns


def test_a_watched_campaign_stores_the_bits_of_one_that_nobody_watches(watched, unwatched):
    campaign, said, _ = watched
    assert stored(campaign.folder) == stored(unwatched.folder)
    (advice,) = said
    assert "rerun --connect rerun+http://127.0.0.1:" in advice
    assert "ssh -L" in advice


def test_a_followed_run_is_drawn_with_all_its_peaks(watched, drawn):
    campaign, _, _ = watched
    for case in (0, 1):
        force = campaign.replay(f"c0{case}-s000000").contact_force[0]
        ratio = force / force[0]
        rows = np.array([row for row in drawn[f"/forces/{case}/wheels"]["Scalars:scalars"] if row is not None])
        # It travels in single precision: 6e-8 of its value.
        np.testing.assert_allclose(rows.max(axis=0), ratio.max(axis=0), rtol=1e-6)
        np.testing.assert_allclose(rows.min(axis=0), ratio.min(axis=0), rtol=1e-6)


def test_the_probability_drawn_last_is_that_of_the_stored_runs(watched, drawn):
    campaign, _, _ = watched
    for row in campaign.statistics(any_wheelset=True).to_pylist():
        shown = drawn[f"/probability/{row['case']}"]["Scalars:scalars"][-1]
        assert shown == [row["probability"], row["probability_low"], row["probability_high"]]
        (text,) = drawn["/table"]["TextDocument:text"][-1]
        assert f"| {row['runs']} | {row['separated_runs']} |" in text
    shares = np.array(drawn["/histogram/1"]["BarChart:values"][-1][0]["buffer"])
    assert shares.sum() == pytest.approx(100.0)


@pytest.mark.parametrize("killed", ["server", "drawing"])
def test_whoever_shows_it_may_be_killed_midway(scenario, unwatched, tmp_path, killed):
    said = Said()
    with LiveView(said, window=False) as live:
        process = {"server": live._server, "drawing": live._feed._process}[killed]

        def progress(state):
            live.progress(state)
            if state.run_steps_done > 0 and process.poll() is None:
                process.kill()
                process.wait()
                live._state_at = -1.0  # no pause before the next look

        campaign = run(scenario, out=tmp_path / "campaign", progress=progress, observer=live)
    assert stored(campaign.folder) == stored(unwatched.folder)
    assert said[1:] == ["the live view has ended; the campaign goes on without it"]
    assert process.poll() is not None


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="processes cannot be stopped here")
@pytest.mark.parametrize("stopped", ["server", "drawing"])
def test_whoever_shows_it_may_hang_midway(scenario, unwatched, tmp_path, stopped):
    said = Said()
    with LiveView(said, window=False) as live:
        process = {"server": live._server, "drawing": live._feed._process}[stopped]

        def progress(state):
            live.progress(state)
            process.send_signal(signal.SIGSTOP)

        campaign = run(scenario, out=tmp_path / "campaign", progress=progress, observer=live)
    assert stored(campaign.folder) == stored(unwatched.folder)
    assert len(said) == 1  # how to look, and nothing else
    assert process.poll() is not None


def test_without_a_viewer_s_program_one_line_says_so_and_the_campaign_runs(scenario, unwatched, tmp_path, monkeypatch):
    monkeypatch.setattr("tbatch.view.live.live_view.find_binary", lambda: None)
    said = Said()
    with LiveView(said) as live:
        campaign = run(scenario, out=tmp_path / "campaign", progress=live.progress, observer=live)
    assert stored(campaign.folder) == stored(unwatched.folder)
    (line,) = said
    assert "not installed" in line


def test_a_reader_that_hangs_never_makes_the_campaign_wait():
    feed = Feed([sys.executable, "-c", "import time; time.sleep(600)"], room=4)
    big = Piece(0.0, 0.1, 0, 1e-4, {0: np.zeros((50_000, 4), np.float32)})  # more than a pipe holds
    told = [feed.put(big) for _ in range(50)]
    assert told.count(True) <= 6  # the room, one in hand, one in the pipe
    assert feed.left_out == told.count(False)
    feed.close(0.1)
    assert feed._process.poll() is not None


def test_a_reader_that_is_gone_is_noticed():
    feed = Feed([sys.executable, "-c", ""])
    assert wait_until(lambda: not feed.alive)
    assert not feed.put(State(0.0, "running", 0, 1, 0, 1, 0))
    feed.close(0.1)


def test_nothing_is_left_running_behind_and_all_is_on_the_loopback(tmp_path):
    with LiveView(Said(), window=False, web=True) as live:
        server, drawing = live._server.pid, live._feed._process.pid

        def listening():
            return [c.laddr.ip for c in psutil.Process(server).net_connections("inet") if c.status == "LISTEN"]

        assert wait_until(lambda: len(listening()) == 2)
        assert set(listening()) == {"127.0.0.1"}
    assert not psutil.pid_exists(server)
    assert not psutil.pid_exists(drawing)


def test_the_process_that_draws_ends_the_server_when_the_campaign_is_killed(tmp_path):
    code = (
        "import time; from tbatch.view.live import LiveView\n"
        "with LiveView(lambda text: None, window=False) as live:\n"
        "    print(live._server.pid, live._feed._process.pid, flush=True)\n"
        "    time.sleep(600)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    pids = [int(text) for text in process.stdout.readline().split()]
    process.kill()
    process.wait()
    process.stdout.close()
    assert wait_until(lambda: not any(map(alive, pids)))


def alive(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


class Cluster:
    """Simulates here what workers would, all at once."""

    def simulate(self, campaign, missing, report, message):
        """Simulate them."""
        from tbatch.campaign.run import _simulate

        _simulate(campaign, report, list(missing), None)


def test_runs_on_other_machines_are_counted_but_not_followed(tmp_path, monkeypatch):
    scenario = ToyScenario()
    told = []
    monkeypatch.setattr(LiveView, "_put", lambda live, news: told.append(news) or True)
    with LiveView(Said(), window=False) as live:
        live._state_at = -1.0
        campaign = run(
            scenario, out=tmp_path, executor=ToyExecutor(scenario), cluster=Cluster(),
            progress=lambda state: setattr(live, "_state_at", -1.0) or live.progress(state), observer=live,
        )  # fmt: skip
    kinds = [type(news).__name__ for news in told]
    assert set(kinds) == {"Began", "State", "Stored"}
    shards = [shard for news in told if type(news).__name__ == "Stored" for shard in news.shards]
    assert len(shards) == len(campaign.store.shards)
    assert contents(campaign)


def test_what_was_stored_before_is_shown_too(tmp_path, monkeypatch):
    scenario = ToyScenario()
    run(scenario, out=tmp_path, executor=ToyExecutor(scenario))
    told = []
    monkeypatch.setattr(LiveView, "_put", lambda live, news: told.append(news) or True)
    with LiveView(Said(), window=False) as live:
        live.begin(Campaign.open(tmp_path))
    assert len(told[1].shards) == 4


def test_a_port_in_use_is_left_alone_and_the_advice_names_the_ports():
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        taken = holder.getsockname()[1]
        from tbatch.view.live import address

        assert address._free_port(taken) != taken
    shown = Address(9876, 9090)
    assert shown.web_url == "http://127.0.0.1:9090/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A9876%2Fproxy"
    advice = shown.advice()
    assert shown.web_url in advice
    assert "ssh -L 9090:127.0.0.1:9090 -L 9876:127.0.0.1:9876" in advice
    assert "9090" not in Address(9876).advice()
