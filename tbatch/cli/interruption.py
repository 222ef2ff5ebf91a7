"""Ctrl-C and SIGTERM: acted on at once where nothing is under way, else where the campaign can stop cleanly."""

import signal
import sys
from types import FrameType, TracebackType
from typing import Any

from tbatch.campaign.faults import Interrupted
from tbatch.cli.watchdog import Watchdog

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop(KeyboardInterrupt):
    """Stops at once. Not an Exception: Taichi 1.7.4 rewords those that pass through its compiler."""

    def __init__(self, signal_number: int, message: str) -> None:
        """Takes the signal that asked for it, and what to tell."""
        self.signal_number = signal_number
        super().__init__(message)


class Interruption:
    """While it is entered, a signal stops at once, or, while runs are stepped, is noted for ``check`` to raise.

    A second one always stops at once. Within a single call into a library that holds Python's lock, such as the
    compilation of the kernels, a watchdog acts on them, after some seconds.
    """

    def __init__(self, advice: str) -> None:
        """Takes what the user can do afterwards."""
        self._advice = advice
        self._number: int | None = None
        self._before: dict[int, Any] = {}
        self._watchdog = Watchdog(SIGNALS, f"\ntbatch: {self._text}\n")
        self.stepping = False
        """Whether runs are being stepped, whose batch is worth waiting for the end of its chunk."""

    def __enter__(self) -> "Interruption":
        """Takes over the signals."""
        self._before = {number: signal.signal(number, self._note) for number in SIGNALS}
        self._watchdog.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Gives the signals back."""
        self._watchdog.__exit__(kind, error, trace)
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Raises Interrupted if a signal came."""
        if self._number is not None:
            raise Interrupted(self._number, self._text)

    @property
    def _text(self) -> str:
        return f"interrupted; what is stored stays, {self._advice}"

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._watchdog.heard(number, self._note)
        # Noted in any case: a library may swallow what is raised.
        again, self._number = self._number is not None, number
        if again or not self.stepping:
            raise Stop(number, self._text)
        print("\ntbatch: stopping after this chunk of steps; once more stops at once", file=sys.stderr, flush=True)
