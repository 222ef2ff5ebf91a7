"""Ctrl-C and SIGTERM: noted when they come, acted on where the campaign can stop cleanly."""

import signal
import sys
from types import FrameType, TracebackType
from typing import Any

from tbatch.campaign.faults import Interrupted

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """While it is entered, a first signal is only noted, for ``check`` to raise; a second one stops at once."""

    def __init__(self, advice: str) -> None:
        """Takes what the user can do afterwards."""
        self._advice = advice
        self._number: int | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> "Interruption":
        """Takes over the signals."""
        self._before = {number: signal.signal(number, self._note) for number in SIGNALS}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Gives the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Raises Interrupted if a signal came."""
        if self._number is not None:
            raise Interrupted(self._number, f"interrupted; what is stored stays, {self._advice}")

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._number is not None:
            self.check()
        self._number = number
        print("\ntbatch: stopping after this chunk of steps; once more stops at once", file=sys.stderr, flush=True)
