"""The way out of the campaign's process: a bounded queue, and a thread that writes to the process that draws.

Whoever puts news in never waits. A slow reader makes the queue fill up, and what finds it full is left out; a reader
that is gone makes the feed end, with a reason. In neither case does the campaign notice.
"""

from __future__ import annotations

import pickle
import queue
import subprocess
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import IO

from tbatch.view.live.news import News

ROOM = 128  # news in the queue, ten seconds of them
FAREWELL = 1.0  # for the last news to be drawn when the campaign is over [s]


class Feed:
    """Sends news to a process that reads pickles from its standard input until that ends."""

    def __init__(self, command: Sequence[str], log: IO[bytes] | int = subprocess.DEVNULL, *, room: int = ROOM) -> None:
        """Starts the process.

        Args:
            command: The process.
            log: Where it writes what goes wrong.
            room: News that may wait.
        """
        # In a session of its own: Ctrl-C in the terminal is for the campaign, which then ends this.
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=log, stderr=log, start_new_session=True)
        self._queue: queue.Queue[News | None] = queue.Queue(room)
        self._thread = threading.Thread(target=self._write, name="tbatch-live", daemon=True)
        self._thread.start()
        self.left_out = 0
        """News that found the queue full."""

    @property
    def alive(self) -> bool:
        """Whether somebody reads."""
        return self._thread.is_alive() and self._process.poll() is None

    def put(self, news: News) -> bool:
        """Takes news if there is room, at once; whether it did."""
        if not self.alive:
            return False
        try:
            self._queue.put_nowait(news)
        except queue.Full:
            self.left_out += 1
            return False
        return True

    def close(self, seconds: float = FAREWELL) -> None:
        """Lets the last news be drawn if that takes no longer than ``seconds``, and ends the process."""
        until = time.monotonic() + seconds
        with suppress(queue.Full):
            self._queue.put(None, timeout=seconds)
        self._thread.join(max(0.0, until - time.monotonic()))
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(max(0.0, until - time.monotonic()))
        self._process.kill()
        self._process.wait()

    def _write(self) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        with suppress(OSError, ValueError):  # the reader is gone
            while (news := self._queue.get()) is not None:
                pickle.dump(news, pipe, pickle.HIGHEST_PROTOCOL)
                pipe.flush()
        with suppress(OSError, ValueError):
            pipe.close()
