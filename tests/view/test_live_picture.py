"""A look at the live view: in a viewer that comes late, goes and comes again, and in a browser."""

import io
import os
import socket
import time

import numpy as np
import pytest
from browser import Browser, find_browser
from test_live import Said
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.progress import Progress
from tbatch.campaign.run import run
from tbatch.view.live import LiveView
from tbatch.view.live.news import Batch, Piece
from tbatch.view.palette import WARNING, wheel_colour
from tbatch.view.viewer import find_binary


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """A live view that was told of a toy campaign and of one followed run, whose wheels go up and down."""
    folder = tmp_path_factory.mktemp("live")
    scenario = ToyScenario()
    campaign = run(scenario, out=folder / "campaign", executor=ToyExecutor(scenario))
    with LiveView(Said(), window=False, web=True, log=folder / "log") as live:
        live.begin(campaign)
        live._put(Batch(0.0, {0: "c00-s000000", 1: "c01-s000000"}))
        for chunk in range(20):
            step = np.arange(100) + 100 * chunk
            ratio = np.maximum(1.0 + 1.5 * np.sin(0.02 * step[:, None] + np.arange(2)), 0.0).astype(np.float32)
            live._put(Piece(0.1 * chunk, 0.1 * (chunk + 1), 100 * chunk, 1e-3, {0: ratio, 1: ratio}))
            live._tell(Progress("running", 0, 200, 20_000 * chunk, 400_000, 0))
            time.sleep(0.02)
        yield live
    assert (folder / "log").read_text() == ""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def spawn(tmp_path):
    """Starts a viewer without a window, or skips where there is no graphics device."""
    from rerun.experimental import ViewerClient

    os.environ.setdefault("XDG_RUNTIME_DIR", str(tmp_path))

    def start():
        try:
            client = ViewerClient.spawn(headless=True, port=free_port(), executable_path=str(find_binary()))
            client.get_state()
        except (ConnectionError, RuntimeError, TimeoutError) as error:
            pytest.skip(f"no Vulkan device for the viewer (mesa-vulkan-drivers has a software one): {error}")
        return client

    return start


def settled(take, seconds: float = 60.0) -> np.ndarray:
    """A picture, once two in a row are the same; colours 0-255, shape (row, column, 3)."""
    from PIL import Image

    before, until = b"", time.monotonic() + seconds
    while time.monotonic() < until:
        time.sleep(1.0)
        png = take()
        if png == before:
            break
        before = png
    return np.asarray(Image.open(io.BytesIO(before)).convert("RGB")).astype(int)


def count(picture: np.ndarray, colour: tuple[int, int, int], within: int = 14) -> int:
    return int((np.abs(picture - np.array(colour)).max(axis=2) <= within).sum())


def shows_the_campaign(picture: np.ndarray) -> None:
    assert len(np.unique((picture // 16).reshape(-1, 3), axis=0)) > 100
    assert count(picture, wheel_colour(0)) > 200  # in the strips
    assert count(picture, wheel_colour(1)) > 200
    assert count(picture, WARNING) > 10  # marks of separations


def test_a_viewer_may_come_late_be_killed_and_come_again(live, spawn):
    for _ in range(2):
        client = spawn()
        with client:
            client.open(live.address.url)
            time.sleep(3.0)
            shows_the_campaign(settled(client.take_screenshot))
            reports = [(view.name, report.summary) for view in client.get_state().views for report in view.reports]
            assert reports == []
        assert live._feed.alive
        assert live._server.poll() is None


@pytest.mark.slow
@pytest.mark.skipif(find_browser() is None, reason="no Chromium here")
def test_the_web_viewer_shows_it_in_a_browser(live, tmp_path):
    with Browser(tmp_path) as browser:
        browser.open(live.address.web_url)
        time.sleep(20.0)
        picture = settled(browser.picture)
        shows_the_campaign(picture)
        if folder := os.environ.get("TBATCH_PICTURES"):
            from PIL import Image

            Image.fromarray(picture.astype(np.uint8)).save(f"{folder}/web.png")
