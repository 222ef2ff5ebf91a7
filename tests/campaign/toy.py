"""A toy scenario and executor: runs in microseconds, for tests of everything around the engine."""

import json
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa

from tbatch.scenario.keep import Keep

WHEELS = 2
STEPS = 1000
STOPPED = 400  # step of a run that diverges


@dataclass
class ToyScenario:
    """Two speeds, two wheels; a wheel separates with a probability that grows with the speed."""

    samples: int = 100
    name: str = "toy"
    seed: int = 7
    speeds: tuple[float, ...] = (50.0, 100.0)
    keep: Keep = field(default_factory=lambda: Keep(timelines="none"))
    limits_diverged: int = 0
    step: float = 1e-3

    @property
    def source_text(self) -> str:
        """What the scenario file says."""
        return f"# toy\nruns = {self.samples}\n"

    def resolved(self) -> dict[str, Any]:
        """With every default, in SI."""
        return {
            "campaign": {"name": self.name, "runs": self.samples, "seed": self.seed},
            "vehicle": {"rails": 2},
            "contact": {"law": "hertz"},
            "speed": {"values": list(self.speeds)},
            "run": {"distance": 50.0},
            "integration": {"step": self.step},
            "irregularity": {"defect": [{"kind": "flat", "depth": 1e-3}]},
        }

    def varied(self, sample: int) -> dict[str, float]:
        """What differs from sample to sample."""
        return {}

    def evaluated_length(self, case: int) -> float:
        """Length over which wheel 1 counts [m]."""
        return 45.0


@dataclass
class ToyExecutor:
    """Gives each run what (seed, case, sample) alone decides."""

    scenario: ToyScenario
    limit: int = 128
    delay: float = 0.0
    diverging: frozenset[tuple[int, int]] = frozenset()
    asked: list[tuple[int, int]] = field(default_factory=list)

    def steps_per_run(self) -> list[int]:
        """Steps of a run of each case."""
        return [STEPS] * len(self.scenario.speeds)

    def batch_limit(self, rate: float | None, steps: float) -> int:
        """Runs simulated together."""
        return self.limit

    def simulate(self, pairs: Any, *, progress: Any = None, save: Any = None) -> SimpleNamespace:
        """Gives the runs' results and one report of progress."""
        self.asked += list(pairs)
        wheel_rows, events = [], []
        for run, (case, sample) in enumerate(pairs):
            random = np.random.Generator(np.random.Philox(key=[self.scenario.seed + case, sample]))
            for wheel in range(1, WHEELS + 1):
                count = int(random.poisson(0.3 * (case + 1)))
                times = random.exponential(1e-3, count)
                wheel_rows.append(
                    {
                        "run": run,
                        "wheel": wheel,
                        "evaluated_time": 0.9,
                        "evaluated_distance": 45.0,
                        "separations": count,
                        "censored": 0,
                        "separated_time": float(times.sum()),
                        "longest": float(times.max(initial=0.0)),
                        "largest_gap": float(random.random()) if count else 0.0,
                        "largest_landing_force": 1e5 if count else 0.0,
                        "force_max": float(1e5 + 1e4 * random.random()),
                        "force_min": 0.0 if count else 2e4,
                        "histogram": [int(number) for number in random.integers(0, 9, 5)],
                    }
                )
                events += [{"run": run, "wheel": wheel, "start": 0.1, "end": 0.1 + float(t)} for t in times]
        if self.delay:
            time.sleep(self.delay)
        if progress is not None:
            steps = STEPS * len(pairs)
            progress(SimpleNamespace(run_steps_done=steps, run_steps_total=steps, separations=len(events)))
        schema = pa.schema([("run", pa.int32()), ("wheel", pa.int32()), ("start", pa.float64()), ("end", pa.float64())])
        return SimpleNamespace(
            status=np.array([int(pair in self.diverging) for pair in pairs]),
            steps=np.array([STOPPED if pair in self.diverging else STEPS for pair in pairs]),
            time=np.arange(STEPS + 1) * self.scenario.step,
            channels={"contact_force": np.full((len(pairs), STEPS + 1, WHEELS), 5e4)} if save else {},
            run_steps_per_second=1e6,
            summary=pa.Table.from_pylist(wheel_rows),
            separations=pa.Table.from_pylist(events, schema=schema),
        )


def contents(campaign: Any) -> dict[str, str]:
    """Every stored row of a campaign as text, to compare two campaigns bit by bit."""
    return {kind: json.dumps(campaign.table(kind).to_pylist()) for kind in ("runs", "wheels", "events")}


def bytes_of(folder: Path) -> dict[Path, bytes]:
    """Every table file of a campaign folder by its path there."""
    return {
        path.relative_to(folder): path.read_bytes()
        for kind in ("runs", "wheels", "events")
        for path in (folder / kind).iterdir()
    }
