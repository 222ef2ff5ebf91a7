"""Separations and statistics of one run from its full history, by the rules of the engine's accumulators."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from tbatch.engine.rows import EVENT_COLUMNS


@dataclass(frozen=True, eq=False)
class ForceHistory:
    """Every step of one run, at t_0 ... t_n."""

    step: float
    """Δt [s]."""
    force: np.ndarray
    """F [N], shape (n + 1, wheel)."""
    overlap: np.ndarray
    """δ [m], shape (n + 1, wheel)."""
    position: np.ndarray
    """x_j [m], shape (n + 1, wheel)."""
    beyond: float
    """The evaluated part is x_j > beyond, after t_0 [m]."""
    load: np.ndarray
    """P₀ [N], shape (wheel,)."""
    separation: np.ndarray
    """δ_sep [m], shape (wheel,)."""

    @property
    def evaluated(self) -> np.ndarray:
        """Whether a step counts, shape (n, wheel)."""
        return self.position[1:] > self.beyond


def events(history: ForceHistory, landing_window: int) -> np.ndarray:
    """All separations, as the engine's event log has them.

    Args:
        history: The run.
        landing_window: Steps after a separation in which its landing force is sought.

    Returns:
        Run 0, wheel from 0, then the log's columns, shape (event, 2 + column).
    """
    found = []
    last = len(history.force) - 1
    for wheel in range(history.force.shape[1]):
        counts = np.flatnonzero(history.evaluated[:, wheel]) + 1
        if not counts.size:
            continue
        first = int(counts[0])
        apart = history.force[:, wheel] <= 0.0
        starts = [n for n in counts.tolist() if apart[n] and (n == first or not apart[n - 1])]
        for number, start in enumerate(starts):
            touching = np.flatnonzero(~apart[start:])
            landed = touching.size > 0
            end = start + int(touching[0]) if landed else last
            gaps = history.separation[wheel] - history.overlap[start : end + (not landed), wheel]
            until = min(end + landing_window, starts[number + 1] - 1 if number + 1 < len(starts) else last, last)
            landing = history.force[end : until + 1, wheel].max() if landed else 0.0
            censored = not landed or (start == first and bool(apart[first - 1]))
            log = (start, end, history.position[start, wheel], max(gaps.max(), 0.0), landing, float(censored))
            found.append((0.0, float(wheel), *log))
    return np.array(found).reshape(-1, 2 + EVENT_COLUMNS)


def columns(history: ForceHistory) -> dict[str, np.ndarray]:
    """What the engine's accumulators give, shape (wheel, ...) each."""
    # Importing the accumulators loads Taichi; they say which ratios and bins there are.
    from tbatch.engine.kernels.accumulators import BIN_WIDTH, BINS, RATIOS

    step, load, counted = history.step, history.load, history.evaluated
    force, steps = history.force[1:], counted.sum(axis=0)
    some = steps > 0

    def total(what: np.ndarray) -> np.ndarray:
        return np.where(counted, what, 0.0).sum(axis=0)

    def largest(what: np.ndarray) -> np.ndarray:
        return np.where(some, np.where(counted, what, -np.inf).max(axis=0, initial=-np.inf), np.nan)

    def histogram(what: np.ndarray) -> np.ndarray:
        ratio = np.divide(what, load, out=np.zeros_like(what), where=load > 0.0)
        place = np.floor(np.clip(ratio / BIN_WIDTH, 0.0, BINS - 1.0)).astype(np.int64)
        rows = [np.bincount(place[counted[:, j], j], minlength=BINS) for j in range(len(load))]
        return np.stack(rows)

    with np.errstate(invalid="ignore", divide="ignore"):
        mean = total(force - load) / steps
        variance = np.maximum(total((force - load) ** 2) / steps - mean**2, 0.0)
    smooth = low_passed(force, load, step)
    return {
        "evaluated_time": steps * step,
        "force_mean": load + mean,
        "force_std": np.sqrt(variance),
        "force_max": largest(force),
        "force_min": -largest(-force),
        "separated_time": total((force <= 0.0).astype(float)) * step,
        **{f"time_below_{ratio}": total((force < ratio * load).astype(float)) * step for ratio in RATIOS},
        "histogram": histogram(force),
        "force_20hz_max": largest(smooth),
        "force_20hz_min": -largest(-smooth),
        "histogram_20hz": histogram(smooth),
    }


def low_passed(force: np.ndarray, load: np.ndarray, step: float, cutoff: float = 20.0) -> np.ndarray:
    """The force after a fourth-order Butterworth low-pass, at rest under the static load before.

    Args:
        force: [N], shape (n, wheel).
        load: P₀ [N], shape (wheel,).
        step: Δt [s].
        cutoff: [Hz].
    """
    if cutoff >= 0.5 / step or not len(force):
        return force
    sections = butter(4, 2.0 * cutoff * step, output="sos")
    rest = sosfilt_zi(sections)[:, :, None] * load
    return sosfilt(sections, force, axis=0, zi=rest)[0]
