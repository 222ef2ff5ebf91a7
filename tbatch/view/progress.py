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


class Progress(Protocol):
    """What a computation tells after every chunk."""

    @property
    def run_steps_done(self) -> int:
        """Run-steps finished so far."""
        ...

    @property
    def run_steps_total(self) -> int:
        """Run-steps of the whole computation."""
        ...

    @property
    def separations(self) -> int:
        """Separations found so far."""
        ...


class ProgressDisplay:
    """Shows progress while used as a context; call it with each Progress.

    Args:
        title: A word or two in front, such as the campaign's name.
        run_steps_before: Run-steps that were done before this process began (a resumed campaign): they count as
            done, not as speed.
        stream: Where to write; default standard error.
        interval: Least time between two plain lines [s].
        clock: Gives the time [s]; another one is for tests.
    """

    def __init__(
        self,
        title: str = "",
        *,
        run_steps_before: int = 0,
        stream: TextIO | None = None,
        interval: float = 10.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Choose the form; nothing is written yet."""
        self._title = title
        self._stream = sys.stderr if stream is None else stream
        self._interval = interval
        self._clock = clock
        self._before = run_steps_before
        self._began = clock()
        self._shown: tuple[float, int] | None = None
        self._last: Progress | None = None
        self._bar: RichProgress | None = None

    def __enter__(self) -> ProgressDisplay:
        """Start the clock, and the bar on a terminal."""
        self._began = self._clock()
        if _is_terminal(self._stream):
            self._bar = _bar(self._stream)
            self._bar.start()
            self._bar.add_task(self._title or "run-steps", total=None, state="")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Show the last state; an interrupted computation shows how far it came."""
        with suppress(OSError, ValueError):
            if self._last is not None and (self._shown is None or self._shown[1] != self._last.run_steps_done):
                self._show(self._last)
            if self._bar is not None:
                self._bar.stop()

    def __call__(self, progress: Progress) -> None:
        """Take the state after a chunk and show it if it is time."""
        now = self._clock()
        self._last = progress
        pause = 0.1 if self._bar is not None else self._interval
        if self._shown is None or now - self._shown[0] >= pause:
            with suppress(OSError, ValueError):
                self._show(progress)

    def message(self, text: str) -> None:
        """Write a line above the bar, or among the plain lines."""
        with suppress(OSError, ValueError):
            if self._bar is not None:
                self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
            else:
                self._line(text)

    def describe(self, progress: Progress) -> str:
        """Put the state in words: rate, time left, separations."""
        elapsed = self._clock() - self._began
        fresh = progress.run_steps_done - self._before
        words = []
        if elapsed > 0 and fresh > 0:
            rate = fresh / elapsed
            left = max(progress.run_steps_total - progress.run_steps_done, 0) / rate
            words = [f"{_short(rate)} run-steps/s", f"{_clock_face(left)} left"]
        count = progress.separations
        return ", ".join([*words, f"{count:,} separation{'' if count == 1 else 's'}".replace(",", " ")])

    def _show(self, progress: Progress) -> None:
        done, total = progress.run_steps_done, progress.run_steps_total
        state = self.describe(progress)
        self._shown = (self._clock(), done)
        if self._bar is not None:
            task = self._bar.task_ids[0]
            self._bar.update(task, completed=done, total=total, state=state)
            self._bar.refresh()
        else:
            share = 100 if total <= 0 else int(100 * done / total)
            self._line(f"{self._title + ': ' if self._title else ''}{share} %, {state}")

    def _line(self, text: str) -> None:
        self._stream.write(text + "\n")
        self._stream.flush()


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

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[state]}"))
    # No refresh thread: the bar is drawn when a chunk is done, and forks find no thread to lose.
    return RichProgress(*columns, console=Console(file=stream), auto_refresh=False)


def _short(number: float) -> str:
    """Print a rate with three digits: "12.3 M"."""
    for size, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if number >= size:
            return f"{number / size:.3g} {letter}"
    return f"{number:.3g}"


def _clock_face(seconds: float) -> str:
    """Print a duration as h:mm:ss or m:ss."""
    whole = round(seconds)
    hours, rest = divmod(whole, 3600)
    minutes, last = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{last:02d}" if hours else f"{minutes}:{last:02d}"
