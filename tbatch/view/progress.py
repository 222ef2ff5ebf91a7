"""How far a computation is, on standard error: a bar on a terminal, plain lines anywhere else.

Standard output stays free for results. A stream that cannot be written to (a closed pipe) silences the progress and
disturbs nothing else.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, TextIO

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

LINE_INTERVAL = 10.0  # least time between two plain lines [s]
DRAW_INTERVAL = 0.1  # least time between two drawings of the bar [s]


class Progress(Protocol):
    """What a computation tells after every chunk of steps; a `phase` in one word may be added."""

    @property
    def run_steps_done(self) -> int:
        """Run-steps finished since this process began."""
        ...

    @property
    def run_steps_total(self) -> int:
        """Run-steps this process is to do; 0 while not known."""
        ...

    @property
    def separations(self) -> int:
        """Separations found so far."""
        ...


class ProgressDisplay:
    """Shows progress while used as a context; call it with each Progress."""

    def __init__(
        self,
        title: str = "",
        *,
        stream: TextIO | None = None,
        interval: float = LINE_INTERVAL,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Choose the form; nothing is written yet.

        Args:
            title: A word or two in front, such as the campaign's name.
            stream: Where to write; default standard error.
            interval: Least time between two plain lines [s].
            clock: Gives the time [s].
        """
        self._title = title
        self._stream = sys.stderr if stream is None else stream
        self._interval = interval
        self._clock = clock
        self._began = clock()
        self._last: Progress | None = None
        self._line = ""
        self._shown_at: float | None = None
        self._bar: RichProgress | None = None

    def __enter__(self) -> ProgressDisplay:
        """Start the clock, and the bar on a terminal."""
        self._began = self._clock()
        if _is_terminal(self._stream):
            self._bar = _bar(self._stream)
            self._bar.start()
            self._bar.add_task(self._title, total=None, state="")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Show the last state: also an interrupted computation says how far it came."""
        if self._last is not None:
            self._show(self._last)
        if self._bar is not None:
            with suppress(OSError, ValueError):
                self._bar.stop()

    def __call__(self, progress: Progress) -> None:
        """Take the state after a chunk and show it if it is time."""
        now = self._clock()
        if progress.run_steps_done == 0:
            self._began = now  # building the model and compiling are not run-steps
        self._last = progress
        pause = self._interval if self._bar is None else DRAW_INTERVAL
        if self._shown_at is None or now - self._shown_at >= pause:
            self._shown_at = now
            self._show(progress)

    def message(self, text: str) -> None:
        """Write a line above the bar, or among the plain lines."""
        with suppress(OSError, ValueError):
            if self._bar is not None:
                self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
            else:
                self._write(text)

    def describe(self, progress: Progress) -> str:
        """Put the state in words: rate, time left, separations."""
        elapsed, done = self._clock() - self._began, progress.run_steps_done
        count = progress.separations
        words = [f"{count:,} separation{'' if count == 1 else 's'}"]
        if elapsed > 0 and done > 0:
            rate = done / elapsed
            left = max(progress.run_steps_total - done, 0) / rate
            words = [f"{_short(rate)} run-steps/s", f"{_clock_face(left)} left", *words]
        return ", ".join(words)

    def _show(self, progress: Progress) -> None:
        done, total = progress.run_steps_done, progress.run_steps_total
        phase = str(getattr(progress, "phase", ""))
        name = " ".join(word for word in (self._title, phase) if word)
        state = self.describe(progress) if total > 0 else ""
        with suppress(OSError, ValueError):
            if self._bar is not None:
                task = self._bar.task_ids[0]
                self._bar.update(task, description=name, completed=done, total=total or None, state=state)
                self._bar.refresh()
                return
            share = f"{100 * done // total} %, " if total > 0 else ""
            line = ": ".join(part for part in (name, share + state) if part)
            if line and line != self._line:
                self._line = line
                self._write(line)

    def _write(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()


def progress_on(stream: TextIO, title: str = "") -> ProgressDisplay:
    """Make a display for a stream, to be used as a context."""
    return ProgressDisplay(title, stream=stream)


def _is_terminal(stream: TextIO) -> bool:
    """Whether a bar can be drawn; rich alone would also draw one into a file when FORCE_COLOR is set."""
    try:
        if not stream.isatty():
            return False
    except (AttributeError, ValueError):
        return False
    from rich.console import Console

    return not Console(file=stream).is_dumb_terminal


def _bar(stream: TextIO) -> RichProgress:
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn
    from rich.progress import Progress as RichProgress

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TextColumn("{task.fields[state]}", markup=False),
    )
    # No refresh thread: the bar is drawn when a chunk is done, and a fork finds no thread to lose.
    return RichProgress(*columns, console=Console(file=stream), auto_refresh=False)


def _short(number: float) -> str:
    """Print a rate with three digits: "12.3 M"."""
    for size, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if number >= size:
            return f"{number / size:.3g} {letter}"
    return f"{number:.3g}"


def _clock_face(seconds: float) -> str:
    """Print a duration as h:mm:ss or m:ss."""
    hours, rest = divmod(round(seconds), 3600)
    minutes, last = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{last:02d}" if hours else f"{minutes}:{last:02d}"
