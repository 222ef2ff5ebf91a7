"""Which runs are kept as recordings: the worst of each speed, chosen ones, or none."""

import numpy as np
import pyarrow as pa


def worst_runs(runs: pa.Table, wheels: pa.Table, count: int) -> list[tuple[int, int]]:
    """The ``count`` worst runs of each case as (case, sample), the worst first.

    Worst is the longest separation of any wheel, then the largest contact force, then the lower sample. Diverged runs
    have neither and are left out.

    Args:
        runs: Columns case, sample, status.
        wheels: Columns case, sample, longest [s], force_max [N].
        count: How many of each case.
    """
    sound = {
        (case, sample)
        for case, sample, status in zip(*(runs[name].to_pylist() for name in ("case", "sample", "status")), strict=True)
        if status == 0
    }
    grade: dict[tuple[int, int], tuple[float, float]] = {}
    columns = [wheels[name].to_pylist() for name in ("case", "sample", "longest", "force_max")]
    for case, sample, longest, force in zip(*columns, strict=True):
        if (case, sample) in sound:
            before = grade.get((case, sample), (0.0, 0.0))
            grade[case, sample] = (max(before[0], _number(longest)), max(before[1], _number(force)))
    chosen = []
    for case in sorted({case for case, _ in grade}):
        of_case = [(-longest, -force, sample) for (c, sample), (longest, force) in grade.items() if c == case]
        chosen += [(case, sample) for _, _, sample in sorted(of_case)[:count]]
    return chosen


def _number(value: float | None) -> float:
    return 0.0 if value is None or np.isnan(value) else value
