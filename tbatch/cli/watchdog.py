"""Ends this process when it cannot act on a signal itself.

While a library holds Python's lock, as Taichi 1.7.4 does for the ten seconds or so that the kernels take to compile, no
Python runs, so no signal handler written in it. What still works is done by the system and by another process: the
system's own handler writes the signal's number into a pipe and gives the signal its default action back; a small child
reads the pipe, waits for a word from here, and where none comes says how to go on and sends the signal again. The exit
code is then that of a process ended by the signal, 130 or 143 in a shell, and the folder's lock goes with the process.
"""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from types import TracebackType
from typing import Any

PATIENCE = 5.0  # s: half of what a stop may take
_HEARD = b"\0"
_CHILD = """
import os, select, signal, sys
owner, patience, text = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_IGN)
while byte := os.read(0, 1):
    if byte != b"\\0" and not select.select([0], [], [], patience)[0]:
        os.write(2, text.encode())
        os.kill(owner, byte[0])
"""


class Watchdog:
    """While it is entered, a signal that is not heard within some seconds ends the process."""

    def __init__(self, signals: Sequence[int], text: str, *, patience: float = PATIENCE) -> None:
        """Takes the signals, which have handlers in Python by then.

        Args:
            signals: Numbers of the signals.
            text: What to tell the user where the process is ended.
            patience: How long to wait for ``heard`` [s].
        """
        self._signals, self._text, self._patience = signals, text, patience
        self._child: subprocess.Popen[bytes] | None = None
        self._pipe = -1
        self._wakeup_before = -1

    def __enter__(self) -> "Watchdog":
        """Starts the child; without one, where there is no such thing, signals wait as they did."""
        if os.name == "nt":
            return self
        read_end, self._pipe = os.pipe()
        os.set_blocking(self._pipe, False)
        command = [sys.executable, "-I", "-S", "-c", _CHILD, str(os.getpid()), str(self._patience), self._text]
        try:
            # A session of its own, so that Ctrl-C is the parent's alone.
            self._child = subprocess.Popen(command, stdin=read_end, start_new_session=True)
        except OSError:
            os.close(self._pipe)
            return self
        finally:
            os.close(read_end)
        self._wakeup_before = signal.set_wakeup_fd(self._pipe, warn_on_full_buffer=False)
        for number in self._signals:
            _once(number)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Lets the child go."""
        if self._child is None:
            return
        signal.set_wakeup_fd(self._wakeup_before)
        os.close(self._pipe)
        self._child.wait()
        self._child = None

    def heard(self, number: int, handler: Any) -> None:
        """Says that a signal was acted on, and takes it over for Python again.

        Args:
            number: The signal.
            handler: Its handler.
        """
        if self._child is None:
            return
        signal.signal(number, handler)
        with contextlib.suppress(OSError):
            os.write(self._pipe, _HEARD)


def _once(number: int) -> None:
    """Gives a signal its default action back once its handler was called: System V's way, by the system itself."""
    with contextlib.suppress(AttributeError, OSError):  # a C library without it: the child's signal is not heard either
        library = ctypes.CDLL(None)
        for call in (library.signal, library.sysv_signal):
            call.argtypes, call.restype = (ctypes.c_int, ctypes.c_void_p), ctypes.c_void_p
        handler = library.signal(number, None)
        library.sysv_signal(number, handler)
