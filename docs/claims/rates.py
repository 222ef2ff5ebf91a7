"""Separations per wheelset-kilometre of a campaign, with intervals: python docs/claims/rates.py RESULTS.

A sample's wheelsets go together: the 95 % intervals come from resampling whole samples.
"""

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

RESAMPLINGS = 4000


def rates(folder: Path) -> None:
    """Print a line a speed: the rate of each wheelset, and leading to trailing of each bogie."""
    table = pq.read_table(sorted((folder / "wheels").glob("*.parquet")))
    case, sample, wheel, count, distance = (
        table[name].to_numpy() for name in ("case", "sample", "wheel", "separations", "evaluated_distance")
    )
    rng = np.random.default_rng(0)
    for one in np.unique(case):
        here = case == one
        shape = sample[here].max() + 1, wheel.max()
        counts, kilometres = np.zeros(shape), np.zeros(shape)
        counts[sample[here], wheel[here] - 1] = count[here]
        kilometres[sample[here], wheel[here] - 1] = distance[here] * 1e-3
        drawn = rng.integers(0, shape[0], (RESAMPLINGS, shape[0]))
        rate = counts.sum(0) / kilometres.sum(0)
        resampled = counts[drawn].sum(1) / kilometres[drawn].sum(1)
        cells = [shown(rate[j], resampled[:, j]) for j in range(shape[1])]
        for lead in range(0, shape[1] - 1, 2):
            if resampled[:, lead + 1].all():
                cells.append(shown(rate[lead] / rate[lead + 1], resampled[:, lead] / resampled[:, lead + 1]))
        print(f"case {one}: " + "  ".join(cells))


def shown(value: float, resampled: np.ndarray) -> str:
    """A number with its 95 % interval."""
    low, high = np.percentile(resampled, [2.5, 97.5])
    return f"{value:.3g} ({low:.3g}-{high:.3g})"


if __name__ == "__main__":
    rates(Path(sys.argv[1]))
