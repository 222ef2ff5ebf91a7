"""What a live view draws: a campaign's probabilities as they settle, and the forces of a few of its runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from tbatch.view import palette
from tbatch.view.live.counts import SpeedCounts, read_shards
from tbatch.view.live.news import Batch, Began, News, Piece, State, Stored
from tbatch.view.thinning import extremes
from tbatch.view.timeline.live_dashboard import ELAPSED, RUNS, Chart, live_dashboard, speed_colour, speed_name

STRIP_INTERVAL = 0.5e-3  # simulated time of which a strip shows the least and the largest value [s]
RATE_WINDOW = 5.0  # over which the throughput is taken [s]
BIN_WIDTH, BINS_SHOWN = 0.05, 70  # of the histogram of Q/Q0
KMH = 3.6


class LiveRecording:
    """Draws the news of one campaign into a recording stream."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        """Takes the stream, whose sinks are set."""
        self._stream = stream
        self._began: Began | None = None
        self._counts: list[SpeedCounts] = []
        self._chart = Chart(())
        self._names: dict[int, str] = {}
        self._off: dict[tuple[int, int], float] = {}  # since when a followed wheel is off, by case and wheel [s]
        self._states: list[tuple[float, int]] = []
        self._state_text = ""
        self._wheels = 0
        self._looking: set[int] = set()  # cases whose strips have their look

    def draw(self, news: News) -> None:
        """Draws one piece of news."""
        if isinstance(news, Began):
            self._begin(news)
        elif isinstance(news, Batch):
            self._batch(news)
        elif isinstance(news, Piece):
            self._piece(news)
        elif isinstance(news, State):
            self._state(news)
        else:
            self._stored(news)

    def _begin(self, began: Began) -> None:
        self._began = began
        self._counts = [SpeedCounts() for _ in began.speeds]
        self._chart = Chart(tuple(speed * KMH for speed in began.speeds))
        stream = self._stream
        stream.send_recording_name(f"{began.name}, live")
        stream.send_blueprint(live_dashboard(began, self._chart), make_active=True, make_default=True)
        for place, case in enumerate(began.followed):
            colour = speed_colour(place)
            name = speed_name(began, case)
            look = rr.SeriesLines(
                names=[name, f"{name}, low", f"{name}, high"],
                colors=[colour] * 3,
                widths=[2.0, 0.8, 0.8],
                aggregation_policy="MinMax",
            )
            stream.log(f"probability/{case}", look, static=True, strict=True)
        rate = rr.SeriesLines(names="1000 run-steps/s", colors=[palette.RAIL], aggregation_policy="MinMax")
        stream.log("throughput", rate, static=True, strict=True)
        self._chart.send_frame(stream)
        self._text([0.0], [f"{began.name}: {len(began.speeds)} speeds, folder {began.folder}"])

    def _batch(self, batch: Batch) -> None:
        assert self._began is not None
        for case in batch.runs:
            if self._wheels:  # a gap before the next run, which has nothing to do with the one before
                self._strip(case, np.array([batch.elapsed]), np.full((1, self._wheels), np.nan))
        texts = [f"{name} at {speed_name(self._began, case)} begins" for case, name in batch.runs.items()]
        self._text([batch.elapsed] * len(texts), texts)
        self._names.update(batch.runs)
        self._off.clear()

    def _piece(self, piece: Piece) -> None:
        for case, ratio in piece.ratio.items():
            chunk = len(ratio)
            ratio = ratio[np.isfinite(ratio).all(axis=1)]
            if not len(ratio):
                continue
            at = piece.began + (piece.ended - piece.began) * (np.arange(len(ratio)) + 1) / chunk
            blocks = np.arange(0, len(ratio), max(1, round(STRIP_INTERVAL / piece.every)))
            if case not in self._looking:
                self._looking.add(case)
                self._looks(case, range(ratio.shape[1]))
            samples, rows = extremes(ratio.astype(float), blocks)
            self._strip(case, at[samples], rows)
            self._separations(case, ratio, at, piece)

    def _strip(self, case: int, at: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Sends a stretch of the forces of one run."""
        self._wheels = rows.shape[1]
        columns = rr.Scalars.columns(scalars=rows.ravel()).partition(np.full(len(at), self._wheels))
        self._stream.send_columns(f"forces/{case}/wheels", [_elapsed(at)], columns, strict=True)

    def _looks(self, case: int, wheels: range) -> None:
        """Sends how the forces of a speed are drawn."""
        lines = rr.SeriesLines(
            names=[f"wheel {j + 1}" for j in wheels],
            colors=[palette.wheel_colour(j) for j in wheels],
            widths=[1.3] * len(wheels),
            aggregation_policy="MinMax",
        )
        marks = rr.SeriesPoints(colors=[palette.WARNING], markers=["diamond"], marker_sizes=[4.0], names=["separation"])
        self._stream.log(f"forces/{case}/wheels", lines, static=True, strict=True)
        self._stream.log(f"forces/{case}/separation", marks, static=True, strict=True)

    def _separations(self, case: int, ratio: NDArray[np.float32], at: NDArray[np.float64], piece: Piece) -> None:
        """Marks where followed wheels lose contact, and says for how long when they are back."""
        marks: list[float] = []
        lines: list[tuple[float, str, palette.Colour]] = []
        for wheel, off in enumerate((ratio == 0.0).T):
            changes = np.flatnonzero(np.diff(off.astype(np.int8), prepend=np.int8((case, wheel) in self._off)))
            for change in changes:
                simulated = (piece.first + int(change)) * piece.every
                if off[change]:
                    self._off[case, wheel] = simulated
                    marks.append(float(at[change]))
                elif (since := self._off.pop((case, wheel), None)) is not None:
                    lasted = f"off for {1e3 * (simulated - since):.1f} ms at {since:.3f} s"
                    text = f"{self._names.get(case, '')}: wheel {wheel + 1} {lasted}"
                    lines.append((float(at[change]), text, palette.wheel_colour(wheel)))
        # Whatever is sent costs a millisecond, however little it is.
        if marks:
            marks.sort()
            zeros = rr.Scalars.columns(scalars=np.zeros(len(marks)))
            self._stream.send_columns(f"forces/{case}/separation", [_elapsed(marks)], zeros, strict=True)
        if lines:
            lines.sort()
            self._text([when for when, _, _ in lines], [text for _, text, _ in lines], [c for _, _, c in lines])

    def _state(self, state: State) -> None:
        self._states = [one for one in self._states if one[0] > state.elapsed - RATE_WINDOW]
        self._states.append((state.elapsed, state.run_steps_done))
        (first, before), (last, after) = self._states[0], self._states[-1]
        if last > first and after > before:
            self._stream.set_time(ELAPSED, duration=state.elapsed)
            self._stream.log("throughput", rr.Scalars(1e-3 * (after - before) / (last - first)), strict=True)
        for case in self._began.followed if self._began is not None else ():
            self._probability(case, state.elapsed)  # the lines reach to the cursor
        done = f"{state.runs_done} of {state.runs_total} runs stored, {state.separations} separations"
        if state.phase != "running":
            done = f"{state.phase}; {done}"
        self._table(state.elapsed, done)

    def _stored(self, stored: Stored) -> None:
        began = self._began
        assert began is not None
        for case, path in read_shards(stored.shards, self._counts).items():
            if case in began.followed and path:
                rows = np.array(path)
                bounds = rr.Scalars.columns(scalars=rows[:, 1:].ravel()).partition(np.full(len(rows), 3))
                runs = rr.TimeColumn(RUNS, sequence=rows[:, 0].astype(np.int64))
                # On the time line of runs the whole path, on the clock what is known by now.
                self._stream.send_columns(f"probability/{case}", [runs], bounds, strict=True)
                self._probability(case, stored.elapsed)
            self._histogram(stored.elapsed, case)
        self._stream.set_time(ELAPSED, duration=stored.elapsed)
        self._chart.send(self._stream, self._counts)
        self._table(stored.elapsed, "")

    def _probability(self, case: int, elapsed: float) -> None:
        """Sends what is known by now of the probability at a speed."""
        if self._counts[case].runs:
            now = rr.Scalars.columns(scalars=self._counts[case].probability).partition([3])
            self._stream.send_columns(f"probability/{case}", [_elapsed([elapsed])], now, strict=True)

    def _histogram(self, elapsed: float, case: int) -> None:
        assert self._began is not None
        counts = self._counts[case].histogram
        if case not in self._began.followed or not counts.sum():
            return
        shown = 100.0 * counts[:BINS_SHOWN] / counts.sum()
        middles = BIN_WIDTH * (np.arange(len(shown)) + 0.5)
        self._stream.set_time(ELAPSED, duration=elapsed)
        colour, widths = speed_colour(self._began.followed.index(case)), np.full(len(shown), BIN_WIDTH)
        bars = rr.BarChart(shown, abscissa=middles, widths=widths, color=colour)
        self._stream.log(f"histogram/{case}", bars, strict=True)

    def _table(self, elapsed: float, state: str) -> None:
        """Writes the numbers as a page; the state of before where there is none new."""
        assert self._began is not None
        self._state_text = state or self._state_text
        lines = [
            f"**{self._began.name}**: {self._state_text}",
            "",
            "| km/h | runs | with separation | p | 95 % | per km |",
        ]
        lines += ["|---:|---:|---:|---:|---|---:|"]
        for speed, counts in zip(self._began.speeds, self._counts, strict=True):
            p, low, high = counts.probability
            if counts.runs:
                rate = f"{1e3 * counts.separations / counts.distance:.3g}" if counts.distance else "-"
                cells = [f"{speed * KMH:.4g}", f"{counts.runs}", f"{counts.separated}", f"{p:.4f}"]
                lines.append("| " + " | ".join([*cells, f"{low:.4f} to {high:.4f}", rate]) + " |")
        self._stream.set_time(ELAPSED, duration=elapsed)
        self._stream.log("table", rr.TextDocument("\n".join(lines) + "\n", media_type="text/markdown"), strict=True)

    def _text(self, elapsed: Sequence[float], texts: Sequence[str], colours: Sequence[palette.Colour] = ()) -> None:
        """Sends lines of the log; with a colour they are warnings."""
        level = "WARN" if colours else "INFO"
        looks = list(colours) or [palette.RAIL] * len(texts)
        columns = rr.TextLog.columns(text=list(texts), level=[level] * len(texts), color=looks)
        self._stream.send_columns("log", [_elapsed(elapsed)], columns, strict=True)


def _elapsed(at: NDArray[np.float64] | Sequence[float]) -> rr.TimeColumn:
    return rr.TimeColumn(ELAPSED, duration=np.round(np.asarray(at) * 1e9).astype("timedelta64[ns]"))
