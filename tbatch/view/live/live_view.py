"""The live view of a campaign: watches it, follows a few of its runs, and tells whoever looks."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from tbatch.campaign.observer import Following
from tbatch.campaign.progress import Progress
from tbatch.campaign.shards import Shard
from tbatch.scenario.run_name import run_name
from tbatch.view.live.address import LOOPBACK, Address
from tbatch.view.live.feed import FAREWELL, Feed
from tbatch.view.live.news import Batch, Began, News, Piece, State, Stored, StoredShard
from tbatch.view.viewer import ViewerUnavailable, connect_viewer, find_binary, has_display

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

STRIPS = 4  # runs followed at a time, of as many speeds
STATE_INTERVAL = 0.5  # least time between two states [s]
PIECE_INTERVAL = 0.25  # least time between two pieces: drawing one costs the same whatever it holds [s]
MOST_SAMPLES = 200_000  # of a followed run; a longer one is followed with wider steps
MEMORY = "1GiB"  # that the server keeps for viewers that come later; the oldest goes first
TO_FINISH = 60.0  # for a file of the view to be ended, where one was asked for [s]
NICENESS = 10  # of all that only shows: the kernels come first

Say = Callable[[str], None]


class LiveView:
    """Shows a campaign while it runs; a context, and the campaign's observer.

    Nothing that happens to it, to its server or to a viewer raises here, and nothing here waits for them, but for a
    second at the end.
    """

    def __init__(
        self, say: Say, *, web: bool = False, window: bool = True, record: Path | None = None, log: Path | None = None
    ) -> None:
        """Chooses what to open; nothing is started yet.

        Args:
            say: Where to tell how to look, and what went wrong.
            web: Whether to serve the web viewer too.
            window: Whether to open a viewer where there is a display.
            record: A file to write the view to as well; default: none.
            log: A file for what goes wrong while drawing; default: it is not kept.
        """
        self._say, self._web, self._window, self._record, self._log = say, web, window, record, log
        self.address: Address | None = None
        """Where it is served, while it is."""
        self._feed: Feed | None = None
        self._server: subprocess.Popen[bytes] | None = None
        self._campaign: Campaign | None = None
        self._told: set[Shard] = set()
        self._followed: tuple[int, ...] = ()
        self._began = self._piece_began = self._state_at = 0.0
        self._first_force: np.ndarray = np.zeros(0)
        self._collected: dict[int, list[np.ndarray]] = {}
        self._first: tuple[int, float] | None = None  # sample that the collected ones begin with, and their spacing
        self._steps: Sequence[int] = ()
        self._last: Progress | None = None

    def __enter__(self) -> LiveView:
        """Starts the server and the process that draws, and says how to look; says why where that cannot be."""
        self._began = time.monotonic()
        try:
            self._start()
        except (OSError, ViewerUnavailable) as error:
            self._end(f"no live view: {error}")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Shows the last state and ends both; viewers stay open with what they have."""
        self._pass_on()
        if self._last is not None:
            self._tell(self._last)
        self._end()

    def begin(self, campaign: Campaign) -> None:
        """Is told of the campaign; see ``Observer``."""
        self._campaign = campaign
        cases = len(campaign.speeds)
        self._followed = tuple(sorted({round(case) for case in np.linspace(0, cases - 1, min(STRIPS, cases))}))
        self._put(Began(campaign.name, str(campaign.folder.resolve()), campaign.speeds, self._followed))
        self._tell_stored()

    def follow(self, pairs: Sequence[tuple[int, int]]) -> Following | None:
        """Follows one run of each chosen speed in a batch; see ``Observer``."""
        campaign = self._campaign
        if campaign is None or self._feed is None:
            return None
        places = {case: place for place, (case, _) in reversed(list(enumerate(pairs))) if case in self._followed}
        if not places:
            return None
        from tbatch.engine.runs import SaveAt

        self._steps = self._steps or campaign.executor.steps_per_run()
        longest = max(self._steps[case] for case in places)
        every = campaign.step * -(-longest // MOST_SAMPLES)
        cases = sorted(places)
        self._pass_on()
        self._put(Batch(self._elapsed(), {case: run_name(*pairs[places[case]]) for case in cases}))
        case_of = {places[case]: case for case in cases}
        save = SaveAt(every, ("contact_force",), runs=[places[case] for case in cases])
        return Following(save, lambda piece: self._take(piece, case_of, every))

    def progress(self, state: Progress) -> None:
        """Tells how far the campaign is, and what is stored by now."""
        self._last = state
        if self._feed is None or self._elapsed() - self._state_at < STATE_INTERVAL:
            return
        self._state_at = self._elapsed()
        if not self._feed.alive or (self._server is not None and self._server.poll() is not None):
            self._end("the live view has ended; the campaign goes on without it")
            return
        self._tell(state)

    def _tell(self, state: Progress) -> None:
        counts = (state.runs_done, state.runs_total, state.run_steps_done, state.run_steps_total, state.separations)
        self._put(State(self._elapsed(), state.phase, *counts))
        self._tell_stored()

    def _start(self) -> None:
        binary = find_binary()
        if binary is None:
            raise ViewerUnavailable("the rerun viewer is not installed here (pip install rerun-sdk)")
        address = self.address = Address.free(web=self._web)
        command = [str(binary), "--serve-web" if self._web else "--serve-grpc", "--bind", LOOPBACK]
        command += ["--port", str(address.port), "--server-memory-limit", MEMORY]
        command += ["--web-viewer-port", str(address.web_port)] if self._web else []
        quiet = subprocess.DEVNULL
        self._server = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True)
        yield_processor(self._server.pid)
        drawing = [sys.executable, "-m", "tbatch.view.timeline.live_process", address.url, str(self._server.pid)]
        drawing += [str(self._record)] if self._record else []
        if self._log is None:
            self._feed = Feed(drawing)
        else:
            with open(self._log, "ab") as log:
                self._feed = Feed(drawing, log)
        self._say(address.advice())
        if self._window and has_display(os.environ, sys.platform):
            threading.Thread(target=self._open, args=(address.url,), daemon=True).start()

    def _open(self, url: str) -> None:
        """Opens a window; beside the campaign, since it takes seconds to know whether it could be opened."""
        try:
            yield_processor(connect_viewer(url, memory=MEMORY))
        except ViewerUnavailable as error:
            self._say(str(error))

    def _take(self, piece: Any, case_of: dict[int, int], every: float) -> None:
        """Collects what chunks add, over the static forces that the runs began with, and passes it on in pieces."""
        force = piece.channels["contact_force"]
        if piece.first == 0:
            self._pass_on()
            self._first_force = force[:, :1].copy()
        ratio = (force / self._first_force).astype(np.float32)
        for run, added in zip(piece.runs, ratio, strict=True):
            self._collected.setdefault(case_of[run], []).append(added)
        if self._first is None:
            self._first = (piece.first, every)
        if self._elapsed() - self._piece_began >= PIECE_INTERVAL:
            self._pass_on()

    def _pass_on(self) -> None:
        began, self._piece_began = self._piece_began, self._elapsed()
        if self._first is not None:
            first, every = self._first
            of_case = {case: np.concatenate(added) for case, added in self._collected.items()}
            self._put(Piece(began, self._piece_began, first, every, of_case))
        self._collected, self._first = {}, None

    def _tell_stored(self) -> None:
        if self._campaign is None:
            return
        store = self._campaign.store
        new = [shard for shard in store.manifest.shards if shard not in self._told]
        if not new:
            return
        files = {shard: store.manifest.shards[shard]["files"] for shard in new}
        found = [
            StoredShard(
                shard.case,
                shard.start,
                *(
                    (str(store.path(kind, shard).resolve()), files[shard][kind]["sha256"])
                    for kind in ("runs", "wheels")
                ),
            )
            for shard in sorted(new)
        ]
        if self._put(Stored(self._elapsed(), tuple(found))):
            self._told.update(new)

    def _put(self, news: News) -> bool:
        return self._feed is not None and self._feed.put(news)

    def _elapsed(self) -> float:
        return time.monotonic() - self._began

    def _end(self, reason: str = "") -> None:
        if reason:
            self._say(reason)
        feed, server = self._feed, self._server
        self._feed = self._server = None
        if feed is not None:
            feed.close(0.0 if reason else TO_FINISH if self._record else FAREWELL)
        if server is not None:
            server.kill()
            server.wait()


def yield_processor(pid: int) -> None:
    """Lets a process run only where nothing else wants to, as far as the system can."""
    if hasattr(os, "setpriority"):
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, pid, NICENESS)
