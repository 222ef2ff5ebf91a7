"""The three tables of a campaign: runs, wheels and events, made from the results of a batch.

``runs`` has a row per run (inputs, status, steps), ``wheels`` a row per run and wheel (every column of
``Result.summary``), ``events`` a row per separation (every column of ``Result.separations``). SI units; a run is
(case, sample), wheels count from 1 at the front.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pyarrow as pa

from tbatch.campaign.shards import Shard
from tbatch.scenario.run_name import run_name

if TYPE_CHECKING:
    from tbatch.scenario import Scenario

KINDS = ("runs", "wheels", "events")

RUN_SCHEMA = pa.schema(
    [
        ("case", pa.int32()),  # index of the speed
        ("sample", pa.int64()),
        ("name", pa.string()),  # the printed id, c03-s000127
        ("speed", pa.float64()),  # m/s
        ("seed", pa.int64()),
        ("status", pa.int32()),  # 0 = ok, 1 = diverged
        ("steps", pa.int64()),  # time steps done
        ("duration", pa.float64()),  # simulated time asked for, s
        ("evaluated_length", pa.float64()),  # length over which wheel 1 counts, m
    ]
)


class BatchResult(Protocol):
    """What a campaign needs of ``tbatch.engine.Result``."""

    status: Any
    steps: Any
    summary: pa.Table
    separations: pa.Table
    run_steps_per_second: float


@dataclass(frozen=True)
class RunInputs:
    """What a run was given, for its row in ``runs``."""

    speed: float
    """Speed [m/s]."""
    duration: float
    """Simulated time [s]."""
    evaluated_length: float
    """Length over which wheel 1 counts [m]."""
    varied: Mapping[str, float] = field(default_factory=dict)
    """What differs from sample to sample, by dotted key, in SI."""


def tables_of(scenario: "Scenario", batch: Sequence[Shard], result: BatchResult) -> dict[Shard, dict[str, pa.Table]]:
    """The tables of the shards that were simulated together.

    Args:
        scenario: Their scenario.
        batch: The shards, in the order of the runs.
        result: What the engine returned.
    """
    distance = float(scenario.resolved()["run"]["distance"])
    pairs = [pair for shard in batch for pair in shard.pairs]
    speeds = scenario.speeds
    varied = {sample: scenario.varied(sample) for _, sample in pairs}
    inputs = []
    for case, sample in pairs:
        numbers = {name: number for name, number in varied[sample].items() if name != "speed"}
        speed = varied[sample].get("speed", speeds[case])
        inputs.append(RunInputs(speed, distance / speed, scenario.evaluated_length(case), numbers))
    return shard_tables(batch, [run_name(*pair) for pair in pairs], inputs, scenario.seed, result)


def shard_tables(
    batch: Sequence[Shard], names: Sequence[str], inputs: Sequence[RunInputs], seed: int, result: BatchResult
) -> dict[Shard, dict[str, pa.Table]]:
    """Cuts the result of a batch into the tables of its shards.

    Args:
        batch: The shards run together, in the order of the runs.
        names: Printed id of each run of the batch.
        inputs: Inputs of each run of the batch.
        seed: The campaign's seed.
        result: What the engine returned for the batch.
    """
    status, steps = np.asarray(result.status), np.asarray(result.steps)
    case = np.concatenate([np.full(len(shard), shard.case) for shard in batch])
    sample = np.concatenate([np.arange(shard.start, shard.stop) for shard in batch])
    if not len(status) == len(steps) == len(names) == len(inputs) == len(case):
        raise ValueError(f"the batch has {len(case)} runs, its result {len(status)}")
    tables: dict[Shard, dict[str, pa.Table]] = {}
    first = 0
    for shard in batch:
        rows = slice(first, first + len(shard))
        columns = [
            case[rows],
            sample[rows],
            list(names[rows]),
            [run.speed for run in inputs[rows]],
            np.full(len(shard), seed),
            status[rows],
            steps[rows],
            [run.duration for run in inputs[rows]],
            [run.evaluated_length for run in inputs[rows]],
        ]
        arrays = [pa.array(column, type=kind.type) for column, kind in zip(columns, RUN_SCHEMA, strict=True)]
        tables[shard] = {
            "runs": _with_varied(pa.Table.from_arrays(arrays, schema=RUN_SCHEMA), inputs[rows]),
            "wheels": _of_shard(result.summary, shard, first),
            "events": _of_shard(result.separations, shard, first),
        }
        first += len(shard)
    return tables


def _with_varied(table: pa.Table, inputs: Sequence[RunInputs]) -> pa.Table:
    """The rows with a column for each varied number, named by its dotted key."""
    for name in inputs[0].varied if inputs else ():
        column = pa.array([run.varied[name] for run in inputs], pa.float64())
        table = table.append_column(pa.field(name, pa.float64()), column)
    return table


def _of_shard(table: pa.Table, shard: Shard, first: int) -> pa.Table:
    """The rows of a shard whose runs begin at ``first`` in the batch: case and sample instead of run."""
    run = table["run"].to_numpy().astype(np.int64)
    inside = (run >= first) & (run < first + len(shard))
    chosen, run = table.filter(pa.array(inside)), run[inside]
    head = [pa.array(np.full(len(run), shard.case), pa.int32()), pa.array(run - first + shard.start, pa.int64())]
    rest = [name for name in chosen.column_names if name != "run"]
    return pa.table(
        [*head, *(chosen[name].combine_chunks() for name in rest)], names=["case", "sample", *rest]
    ).replace_schema_metadata(None)
