"""The accumulators of a simulation, laid out one after the other for each wheel."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tbatch.engine.kernels.accumulators import STANDARD, Accumulator


@dataclass(frozen=True)
class Statistics:
    """A list of accumulators and where each finds its rows."""

    accumulators: tuple[Accumulator, ...] = STANDARD

    @cached_property
    def _sizes(self) -> list[int]:
        """Real rows of each accumulator, a wheel."""
        return [len(one.start(1e-3, np.ones(1))) for one in self.accumulators]

    @property
    def rows(self) -> int:
        """Real rows a wheel."""
        return sum(self._sizes)

    @property
    def counters(self) -> int:
        """Whole-number rows a wheel."""
        return sum(one.counters for one in self.accumulators)

    @cached_property
    def places(self) -> np.ndarray:
        """First real row and first counter of each accumulator, int32, shape (accumulator, 2)."""
        counters = [one.counters for one in self.accumulators]
        return np.stack([_starts(self._sizes), _starts(counters)], axis=1).astype(np.int32)

    def start(self, step: float, load: np.ndarray) -> np.ndarray:
        """First values of all real rows of one wheel: from Δt [s] and P₀ [N], shape (run,); shape (row, run)."""
        return np.concatenate([one.start(step, load) for one in self.accumulators])

    def columns(self, step: float, load: np.ndarray, rows: np.ndarray, counts: np.ndarray) -> dict[str, np.ndarray]:
        """Results of all accumulators by name.

        Args:
            step: Δt [s].
            load: P₀ [N], shape (item,).
            rows: Real rows, shape (row, item).
            counts: Counters, shape (counter, item).
        """
        steps = rows[0]
        columns: dict[str, np.ndarray] = {"evaluated_time": steps * step}
        for one, size, (row, counter) in zip(self.accumulators, self._sizes, self.places, strict=True):
            own_rows, own_counts = rows[row : row + size], counts[counter : counter + one.counters]
            columns |= one.columns(step, load, own_rows, own_counts, steps)
        return columns


def _starts(sizes: Sequence[int]) -> np.ndarray:
    return np.cumsum([0, *sizes])[:-1]
