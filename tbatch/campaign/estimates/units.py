"""The stored tables as columns of runs: each run is one statistical unit, whatever wheels or speeds it gathers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

ANY_WHEELSET = 0
ALL_SPEEDS = -1

SUMS = ("evaluated_distance", "evaluated_time", "separations", "censored", "separated_time")
LARGEST = ("longest", "largest_gap", "largest_landing_force", "force_max", "force_20hz_max")
SMALLEST = ("force_min", "force_20hz_min")
HISTOGRAMS = ("histogram", "histogram_20hz")
EVENTS = ("start", "end", "position", "gap", "landing_force", "censored")
BELOW = "time_below_"


@dataclass(frozen=True, eq=False)
class Units:
    """The runs of one speed and wheelset, of any wheelset, or the samples of a whole campaign.

    A run in which the wheelset is never evaluated is no unit: it cannot show that contact is kept. Over several wheels,
    counts, times, distances and histograms are summed, and the largest and smallest taken.
    """

    sample: NDArray[np.int64]
    """sample of each unit, rising, shape (run,)"""
    columns: Mapping[str, NDArray[np.float64]]
    """the wheels table's numbers, and ratio_max, ratio_min, ratio_20hz_max, ratio_20hz_min [Q/Q0], shape (run,)"""
    histograms: Mapping[str, NDArray[np.float64]]
    """steps by Q/Q0, shape (run, bin)"""
    event_unit: NDArray[np.int64]
    """index of the unit of each separation, shape (event,)"""
    events: Mapping[str, NDArray[np.float64]]
    """start, end, duration [s], length, position, gap [m], landing_force [N], censored, shape (event,)"""
    inputs: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    """speed [m/s] and the varied numbers of each unit, shape (run,)"""

    def __len__(self) -> int:
        """Number of units."""
        return len(self.sample)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """A column; NaN where the store does not hold it."""
        return self.columns.get(name, np.full(len(self), math.nan))

    def first(self, count: int) -> "Units":
        """The first units only."""
        inside = self.event_unit < count
        return Units(
            self.sample[:count],
            {name: values[:count] for name, values in self.columns.items()},
            {name: values[:count] for name, values in self.histograms.items()},
            self.event_unit[inside],
            {name: values[inside] for name, values in self.events.items()},
            {name: values[:count] for name, values in self.inputs.items()},
        )


class Records:
    """The three tables of a campaign, diverged runs left out."""

    def __init__(self, runs: pa.Table, wheels: pa.Table, events: pa.Table) -> None:
        """Takes the tables, of which rows and columns may be few."""
        status = runs["status"].to_numpy()
        key = _key(runs["case"].to_numpy(), runs["sample"].to_numpy())
        self._runs = _numbers(runs)
        self._sound = np.sort(key[status == 0])
        self._run_order = np.argsort(key)
        self._run_key = key[self._run_order]
        self._wheels, self._wheel_key = self._kept(wheels)
        self._events, self._event_key = self._kept(events)
        self._lists = {name: _matrix(wheels[name]) for name in HISTOGRAMS if name in wheels.column_names}
        kept_wheels = np.isin(_key(wheels["case"].to_numpy(), wheels["sample"].to_numpy()), self._sound)
        self._list_row = np.flatnonzero(kept_wheels)
        load = self._wheels.get("static_load")
        if load is not None:
            for name in ("max", "min", "20hz_max", "20hz_min"):
                if f"force_{name}" in self._wheels:
                    self._wheels[f"ratio_{name}"] = self._wheels[f"force_{name}"] / load
        if "start" in self._events and "end" in self._events:
            self._events["duration"] = self._events["end"] - self._events["start"]
            self._events["length"] = self._events["duration"] * self._of_run("speed", self._event_key)

    @property
    def wheels(self) -> list[int]:
        """Numbers of the wheelsets, from 1 at the front."""
        return sorted(int(number) for number in np.unique(self._wheels["wheel"]))

    @property
    def varied(self) -> list[str]:
        """Names of the varied numbers: the columns of the runs table with a dotted key."""
        return [name for name in self._runs if "." in name]

    def units(self, case: int = ALL_SPEEDS, wheel: int = ANY_WHEELSET) -> Units:
        """The units of a speed and wheelset.

        Args:
            case: Index of the speed; ``ALL_SPEEDS`` gathers each sample's runs at all speeds, which share their
                irregularity, and takes the samples that have a sound run at every speed.
            wheel: Wheelset; ``ANY_WHEELSET`` for all of them together.
        """
        kept, key, sample = self._choice(self._wheels, self._wheel_key, case, wheel)
        if "evaluated_time" in self._wheels:  # a wheelset that never counts has not shown that it keeps contact
            met = self._wheels["evaluated_time"][kept] > 0.0
            kept, key, sample = kept[met], key[met], sample[met]
        kept_events, _, event_sample = self._choice(self._events, self._event_key, case, wheel)
        if case == ALL_SPEEDS:
            complete = self._complete_samples()
            keep = np.isin(sample, complete)
            kept, key, sample = kept[keep], key[keep], sample[keep]
            keep = np.isin(event_sample, complete)
            kept_events, event_sample = kept_events[keep], event_sample[keep]
        unit, row = np.unique(sample, return_inverse=True)
        columns: dict[str, NDArray[np.float64]] = {}
        for name, values in self._wheels.items():
            if name in SUMS or name.startswith(BELOW):
                columns[name] = np.bincount(row, values[kept], minlength=len(unit)).astype(float)
            elif name in LARGEST or (name.startswith("ratio") and name.endswith("max")):
                columns[name] = _extreme(np.fmax, -math.inf, row, values[kept], len(unit))
            elif name in SMALLEST or name.startswith("ratio"):
                columns[name] = _extreme(np.fmin, math.inf, row, values[kept], len(unit))
        histograms = {}
        for name, matrix in self._lists.items():
            total = np.zeros((len(unit), matrix.shape[1]))
            np.add.at(total, row, matrix[self._list_row[kept]])
            histograms[name] = total
        first = np.full(len(unit), -1)
        first[row[::-1]] = np.arange(len(key))[::-1]
        inputs = {name: self._of_run(name, key[first]) for name in ("speed", *self.varied) if name in self._runs}
        return Units(
            unit,
            columns,
            histograms,
            np.searchsorted(unit, event_sample),
            {name: values[kept_events] for name, values in self._events.items() if name not in ("case", "sample")},
            inputs,
        )

    def _choice(
        self, table: Mapping[str, NDArray[Any]], key: NDArray[np.int64], case: int, wheel: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        chosen = np.full(len(key), True)
        if case != ALL_SPEEDS:
            chosen &= table["case"] == case
        if wheel != ANY_WHEELSET:
            chosen &= table["wheel"] == wheel
        rows = np.flatnonzero(chosen)
        return rows, key[rows], table["sample"][rows].astype(np.int64)

    def _complete_samples(self) -> NDArray[np.int64]:
        sample, speeds = np.unique(self._sound & ((1 << 40) - 1), return_counts=True)
        return sample[speeds == len(np.unique(self._runs["case"]))]

    def _kept(self, table: pa.Table) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
        key = _key(table["case"].to_numpy(), table["sample"].to_numpy())
        sound = np.isin(key, self._sound)
        return {name: values[sound] for name, values in _numbers(table).items()}, key[sound]

    def _of_run(self, name: str, key: NDArray[np.int64]) -> NDArray[np.float64]:
        """A column of the runs table for the runs of some rows."""
        values = self._runs[name][self._run_order]
        return np.asarray(values[np.searchsorted(self._run_key, key)], float)


def _numbers(table: pa.Table) -> dict[str, NDArray[Any]]:
    return {
        name: np.asarray(table[name].to_numpy())
        for name, kind in zip(table.column_names, table.schema.types, strict=True)
        if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)
    }


def _matrix(column: pa.ChunkedArray) -> NDArray[Any]:
    """Lists of equal length, shape (row, entry); of the stored type, since this is most of what a campaign holds."""
    flat = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return np.asarray(flat.reshape(len(column), -1)) if len(column) else np.zeros((0, 0))


def _extreme(
    pick: np.ufunc, start: float, row: NDArray[np.int64], values: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    found = np.full(count, start)
    pick.at(found, row, values)
    return np.where(np.isfinite(found), found, math.nan)


def _key(case: NDArray[Any], sample: NDArray[Any]) -> NDArray[np.int64]:
    return case.astype(np.int64) << 40 | sample.astype(np.int64)
