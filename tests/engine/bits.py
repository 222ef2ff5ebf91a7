"""The case whose bits must never depend on the company, and what each of its runs gives, as a digest.

Run as a script it prints the digests of all runs, one a line, for a comparison between processes:
`python bits.py THREADS COUNT`, or of coaches on slab track `python bits.py THREADS COUNT coach`.
"""

import hashlib
import sys
from collections.abc import Sequence

import numpy as np
from engine_cases import corrugation, model

from tbatch.engine.model import Model
from tbatch.engine.result import Result
from tbatch.engine.runs import Runs, SaveAt
from tbatch.engine.simulate import simulate
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.vehicle import Vehicle

COLUMNS = [Vehicle.column("koh-column", wheel_mass=mass) for mass in (350.0, 300.0, 420.0)]
CONTACTS = [Contact.hertz(wheel_radius=0.4575), Contact.affine(wheel_radius=0.4575), Contact.linear(1e9)]
OVAL = Irregularity.cosines(3.0 / (2.0 * np.pi * 0.4575), 0.05e-3)
CHANNELS = ("contact_force", "vehicle", "vehicle_acceleration", "irregularity", "rail", "rail_acceleration")


def case() -> Model:
    """A column on a Winkler track."""
    return model("column", "winkler")


def simulated(numbers: Sequence[int], **options) -> Result:
    """Simulate the runs of these numbers together: each has its own speed, length, surface, vehicle and law."""
    of = case()
    vehicles = (of.vehicle, *COLUMNS)
    runs = Runs(
        speed=[30.0 + 1.3 * (n % 23) for n in numbers],
        irregularity=[None if n % 11 == 5 else corrugation(0.7e-3, 0.37 * n) for n in numbers],
        start=[4.0 + 0.05 * (n % 31) for n in numbers],
        vehicle=[vehicles[n % 4] for n in numbers],
        contact=[CONTACTS[n % 3] for n in numbers],
        wheel_profile=[OVAL if n % 7 == 2 else None for n in numbers],
        evaluate_from=[0.02 * (n % 5) for n in numbers],
    )
    duration = [of.step * (60 + 5 * (n % 9)) for n in numbers]
    options.setdefault("threads", 1)
    return simulate(of, runs, duration, save=SaveAt(2.0 * of.step, CHANNELS, (4.4, 6.1)), **options)


def coaches(numbers: Sequence[int], **options) -> Result:
    """Simulate coaches on slab track; every second one's primary suspension is its own."""
    of = model("coach", "slab")
    own = [Vehicle.coach("seed-multiwheel", primary=(1.8e6 + 1e4 * n, 2e4)) if n % 2 else of.vehicle for n in numbers]
    rough = [corrugation(0.5e-3, 0.37 * n) for n in numbers]
    save = SaveAt(2.0 * of.step, ("contact_force", "vehicle", "slab_under_wheel"))
    return simulate(of, Runs([70.0] * len(own), rough, 24.0, vehicle=own), 120 * of.step, save=save, **options)


def digests(result: Result) -> list[str]:
    """SHA-256 of everything that each run gave."""
    logs: dict[int, list[tuple]] = {}
    for row in result.separations.to_pylist():
        logs.setdefault(row.pop("run"), []).append(tuple(row.values()))
    lines: dict[int, list[tuple]] = {}
    for row in result.summary.to_pylist():
        lines.setdefault(row.pop("run"), []).append(tuple(row.values()))
    texts = []
    for run, steps in enumerate(result.steps.tolist()):
        text = hashlib.sha256(f"{result.status[run]} {steps} {logs.get(run)!r} {lines[run]!r}".encode())
        for history in result.channels.values():
            text.update(np.ascontiguousarray(history[run, : steps // 2 + 1]).tobytes())
        texts.append(text.hexdigest())
    return texts


if __name__ == "__main__":
    chosen = coaches if sys.argv[3:] == ["coach"] else simulated
    print(*digests(chosen(range(int(sys.argv[2])), threads=int(sys.argv[1]))), sep="\n")
