"""Estimates about the wheel load: largest and smallest force of a run, percentiles of Q/Q0, unloading.

Two families that are never mixed: the raw contact force, which knows separations, and the force after EN 14363's 20 Hz
low-pass, which hides them and may undershoot zero.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tbatch.campaign.estimates.estimate import FILTERED, RAW, Estimate
from tbatch.campaign.estimates.intervals import (
    finite,
    percentile_interval,
    quantile,
    resampled_sums,
    runs_needed,
)
from tbatch.campaign.estimates.separation import BOOTSTRAP, LARGEST_SEEN, probability_of, share
from tbatch.campaign.estimates.units import BELOW, Units

RUN_QUANTILES = (0.5, 0.95, 0.99, 0.9985)
"""Of the largest value of each run; of the smallest value their complements."""
TIME_QUANTILES = (0.0015, 0.5, 0.9985)
"""Of the steps of all runs."""
SECTION_QUANTILE = 0.9985
"""EN 14363 takes this percentile of a track section; a run is a section here."""
BIN_WIDTH = 0.05
"""Width of the stored bins of Q/Q0, as the engine's accumulators count them."""

ORDER = "order statistics over runs"


def load_estimates(units: Units) -> Iterator[Estimate]:
    """All of them for the runs of a speed and wheelset."""
    for family, infix, force in ((RAW, "", "contact_force"), (FILTERED, "20hz_", "force_20hz")):
        ratio = "load_ratio" if family == RAW else "load_ratio_20hz"
        if f"force_{infix}max" not in units.columns:
            continue
        yield from _extremes(force, units[f"force_{infix}max"], units[f"force_{infix}min"], family)
        if f"ratio_{infix}max" in units.columns:
            yield from _of_runs(ratio, units[f"ratio_{infix}max"], units[f"ratio_{infix}min"], family)
        histogram = units.histograms.get("histogram" if family == RAW else "histogram_20hz")
        if histogram is not None and histogram.size and f"ratio_{infix}max" in units.columns:
            yield from _of_time(ratio, histogram, family)
            section = section_percentiles(histogram, units[f"ratio_{infix}max"], SECTION_QUANTILE)
            for probability in RUN_QUANTILES[:2]:
                yield _over_runs(f"{ratio}.section_p99.85.p{_percent(probability)}", section, probability, family)
    time = units["evaluated_time"]
    for name in units.columns:
        if name.startswith(BELOW):
            below = name.removeprefix(BELOW)
            yield share(f"unloading.share_below_{below}", units[name], time)
            yield probability_of(f"unloading.probability_below_{below}", units[name] > 0.0)


def section_percentiles(
    histogram: NDArray[np.float64], largest: NDArray[np.float64], probability: float
) -> NDArray[np.float64]:
    """A percentile of the steps of each run, from its bins of Q/Q0: right to a bin's width, never above the largest.

    Args:
        histogram: Steps by bin, shape (run, bin); the last bin holds all above.
        largest: Largest Q/Q0 of each run, shape (run,).
        probability: Which percentile.
    """
    total = histogram.sum(axis=1)
    below = np.cumsum(histogram, axis=1)
    place = np.argmax(below >= probability * total[:, None] - 1e-9, axis=1)
    row = np.arange(len(histogram))
    inside = np.maximum(histogram[row, place], 1.0)
    share_of_bin = 1.0 - (below[row, place] - probability * total) / inside
    value = np.minimum((place + share_of_bin) * BIN_WIDTH, largest)
    value = np.where(place == histogram.shape[1] - 1, largest, value)
    return np.where(total > 0.0, value, math.nan)


def _extremes(
    name: str, largest: NDArray[np.float64], smallest: NDArray[np.float64], family: str
) -> Iterator[Estimate]:
    runs = len(finite(largest))
    high = float(np.nanmax(largest)) if runs else math.nan
    low = float(np.nanmin(smallest)) if runs else math.nan
    yield Estimate(f"{name}.max", "N", high, high, math.inf, LARGEST_SEEN, runs, family=family)
    yield Estimate(f"{name}.min", "N", low, -math.inf, low, "smallest seen", runs, family=family)


def _of_runs(name: str, largest: NDArray[np.float64], smallest: NDArray[np.float64], family: str) -> Iterator[Estimate]:
    for probability in RUN_QUANTILES:
        yield _over_runs(f"{name}.max.p{_percent(probability)}", largest, probability, family)
    for probability in RUN_QUANTILES:
        rest = 1.0 - probability
        yield _over_runs(f"{name}.min.p{_percent(rest)}", smallest, rest, family)


def _over_runs(name: str, values: NDArray[np.float64], probability: float, family: str) -> Estimate:
    value, low, high = quantile(values, probability)
    runs = len(finite(values))
    return Estimate(name, "", value, low, high, ORDER, runs, runs_needed=runs_needed(probability), family=family)


def _of_time(name: str, histogram: NDArray[np.float64], family: str) -> Iterator[Estimate]:
    """Percentiles over the steps of all runs; steps of a run hang together, so runs are resampled."""
    used = np.flatnonzero(histogram.any(axis=0))
    if not len(used):
        return
    last = histogram.shape[1] - 1
    columns = histogram[:, : used[-1] + 1]
    resampled = resampled_sums(columns)
    for probability in TIME_QUANTILES:
        value = _bin_quantile(columns.sum(axis=0)[None, :], probability, last)[0]
        low, high = percentile_interval(_bin_quantile(resampled, probability, last))
        yield Estimate(
            f"{name}.p{_percent(probability)}", "", float(value), low, high, BOOTSTRAP, len(histogram), family=family
        )


def _bin_quantile(steps: NDArray[np.float64], probability: float, last: int) -> NDArray[np.float64]:
    """Quantile of Q/Q0 from counts by bin, shape (..., bin): linear within a bin; inf in the open last one."""
    total = steps.sum(axis=1)
    below = np.cumsum(steps, axis=1)
    place = np.argmax(below >= probability * total[:, None] - 1e-9, axis=1)
    row = np.arange(len(steps))
    inside = np.maximum(steps[row, place], 1e-300)
    value = (place + 1.0 - (below[row, place] - probability * total) / inside) * BIN_WIDTH
    return np.where(total > 0.0, np.where(place == last, math.inf, value), math.nan)


def _percent(probability: float) -> str:
    return f"{round(100.0 * probability, 6):g}"
