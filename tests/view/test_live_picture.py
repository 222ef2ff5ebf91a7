"""A look at the live view: in a viewer that comes late, goes and comes again, and in a browser."""

import os
import time

import numpy as np
import pytest
from browser import Browser, find_browser
from headless import colours, count, settled
from test_live import Said
from toy import ToyExecutor, ToyScenario

from tbatch.campaign.progress import Progress
from tbatch.campaign.run import run
from tbatch.view.live import LiveView
from tbatch.view.live.news import Batch, Piece
from tbatch.view.palette import WARNING, wheel_colour


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


def shows_the_campaign(picture: np.ndarray) -> None:
    assert colours(picture) > 100
    assert count(picture, wheel_colour(0)) > 200  # in the strips
    assert count(picture, wheel_colour(1)) > 200
    assert count(picture, WARNING) > 10  # marks of separations


@pytest.mark.slow
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
