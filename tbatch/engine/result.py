"""Result: what a simulation gives back."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from tbatch.engine.rows import (
    EVENT_CENSORED,
    EVENT_END,
    EVENT_GAP,
    EVENT_LANDING,
    EVENT_POSITION,
    EVENT_START,
)

if TYPE_CHECKING:
    import pyarrow as pa

OK, DIVERGED = 0, 1


@dataclass(eq=False)
class Result:
    """Statistics, separations and the saved histories of some runs.

    Saved channels are attributes of their names: `contact_force` (run, n, wheel) [N], `vehicle` and
    `vehicle_acceleration` (run, n, dof), `irregularity`, `rail_under_wheel`, `slab_under_wheel` and `base_under_wheel`
    (run, n, wheel) [m], `rail`, `rail_acceleration`, `slab` and `base` (run, n, point). Histories are NaN after a run's
    end; with `SaveAt.runs`, run is one of those, in their order.
    """

    time: np.ndarray
    """Times of the samples [s], shape (n,)."""
    status: np.ndarray
    """0 ok, 1 diverged, shape (run,)."""
    steps: np.ndarray
    """Steps completed, shape (run,)."""
    separations: "pa.Table"
    """A row a separation: run, wheel (1 = front), start and end [s], position [m], gap [m], landing_force [N],
    censored."""
    summary: "pa.Table"
    """A row a run and wheel: evaluated time and distance, separations, forces, unloading, histograms of Q/Q0."""
    run_steps_per_second: float
    """Speed of the batch kernels, compilation left out."""
    channels: dict[str, np.ndarray] = field(default_factory=dict)
    """The saved histories by name."""

    def __getattr__(self, name: str) -> np.ndarray:
        channels = self.__dict__.get("channels", {})
        if name in channels:
            return channels[name]
        saved = ", ".join(channels) or "none"
        raise AttributeError(f"result.{name} was not saved (saved channels: {saved}); ask for it in SaveAt(channels=)")


def separation_table(events: np.ndarray, step: float) -> "pa.Table":
    """The table of separations, sorted by run, wheel and start.

    Args:
        events: Run, wheel from 0, then the columns of the event log, shape (event, 2 + column).
        step: Δt [s].
    """
    import pyarrow as pa

    order = np.lexsort((events[:, 2 + EVENT_START], events[:, 1], events[:, 0]))
    events = events[order]
    log = events[:, 2:]
    return pa.table(
        {
            "run": events[:, 0].astype(np.int32),
            "wheel": events[:, 1].astype(np.int32) + np.int32(1),
            "start": log[:, EVENT_START] * step,
            "end": log[:, EVENT_END] * step,
            "position": log[:, EVENT_POSITION],
            "gap": log[:, EVENT_GAP],
            "landing_force": log[:, EVENT_LANDING],
            "censored": log[:, EVENT_CENSORED] > 0.5,
        }
    )


def summary_table(
    events: np.ndarray, wheels: int, columns: dict[str, np.ndarray], load: np.ndarray, speed: np.ndarray, step: float
) -> "pa.Table":
    """The table with a row for each run and wheel.

    Args:
        events: As for `separation_table`.
        wheels: Number of wheels.
        columns: Results of the accumulators, shape (run * wheel, ...) each.
        load: P₀ [N], shape (run * wheel,).
        speed: Speed of each run [m/s], shape (run,).
        step: Δt [s].
    """
    import pyarrow as pa

    items = len(speed) * wheels
    item = (events[:, 0] * wheels + events[:, 1]).astype(np.int64)
    log = events[:, 2:]
    censored = log[:, EVENT_CENSORED] > 0.5
    longest, gap, landing = (np.zeros(items) for _ in range(3))
    duration = (log[:, EVENT_END] - log[:, EVENT_START]) * step
    np.maximum.at(longest, item[~censored], duration[~censored])
    np.maximum.at(gap, item, log[:, EVENT_GAP])
    np.maximum.at(landing, item, log[:, EVENT_LANDING])
    run, wheel = np.divmod(np.arange(items, dtype=np.int32), np.int32(wheels))
    table: dict[str, object] = {
        "run": run,
        "wheel": wheel + np.int32(1),
        "static_load": load,
        "evaluated_time": columns["evaluated_time"],
        "evaluated_distance": columns["evaluated_time"] * np.repeat(speed, wheels),
        "separations": np.bincount(item, minlength=items).astype(np.int32),
        "censored": np.bincount(item[censored], minlength=items).astype(np.int32),
        "longest": longest,
        "largest_gap": gap,
        "largest_landing_force": landing,
    }
    for name, values in columns.items():
        if values.ndim == 2:
            flat = pa.array(np.ascontiguousarray(values, np.int32).ravel())
            ends = pa.array(np.arange(items + 1, dtype=np.int32) * np.int32(values.shape[1]))
            table[name] = pa.ListArray.from_arrays(ends, flat)
        else:
            table[name] = values
    return pa.table(table)
