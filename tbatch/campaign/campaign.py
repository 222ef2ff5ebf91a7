"""A campaign: every run of a scenario, as stored shard by shard; read back, and simulated again."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from tbatch.campaign.estimates import ALL_SPEEDS, ANY_WHEELSET, Estimate, Records, estimates
from tbatch.campaign.executor import Executor, Local
from tbatch.campaign.identity import run_count
from tbatch.campaign.keep import worst_runs
from tbatch.campaign.part import Part
from tbatch.campaign.records import BatchResult
from tbatch.campaign.sameness import differing_columns, rows_of
from tbatch.campaign.shards import Shard, missing_shards
from tbatch.campaign.statistics import RUN_COLUMNS, WHEEL_COLUMNS, separation_statistics
from tbatch.campaign.stopping import TALLY_COLUMNS, StopRule, Tally, tally
from tbatch.campaign.store import SCENARIO_NAME, Store
from tbatch.scenario.run_name import parse_run_name, run_name

if TYPE_CHECKING:
    from tbatch.engine.result import Result
    from tbatch.scenario import Scenario

REPLAYED = ("contact_force", "vehicle", "vehicle_acceleration", "irregularity")


class Campaign:
    """The stored runs of a scenario, in a folder.

    What is stored is read without building the scenario, so that it can be read where a measured level it names is not.
    """

    def __init__(
        self,
        store: Store,
        scenario: "Scenario | None" = None,
        executor: Executor | None = None,
        *,
        threads: int | None = None,
    ) -> None:
        """Takes an opened store; see ``open``.

        Args:
            store: The store.
            scenario: Its scenario; default: made from the store when runs are simulated again.
            executor: Where to simulate; default: in this process.
            threads: Threads for that.
        """
        self.store = store
        self._scenario = scenario
        self._executor = executor
        self._threads = threads
        self._tallies: dict[Shard, Tally] = {}

    @classmethod
    def open(cls, folder: Path | str, *, threads: int | None = None) -> "Campaign":
        """Opens a campaign folder to read it; ``threads`` are for runs simulated again."""
        return cls(Store.open(Path(folder)), threads=threads)

    @cached_property
    def scenario(self) -> "Scenario":
        """The scenario."""
        if self._scenario is not None:
            return self._scenario
        from tbatch.scenario import Scenario

        return Scenario.from_tables(self.store.resolved, file=str(self.folder / SCENARIO_NAME))

    @property
    def folder(self) -> Path:
        """The campaign folder."""
        return self.store.folder

    @cached_property
    def executor(self) -> Executor:
        """Where runs of this campaign are simulated again."""
        return self._executor or Local(self.scenario, threads=self._threads)

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return str(self.store.resolved["campaign"]["name"])

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speed of each case [m/s]."""
        return tuple(float(speed) for speed in self.store.resolved["speed"]["values"])

    @property
    def samples(self) -> int:
        """Samples per speed; at least, with a rule to stop."""
        return run_count(self.store.resolved)

    @property
    def planned(self) -> tuple[int, ...]:
        """Samples that each speed is to have: the scenario's, or as far as its rule to stop tells by now."""
        rule = StopRule.of(self.store.resolved)
        if rule is None:
            return (self.samples,) * len(self.speeds)
        stored: dict[int, list[Shard]] = {case: [] for case in range(len(self.speeds))}
        for shard in self.store.shards:
            stored[shard.case].append(shard)
        return tuple(rule.planned(shards, self._tally) for shards in stored.values())

    @property
    def _planned_for_parts(self) -> tuple[int, ...]:
        """Parts know nothing of each other: they run up to the first look of a rule to stop, the rest is for one."""
        rule = StopRule.of(self.store.resolved)
        return (self.samples if rule is None else next(rule.looks()),) * len(self.speeds)

    def _tally(self, shard: Shard) -> Tally:
        if shard not in self._tallies:
            runs = self.store.shard_table("runs", shard, ("sample", "status"))
            self._tallies[shard] = tally(runs, self.store.shard_table("wheels", shard, TALLY_COLUMNS))
        return self._tallies[shard]

    def missing(self, part: Part | None = None) -> list[Shard]:
        """The shards still to be run, all of them or those of a part."""
        cases = len(self.speeds)
        planned = self.planned if part is None else self._planned_for_parts
        missing = missing_shards(cases, planned, self.store.shards)
        return [shard for shard in missing if part is None or part.holds(shard, cases)]

    @property
    def runs_stored(self) -> int:
        """Number of stored runs."""
        return sum(len(shard) for shard in self.store.shards)

    @property
    def runs_total(self) -> int:
        """Number of runs that the scenario asks for, as far as its rule to stop tells by now."""
        return sum(self.planned)

    @property
    def diverged(self) -> int:
        """Number of stored runs that diverged."""
        return sum(entry["diverged"] for entry in self.store.manifest.shards.values())

    @property
    def step(self) -> float:
        """Time step [s]."""
        return float(self.store.resolved["integration"]["step"])

    @property
    def run_steps_per_second(self) -> float | None:
        """Run-steps per second of the batch kernels, over all processes that simulated runs of it; None if unknown."""
        sessions = self.store.manifest.sessions
        seconds = sum(session["kernel_seconds"] for session in sessions)
        return sum(session["run_steps"] for session in sessions) / seconds if seconds > 0.0 else None

    def table(self, kind: str, columns: Sequence[str] | None = None) -> pa.Table:
        """All stored rows of ``"runs"``, ``"wheels"`` or ``"events"``, by case and sample, checked as they are read."""
        return self.store.table(kind, columns)

    @property
    def wheels(self) -> list[int]:
        """Numbers of the wheelsets, from 1 at the front."""
        if not self.store.shards:
            return []
        numbers = self.store.shard_table("wheels", self.store.shards[0], ("wheel",))["wheel"]
        return sorted({int(number) for number in numbers.to_pylist()})

    def statistics(self, *, any_wheelset: bool = False) -> pa.Table:
        """How often wheels leave the rail, a row per speed and wheelset.

        Args:
            any_wheelset: A row per speed instead, for any of the wheelsets.
        """
        return self.statistics_of([ANY_WHEELSET] if any_wheelset else self.wheels)

    def statistics_of(self, wheels: Sequence[int]) -> pa.Table:
        """The same for some wheelsets, by their numbers; ``ANY_WHEELSET`` is any of them."""

        def tables_of(case: int) -> tuple[pa.Table, pa.Table]:
            return self.store.table("runs", RUN_COLUMNS, case), self.store.table("wheels", WHEEL_COLUMNS, case)

        return separation_statistics(tables_of, self.speeds, wheels)

    @cached_property
    def records(self) -> Records:
        """The stored tables as columns of runs, read once: for estimates and reports."""
        return Records(*(self.table(kind) for kind in ("runs", "wheels", "events")))

    def estimates(self, case: int = ALL_SPEEDS, wheel: int = ANY_WHEELSET) -> list[Estimate]:
        """Every estimate with its interval, for a speed and wheelset.

        Args:
            case: Index of the speed; default: the whole campaign, whose unit is the sample with its runs at all speeds.
            wheel: Wheelset, from 1 at the front; default: any of them.
        """
        return estimates(self.records.units(case, wheel))

    def kept(self) -> list[str]:
        """Names of the runs that the scenario keeps as recordings."""
        keep = self.scenario.keep
        pairs = list(keep.runs)
        if keep.worst:
            wheels = self.table("wheels", ("case", "sample", "longest", "force_max"))
            pairs = worst_runs(self.table("runs", ("case", "sample", "status")), wheels, keep.worst)
        return [run_name(*pair) for pair in pairs]

    def replay(self, run_id: str, *, save: Any = None, progress: Any = None) -> "Result":
        """Simulates one run again from its seed, bit for bit, with histories.

        Args:
            run_id: The run, ``"c03-s000127"``.
            save: What to keep, a SaveAt; default: contact force, vehicle and irregularity at every step.
            progress: Called after each chunk of steps.
        """
        return self.replay_together([run_id], save=save, progress=progress)

    def replay_together(self, run_ids: Sequence[str], *, save: Any = None, progress: Any = None) -> "Result":
        """Simulates several runs again in one batch; bit for bit what ``replay`` gives for each."""
        if save is None:
            from tbatch.engine.runs import SaveAt

            save = SaveAt(every=self.step, channels=REPLAYED)
        return self.executor.simulate([self.pair(run_id) for run_id in run_ids], progress=progress, save=save)

    def pair(self, run_id: str) -> tuple[int, int]:
        """Case and sample of a run of this campaign; ValueError for any other."""
        case, sample = parse_run_name(run_id)
        planned = self.planned
        if case >= len(planned) or sample >= planned[case]:
            last = run_name(len(planned) - 1, planned[-1] - 1)
            raise ValueError(f"run is {run_id!r}: this campaign has runs {run_name(0, 0)} to {last}")
        return case, sample

    def is_stored(self, run_id: str) -> bool:
        """Whether a run of this campaign is stored."""
        return self._shard_of(run_id) is not None

    def _shard_of(self, run_id: str) -> Shard | None:
        case, sample = self.pair(run_id)
        inside = [shard for shard in self.store.shards if shard.case == case and shard.start <= sample < shard.stop]
        return inside[0] if inside else None

    def differs_from_stored(self, run_id: str, result: BatchResult, index: int = 0) -> list[str]:
        """Columns of a replayed run that are not bit for bit those stored; empty if it is the same run.

        Args:
            run_id: The run.
            result: A result that holds it.
            index: Its place in that result.
        """
        _, sample = self.pair(run_id)
        shard = self._shard_of(run_id)
        if shard is None:
            raise ValueError(f"run is {run_id!r}: not stored yet")
        stored = rows_of(self.store.shard_table("runs", shard, ("sample", "status", "steps")), "sample", sample)
        ended = {"status": int(result.status[index]), "steps": int(result.steps[index])}
        differing = [f"runs.{name}" for name, value in ended.items() if stored[name][0].as_py() != value]
        for kind, replayed in {"wheels": result.summary, "events": result.separations}.items():
            stored = rows_of(self.store.shard_table(kind, shard), "sample", sample).drop_columns(["case"])
            differing += [f"{kind}.{name}" for name in differing_columns(stored, rows_of(replayed, "run", index))]
        return differing
