"""The table of a campaign's recorded runs: what each one was and did, sorted as asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tbatch.campaign.summary import columns

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign

KMH = 3.6


@dataclass(frozen=True)
class KeptRun:
    """One recorded run."""

    name: str
    case: int
    sample: int
    speed: float  # [m/s]
    seed: int
    status: int  # 0 ok, 1 diverged
    separations: int  # of all wheelsets
    longest: float  # separation that the ends do not cut [s]
    force_max: float  # of all wheelsets [N]


ORDERS = {
    "separations": lambda run: (-run.separations, -run.longest, run.name),
    "longest": lambda run: (-run.longest, run.name),
    "force": lambda run: (-run.force_max, run.name),
    "speed": lambda run: (-run.speed, run.name),
    "seed": lambda run: (run.seed, run.sample, run.name),
    "run": lambda run: run.name,
}
"""How the table can be sorted: the worst, the fastest or the first come first."""


def kept_runs(campaign: Campaign, names: Sequence[str], order: str = "separations") -> list[KeptRun]:
    """What is stored of some runs, sorted.

    Args:
        campaign: The campaign.
        names: Their printed ids; those that are not stored are left out.
        order: One of ORDERS.
    """
    if order not in ORDERS:
        raise ValueError(f"--sort {order!r}: one of {', '.join(ORDERS)} is needed")
    wanted = {campaign.pair(name): name for name in names}
    if not wanted:
        return []
    wheels = campaign.table("wheels", ("case", "sample", "separations", "longest", "force_max")).to_pydict()
    of_run: dict[tuple[int, int], list[int]] = {}
    for row, pair in enumerate(zip(wheels["case"], wheels["sample"], strict=True)):
        if pair in wanted:
            of_run.setdefault(pair, []).append(row)
    runs = campaign.table("runs", ("case", "sample", "name", "speed", "seed", "status")).to_pylist()
    found = [
        KeptRun(
            **run,
            separations=sum(wheels["separations"][row] for row in rows),
            longest=max(wheels["longest"][row] for row in rows),
            force_max=max(wheels["force_max"][row] for row in rows),
        )
        for run in runs
        if (rows := of_run.get((run["case"], run["sample"])))
    ]
    return sorted(found, key=ORDERS[order])


def kept_runs_text(runs: Sequence[KeptRun]) -> str:
    """The table for a terminal."""
    rows = [
        [
            run.name,
            f"{run.speed * KMH:.4g}",
            str(run.separations),
            f"{1e3 * run.longest:.1f}" if run.longest else "-",
            f"{1e-3 * run.force_max:.1f}",
            str(run.seed),
            "ok" if run.status == 0 else "diverged",
        ]
        for run in runs
    ]
    titles = ["run", "speed", "separations", "longest", "max force", "seed", "status"]
    return "\n".join(columns(titles, ["", "km/h", "", "ms", "kN", "", ""], rows))
