"""How often wheels leave the rail: per speed and wheelset, from the runs and wheels tables.

The run is the statistical unit. The probability is that of a run of the evaluated length to hold at least one
separation, with the exact (Clopper-Pearson) interval; rates use each wheel's own evaluated distance
(wheelset-kilometres), with the bootstrap over runs. Diverged runs are left out of everything and counted beside it.
``tbatch.campaign.estimates`` has all the other estimates.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from tbatch.campaign.estimates.intervals import CONFIDENCE, exact_interval, rate_interval
from tbatch.campaign.estimates.units import ANY_WHEELSET

__all__ = ["ANY_WHEELSET", "CONFIDENCE", "STATISTICS_SCHEMA", "exact_interval", "separation_statistics"]

TablesOf = Callable[[int], tuple[pa.Table, pa.Table]]

RUN_COLUMNS = ("sample", "status", "evaluated_length")
WHEEL_COLUMNS = (
    "sample",
    "wheel",
    "evaluated_distance",
    "separations",
    "censored",
    "separated_time",
    "evaluated_time",
    "longest",
    "largest_gap",
    "largest_landing_force",
    "force_max",
    "force_min",
)

STATISTICS_SCHEMA = pa.schema(
    [
        ("case", pa.int32()),  # index of the speed
        ("speed", pa.float64()),  # m/s
        ("wheel", pa.int32()),  # 1 is the front wheelset, 0 is any wheelset
        ("runs", pa.int64()),  # runs that count: all in which the wheelset is evaluated, but the diverged
        ("diverged", pa.int64()),
        ("separated_runs", pa.int64()),  # runs with at least one separation
        ("probability", pa.float64()),  # separated_runs / runs, per run of the evaluated length
        ("probability_low", pa.float64()),  # exact 95 % interval
        ("probability_high", pa.float64()),
        ("separations", pa.int64()),
        ("censored", pa.int64()),  # those open at the start or the end of the evaluated part
        ("evaluated_length", pa.float64()),  # per run, of wheel 1, m
        ("evaluated_distance", pa.float64()),  # of all runs, wheelset-metres, m
        ("separations_per_km", pa.float64()),  # per wheelset-kilometre
        ("separations_per_km_low", pa.float64()),  # 95 % interval, by the bootstrap over runs
        ("separations_per_km_high", pa.float64()),
        ("separated_time", pa.float64()),  # s
        ("separated_share", pa.float64()),  # of the evaluated time
        ("longest", pa.float64()),  # longest separation that is not censored, s
        ("largest_gap", pa.float64()),  # m
        ("largest_landing_force", pa.float64()),  # N
        ("force_max", pa.float64()),  # N
        ("force_min", pa.float64()),  # N
    ]
)


def separation_statistics(tables_of: TablesOf, speeds: Sequence[float], wheels: Sequence[int]) -> pa.Table:
    """Statistics of the separations, a row per speed and wheelset; of the tables, one speed's is held at a time.

    Args:
        tables_of: Of a case, a row per run, columns ``RUN_COLUMNS``, and a row per run and wheel, ``WHEEL_COLUMNS``.
        speeds: Speed of each case [m/s].
        wheels: Wheelsets, from 1 at the front; ``ANY_WHEELSET`` for any of them.
    """
    rows = []
    for case, speed in enumerate(speeds):
        runs, table = tables_of(case)
        run = {name: runs[name].to_numpy() for name in RUN_COLUMNS}
        wheel = {name: table[name].to_numpy() for name in WHEEL_COLUMNS}
        diverged = run["status"] != 0
        sound = ~np.isin(wheel["sample"], run["sample"][diverged])
        lengths = run["evaluated_length"]
        # A wheelset that is too far behind to be evaluated has not shown that it keeps contact.
        sound &= wheel["evaluated_time"] > 0.0
        for number in wheels:
            chosen = sound if number == ANY_WHEELSET else sound & (wheel["wheel"] == number)
            part = {name: column[chosen] for name, column in wheel.items()}
            count = len(np.unique(part["sample"]))
            separated = len(np.unique(part["sample"][part["separations"] > 0]))
            low, high = exact_interval(separated, count)
            rows.append(
                {
                    "case": case,
                    "speed": float(speed),
                    "wheel": number,
                    "runs": count,
                    "diverged": int(np.count_nonzero(diverged)),
                    "separated_runs": separated,
                    "probability": separated / count if count else math.nan,
                    "probability_low": low,
                    "probability_high": high,
                    "evaluated_length": float(lengths.mean()) if len(lengths) else math.nan,
                    **_estimates(part),
                }
            )
    return pa.Table.from_pylist(rows, schema=STATISTICS_SCHEMA)


def _estimates(part: dict[str, NDArray[Any]]) -> dict[str, float | int]:
    """What the rows of one case and wheelset (or of all its wheelsets) say."""
    distance = math.fsum(part["evaluated_distance"])
    time = math.fsum(part["evaluated_time"])
    separated_time = math.fsum(part["separated_time"])
    count = int(part["separations"].sum())
    sample, run = np.unique(part["sample"], return_inverse=True)
    of_run = [
        np.bincount(run, part[name].astype(float), len(sample)).astype(float)
        for name in ("separations", "evaluated_distance")
    ]
    low, high = rate_interval(of_run[0], of_run[1] / 1e3, 1.0)
    return {
        "separations": count,
        "censored": int(part["censored"].sum()),
        "evaluated_distance": distance,
        "separations_per_km": 1e3 * count / distance if distance > 0.0 else math.nan,
        "separations_per_km_low": low,
        "separations_per_km_high": high,
        "separated_time": separated_time,
        "separated_share": separated_time / time if time > 0.0 else math.nan,
        "longest": _largest(part["longest"], 0.0),
        "largest_gap": _largest(part["largest_gap"], 0.0),
        "largest_landing_force": _largest(part["largest_landing_force"], 0.0),
        "force_max": _largest(part["force_max"], math.nan),
        "force_min": -_largest(-part["force_min"], math.nan),
    }


def _largest(values: NDArray[Any], otherwise: float) -> float:
    """The largest number; a wheel that met nothing evaluated has NaN and does not count."""
    finite = values[~np.isnan(values)]
    return float(finite.max()) if len(finite) else otherwise
