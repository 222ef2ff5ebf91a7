"""Cases: what is timed.

The model is the seed paper's second: 167 bays, 168 nodes, 1008 dofs before the ends are pinned, a ten-dof coach with
four Hertz wheelsets on a rough rail, all statistics on.
"""

import math

import numpy as np

from tbatch.engine.model import Model
from tbatch.engine.runs import Runs
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

BAYS, BAY = 167, 0.65
STEP, SPEED, START = 1e-4, 300.0 / 3.6, 25.0
ENDLESS_START = 60.0


def seed_model(length: float | str = BAYS * BAY, elements_per_bay: int = 1, *, step: float = STEP) -> Model:
    """The seed paper's second model, by default on 167 bays with one element each."""
    vehicle = Vehicle.coach("seed-multiwheel")
    track = Track.slab("seed-slab", length=length, elements_per_bay=elements_per_bay)
    return Model.build(vehicle, track, Contact.hertz(wheel_radius=0.4575), step=step)


def seed_runs(count: int, *, speeds: int = 1) -> Runs:
    """Runs on different samples of a rough line, in equal numbers at speeds from 1 to 1.2 times 300 km/h."""
    speed = SPEED * (1.0 + 0.2 * (np.arange(count) % speeds) / speeds)
    return Runs(speed, [_rough(sample, START, 200.0) for sample in range(count)], START)


def endless_runs(count: int) -> Runs:
    """Runs of one speed on different samples of a line without end."""
    rough = [_rough(sample, ENDLESS_START, math.inf) for sample in range(count)]
    return Runs(np.full(count, SPEED), rough, ENDLESS_START)


def _rough(sample: int, start: float, period: float) -> Irregularity:
    line = Irregularity.spectrum(
        "china-trunk-line", wavelengths=(0.3, 50.0), tail=3, seed=1, sample=sample, period=period
    )
    return line.taper(start, 5.0)
