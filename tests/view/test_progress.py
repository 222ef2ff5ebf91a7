import io
import os
from dataclasses import dataclass

import pytest

from tbatch.view.progress import ProgressDisplay, progress_on


@dataclass
class State:
    """A Progress."""

    run_steps_done: int
    run_steps_total: int = 1_000_000
    separations: int = 0


class Clock:
    """A clock that is set by hand."""

    now = 100.0

    def __call__(self) -> float:
        """Give the time [s]."""
        return self.now


class Terminal(io.StringIO):
    """A stream that claims to be a terminal."""

    def isatty(self) -> bool:
        """Claim it."""
        return True


def test_plain_lines_come_at_most_every_ten_seconds_and_at_the_end():
    stream, clock = io.StringIO(), Clock()
    with ProgressDisplay("demo", stream=stream, clock=clock) as display:
        for second in range(25):
            clock.now = 100.0 + second
            display(State(10_000 * second, separations=second))
    lines = stream.getvalue().splitlines()
    assert [line.split(" %")[0] for line in lines] == ["demo: 0", "demo: 10", "demo: 20", "demo: 24"]
    assert lines[1] == "demo: 10 %, 10 k run-steps/s, 1:30 left, 10 separations"


def test_rate_counts_from_the_first_run_step_and_not_from_the_compilation():
    stream, clock = io.StringIO(), Clock()
    with ProgressDisplay(stream=stream, clock=clock) as display:
        display(State(0, 0))
        clock.now += 60.0  # building and compiling
        display(State(0))
        clock.now += 2.0
        assert display.describe(State(500_000, separations=1)) == "250 k run-steps/s, 0:02 left, 1 separation"


def test_an_interrupted_computation_says_how_far_it_came():
    stream = io.StringIO()
    with pytest.raises(KeyboardInterrupt), ProgressDisplay(stream=stream, clock=Clock()) as display:
        display(State(0))
        display(State(420_000))
        raise KeyboardInterrupt
    assert stream.getvalue().splitlines()[-1].startswith("42 %")


def test_a_terminal_gets_a_bar_with_messages_above_it(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "120")
    stream, clock = Terminal(), Clock()
    with ProgressDisplay("demo", stream=stream, clock=clock) as display:
        display(State(0))
        clock.now += 1.0
        display(State(500_000, separations=14))
        display.message("c03-s000127 [diverged]")
    text = stream.getvalue()
    assert "━" in text
    assert "500 k run-steps/s, 0:01 left, 14 separations" in text
    assert "c03-s000127 [diverged]" in text


def test_a_dumb_terminal_and_forced_colours_get_plain_lines(monkeypatch):
    monkeypatch.setenv("TERM", "dumb")
    dumb = Terminal()
    with progress_on(dumb) as display:
        display(State(10))
    monkeypatch.setenv("FORCE_COLOR", "1")
    file = io.StringIO()
    with progress_on(file) as display:
        display(State(10))
    assert "━" not in dumb.getvalue() + file.getvalue()
    assert "\x1b" not in file.getvalue()


def test_a_closed_stream_disturbs_nothing():
    reader, writer = os.pipe()
    os.close(reader)
    stream = os.fdopen(writer, "w")
    with progress_on(stream) as display:
        display(State(10))
        display.message("hello")
    closed = io.StringIO()
    closed.close()
    with progress_on(closed) as display:
        display(State(10))
    try:
        stream.close()
    except BrokenPipeError:
        pass
