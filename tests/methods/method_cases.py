"""Small systems that the tests of the methods share."""

from functools import cache
from typing import Any

import numpy as np

import tbatch as tb
from tbatch.engine.result import Result

HERTZ = tb.Contact.hertz(wheel_radius=0.4575)
LINEAR = tb.Contact.linear(wheel_radius=0.4575)
CHANNELS = ("contact_force", "vehicle", "vehicle_acceleration", "irregularity", "rail_under_wheel", "rail",
            "rail_acceleration")  # fmt: skip

METHODS = {
    "NML": tb.methods.newmark_linear,
    "NMN": tb.methods.newmark_hertz,
    "APL": tb.methods.hht_alpha,
    "two-step": tb.methods.two_step,
}


@cache
def parts(kind: str) -> tuple[tb.Vehicle, tb.Track]:
    """A vehicle on a track."""
    if kind == "column":
        return tb.Vehicle.column("koh-column"), tb.Track.winkler("koh-winkler", length=20.0, elements=40)
    if kind == "rigid":
        return tb.Vehicle.column("koh-column"), tb.Track.rigid(length=20.0)
    return tb.Vehicle.coach("seed-multiwheel"), tb.Track.slab("seed-slab", length=40.0)


def waves(amplitude: float) -> tb.Irregularity:
    """Two waves that a step of 0.1 ms resolves."""
    return tb.Irregularity.cosines([0.8, 1.7], [amplitude, 0.3 * amplitude], [0.3, 1.0])


def asked(kind: str, step: float, irregularity: Any, duration: float = 0.05, every: float | None = None) -> dict:
    """The arguments of a run."""
    start, speed = (30.0, 60.0) if kind == "coach" else (5.0, 30.0)
    names = {"rigid": CHANNELS[:4], "coach": (*CHANNELS, "slab_under_wheel", "base_under_wheel")}.get(kind, CHANNELS)
    save = tb.SaveAt(step if every is None else every, names, [7.3])
    return {"speed": speed, "irregularity": irregularity, "start": start, "duration": duration, "step": step,
            "save": save}  # fmt: skip


def engine(kind: str, contact: tb.Contact, given: dict, **options: Any) -> Result:
    """The same run by the batch engine."""
    model = tb.Model.build(*parts(kind), contact, step=given["step"], **options)
    runs = tb.Runs([given["speed"]], [given["irregularity"]], given["start"])
    return tb.simulate(model, runs, given["duration"], save=given["save"])


def worst(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference by the largest value."""
    return float(np.nanmax(np.abs(a - b)) / np.nanmax(np.abs(b)))
