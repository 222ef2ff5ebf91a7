"""Statistics gathered while a run is stepped: a list of accumulators, each with its own rows.

An accumulator is one frozen dataclass: how many rows it needs a wheel, what they hold at the start, the `@ti.func` that
updates them at every step end, and the columns it gives at the end. To add one, write it here and name it in
`standard`. The kernel calls `update(memory, marks, b, row, mark, force, load, on)`: the wheel's first real row, its
first counter row, its contact force [N], its static load [N] and 1 for the lanes whose evaluation is running.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import taichi as ti

from tbatch.engine.rows import LANES
from tbatch.numerics.low_pass import rest_delays, sections

RATIOS = (0.1, 0.2, 0.4, 0.6, 0.8)
"""Values of Q/Q0 below which time is counted."""
BIN_WIDTH = 0.05
"""Width of the Q/Q0 bins [-]."""
BINS = 101
"""Bins of Q/Q0: 0 to 5 in steps of `BIN_WIDTH`, and one for all above."""


class Accumulator(Protocol):
    """What the engine asks of a statistic."""

    @property
    def counters(self) -> int:
        """Whole-number rows a wheel."""
        ...

    @property
    def update(self) -> Any:
        """The `@ti.func` called at each step end."""
        ...

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """First values of the real rows: from Δt [s] and P₀ [N], shape (run,); shape (row, run)."""
        ...

    def columns(
        self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray, steps: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Results by name: from Δt [s], P₀ [N], the rows (row, item), the counters and the evaluated steps (item,)."""
        ...


@ti.func
def update_extrema(memory: ti.template(), marks: ti.template(), b, row, mark, force, load, on):
    """Largest and smallest force so far."""
    memory[b, row] = ti.select(on > 0.5, ti.max(memory[b, row], force), memory[b, row])
    memory[b, row + 1] = ti.select(on > 0.5, ti.min(memory[b, row + 1], force), memory[b, row + 1])


@dataclass(frozen=True)
class Extrema:
    """Largest and smallest contact force."""

    counters: int = 0

    @property
    def update(self) -> Any:
        """Rows: maximum, minimum [N]."""
        return update_extrema

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """-inf and inf."""
        return np.stack([np.full_like(load, -np.inf), np.full_like(load, np.inf)])

    def columns(
        self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray, steps: np.ndarray
    ) -> dict[str, np.ndarray]:
        """`force_max` and `force_min` [N], NaN where nothing was evaluated."""
        return {
            "force_max": np.where(steps > 0, rows[0], np.nan),
            "force_min": np.where(steps > 0, rows[1], np.nan),
        }


@ti.func
def update_moments(memory: ti.template(), marks: ti.template(), b, row, mark, force, load, on):
    """Evaluated steps, and sums of the force's difference from the static load and of its square."""
    difference = force - load
    memory[b, row] = memory[b, row] + on
    memory[b, row + 1] = memory[b, row + 1] + ti.select(on > 0.5, difference, 0.0 * on)
    memory[b, row + 2] = memory[b, row + 2] + ti.select(on > 0.5, difference * difference, 0.0 * on)


@dataclass(frozen=True)
class Moments:
    """Mean and standard deviation of the contact force over the evaluated steps. Row 0 counts those steps."""

    counters: int = 0

    @property
    def update(self) -> Any:
        """Rows: steps, Σ (F - P₀) [N], Σ (F - P₀)² [N²]."""
        return update_moments

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """Zeros."""
        return np.zeros((3, len(load)))

    def columns(
        self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray, steps: np.ndarray
    ) -> dict[str, np.ndarray]:
        """`force_mean` and `force_std` (population) [N]."""
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = rows[1] / steps
            variance = np.maximum(rows[2] / steps - mean**2, 0.0)
        return {"force_mean": load + mean, "force_std": np.sqrt(variance)}


@ti.func
def update_unloading(memory: ti.template(), marks: ti.template(), b, row, mark, force, load, on):
    """Steps without contact, then steps below each ratio of the static load."""
    memory[b, row] = memory[b, row] + ti.select(force <= 0.0, on, 0.0 * on)
    for place in ti.static(range(len(RATIOS))):
        below = ti.select(force < RATIOS[place] * load, on, 0.0 * on)
        memory[b, row + 1 + place] = memory[b, row + 1 + place] + below


@dataclass(frozen=True)
class Unloading:
    """Time without contact and time with Q/Q0 below given ratios."""

    counters: int = 0

    @property
    def update(self) -> Any:
        """Rows: steps with F = 0, then steps below each of `RATIOS`."""
        return update_unloading

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """Zeros."""
        return np.zeros((1 + len(RATIOS), len(load)))

    def columns(
        self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray, steps: np.ndarray
    ) -> dict[str, np.ndarray]:
        """`separated_time` and `time_below_<ratio>` [s]."""
        below = {f"time_below_{ratio}": rows[1 + place] * step for place, ratio in enumerate(RATIOS)}
        return {"separated_time": rows[0] * step} | below


@ti.func
def count_bins(memory: ti.template(), marks: ti.template(), b, ratio, mark, on):
    """Add one to the bin of each lane's Q/Q0, held in memory row `ratio`, where row `on` is 1."""
    for lane in range(LANES):
        if memory[b, on][lane] > 0.5:
            # Clamped as a real number first: a huge ratio has no int32.
            place = int(ti.floor(ti.min(ti.max(memory[b, ratio][lane] / BIN_WIDTH, 0.0), BINS - 1.0)))
            marks[b, mark + place, lane] = marks[b, mark + place, lane] + 1


@ti.func
def update_histogram(memory: ti.template(), marks: ti.template(), b, row, mark, force, load, on):
    """Whole-number histogram of Q/Q0."""
    memory[b, row] = ti.select(load > 0.0, force / load, 0.0 * load)
    memory[b, row + 1] = on
    count_bins(memory, marks, b, row, mark, row + 1)


@dataclass(frozen=True)
class Histogram:
    """Histogram of Q/Q0 over the evaluated steps."""

    counters: int = BINS

    @property
    def update(self) -> Any:
        """Rows: Q/Q0 and the mask of the step in hand. Counters: the bins."""
        return update_histogram

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """Zeros."""
        return np.zeros((2, len(load)))

    def columns(
        self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray, steps: np.ndarray
    ) -> dict[str, np.ndarray]:
        """`histogram`: counts, shape (item, bin)."""
        return {"histogram": counts.T}


@ti.func
def update_low_pass(memory: ti.template(), marks: ti.template(), b, row, mark, force, load, on):
    """Filter the force, whether evaluated or not; extrema and histogram of the result where evaluated."""
    signal = force
    for section in range(2):
        c = row + 7 * section
        out = memory[b, c] * signal + memory[b, c + 5]
        memory[b, c + 5] = (memory[b, c + 1] * signal - memory[b, c + 3] * out) + memory[b, c + 6]
        memory[b, c + 6] = memory[b, c + 2] * signal - memory[b, c + 4] * out
        signal = out
    memory[b, row + 14] = ti.select(on > 0.5, ti.max(memory[b, row + 14], signal), memory[b, row + 14])
    memory[b, row + 15] = ti.select(on > 0.5, ti.min(memory[b, row + 15], signal), memory[b, row + 15])
    memory[b, row + 16] = ti.select(load > 0.0, signal / load, 0.0 * load)
    memory[b, row + 17] = on
    count_bins(memory, marks, b, row + 16, mark, row + 17)


@dataclass(frozen=True)
class LowPass:
    """The force after a fourth-order Butterworth low-pass at 20 Hz, as EN 14363 processes wheel forces.

    It hides separations and may undershoot below zero; it is kept apart from the raw contact force and never clipped.
    """

    counters: int = BINS
    cutoff: float = 20.0
    """Cut-off frequency [Hz]."""

    @property
    def update(self) -> Any:
        """Rows: two sections of b₀ b₁ b₂ a₁ a₂ and two delays, maximum, minimum, Q/Q0, mask. Counters: the bins."""
        return update_low_pass

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """Coefficients for this step, delays at rest under the static load."""
        rows = np.zeros((18, len(load)))
        # A step too long to hold 20 Hz passes the force as it is.
        passing = np.array([[1.0, 0.0, 0.0, 0.0, 0.0]] * 2)
        for number, section in enumerate(sections(self.cutoff, step) if self.cutoff < 0.5 / step else passing):
            rows[7 * number : 7 * number + 5] = section[:, None]
            rows[7 * number + 5 : 7 * number + 7] = rest_delays(section)[:, None] * load
        rows[14], rows[15] = -np.inf, np.inf
        return rows

    def columns(
        self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray, steps: np.ndarray
    ) -> dict[str, np.ndarray]:
        """`force_20hz_max`, `force_20hz_min` [N] and `histogram_20hz`, counts of the filtered Q/Q0."""
        return {
            "force_20hz_max": np.where(steps > 0, rows[14], np.nan),
            "force_20hz_min": np.where(steps > 0, rows[15], np.nan),
            "histogram_20hz": counts.T,
        }


STANDARD: tuple[Accumulator, ...] = (Moments(), Extrema(), Unloading(), Histogram(), LowPass())
"""What every run keeps, in the order of its rows. `Moments` comes first: its row 0 counts the evaluated steps."""
