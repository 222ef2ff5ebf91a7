"""A look at the dashboard with a software renderer: what a reader must be able to see is there."""

import time

import numpy as np
import pytest
from headless import colours, count, settled

from tbatch.view.overlay import Overlay, Page, Panel, Response
from tbatch.view.palette import WARNING, run_colour, wheel_colour
from tbatch.view.timeline import write_overlay, write_recording

SIDE = (slice(55, 400), slice(0, 1290))  # the side view in the picture of 1920 by 1080
LANES = (slice(640, 835), slice(0, 1290))  # the contact lanes


@pytest.fixture
def viewer(spawn):
    """A viewer without a window, or a skip where there is no graphics device."""
    with spawn() as client:
        yield client


def picture(viewer, seconds: float) -> np.ndarray:
    """The viewer's picture at a time; colours 0-255, shape (row, column, 3)."""
    viewer.set_time("sim_time", duration=seconds, play_state="paused")
    return settled(viewer.take_screenshot)


def test_dashboard_shows_the_run_and_warns_of_a_separated_wheel(record, viewer, tmp_path):
    path = write_recording(record, tmp_path / "run.rrd")
    viewer.open(str(path))
    while viewer.get_state().loading:
        time.sleep(0.1)
    event = max(record.events, key=lambda event: event.end - event.start)
    calm = picture(viewer, 0.0)
    off = picture(viewer, 0.5 * (event.start + event.end))

    reports = [(view.name, report.summary) for view in viewer.get_state().views for report in view.reports]
    assert reports == []
    assert calm.std() > 20  # a blank or failed view has hardly any contrast
    assert colours(off) > 200
    for wheel in range(record.wheel_count):
        # the rim of a wheel is some hundred pixels; the wheel that is off shows the warning colour instead
        assert count(calm[SIDE], wheel_colour(wheel)) > 100
        assert (count(off[SIDE], wheel_colour(wheel)) > 100) == (wheel != event.wheel)
    assert count(calm[SIDE], WARNING) < 10
    assert count(off[SIDE], WARNING) > 300
    reddish = (off[LANES][:, :, 0] - off[LANES][:, :, 2] > 100).sum()
    assert reddish > 100  # a mark in every lane


def test_compared_runs_are_seen_in_their_colours(record, viewer, tmp_path):
    names = {"stored": 1.0, "louder": 1.3}
    responses = [
        Response(
            name=name,
            colour=run_colour(k),
            time=record.time,
            position=record.position,
            values={f"force/wheel_{j + 1}": scale * record.force_ratio[:, j] for j in range(4)},
            events=record.events,
        )
        for k, (name, scale) in enumerate(names.items())
    ]
    panels = [Panel(f"force/wheel_{j + 1}", f"Q/Q0, wheel {j + 1}", f"{j}") for j in range(4)]
    overlay = Overlay(name="compared", pages=[Page(name="page", panels=panels, responses=responses)])
    viewer.open(str(write_overlay(overlay, tmp_path / "compared.rrd")))
    while viewer.get_state().loading:
        time.sleep(0.1)
    seen = picture(viewer, 0.4)
    state = viewer.get_state()
    assert [(view.name, report.summary) for view in state.views for report in view.reports] == []
    assert {"Q/Q0, wheel 1", "Q/Q0, wheel 4", "Compared"} <= {view.name for view in state.views}
    plots = seen[55:700, 0:1270]
    for k in range(2):
        assert count(plots, run_colour(k)) > 500  # lines of a pixel or two across four plots
    lanes = seen[700:1050, 0:1270]
    assert (lanes[:, :, 0] - lanes[:, :, 2] > 100).sum() > 100
