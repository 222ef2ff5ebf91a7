"""The process that draws a live view: reads news from its standard input until that ends.

    python -m tbatch.view.timeline.live_process URL SERVER_PID [FILE.rrd]

It ends with the campaign's process, however that ends, and takes the server with it.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import time
from contextlib import suppress

from tbatch.view.live.live_view import yield_processor

FLUSH = 0.5  # for the last news to reach the server [s]
PASS_ON = 0.2  # and the viewers [s]


def main(url: str, server: int, file: str | None) -> None:
    """Draws until there are no more news.

    Args:
        url: The server's address.
        server: Its process number.
        file: A file to write to as well.
    """
    yield_processor(os.getpid())  # before the import: its threads inherit it
    import rerun as rr

    from tbatch.view.timeline.live import LiveRecording

    stream = rr.RecordingStream("tbatch-live", send_properties=False)
    if file:
        stream.set_sinks(rr.GrpcSink(url), rr.FileSink(file))
    else:
        stream.set_sinks(rr.GrpcSink(url))
    stream.set_log_time_enabled(False)
    recording = LiveRecording(stream)
    with suppress(EOFError, pickle.UnpicklingError):  # the campaign is over, or was killed in the middle of a word
        while True:
            recording.draw(pickle.load(sys.stdin.buffer))
    # Flushing without a server raises, and so does leaving the stream's context (rerun 0.41).
    with suppress(RuntimeError):
        stream.flush(timeout_sec=FLUSH)
        time.sleep(PASS_ON)
        if file:
            stream.disconnect()  # ends the file; without one not worth the wait where the server is gone
    with suppress(OSError):
        os.kill(server, signal.SIGTERM)
    # Without the interpreter's end, where the stream would wait five seconds for a server that is gone.
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else None)
