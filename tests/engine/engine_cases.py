"""The cases that the engine's tests share: few sizes, as each size is compiled once, and the one-run oracle."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import block_diag

from tbatch.engine.model import Model
from tbatch.engine.prepare import Preparation, step_counts
from tbatch.engine.runs import Runs, State
from tbatch.numerics.reference import ReferenceRun
from tbatch.numerics.two_step import EQUAL_SPLITTING
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

LAWS = {
    "hertz": Contact.hertz(wheel_radius=0.4575),
    "linear": Contact.linear(wheel_radius=0.4575),
    "affine": Contact.affine(wheel_radius=0.4575),
}


def wheel(mass: float = 350.0, weight: float = 40e3, damping: float = 0.0) -> Vehicle:
    """One wheel under a constant load: one dof."""
    return Vehicle([[mass]], [[damping]], [[0.0]], [0], [0.0], [weight], name="wheel")


def bar() -> Vehicle:
    """A sprung mass on two wheels 0.3 m apart: two wheels on one element."""
    k, c, half = 2e6, 2e4, 0.15
    links = np.array([[1.0, half, -1.0, 0.0], [1.0, -half, 0.0, -1.0]])
    pairs = links.T @ links
    return Vehicle(np.diag([4000.0, 300.0, 400.0, 400.0]), c * pairs, k * pairs, [2, 3], [0.0, 2.0 * half], name="bar")


def train() -> Vehicle:
    """Two coaches in a row as one set of matrices: 20 dofs, 8 wheels."""
    coach, pitch = Vehicle.coach("seed-multiwheel"), 25.0
    return Vehicle(
        block_diag(coach.mass, coach.mass),
        block_diag(coach.damping, coach.damping),
        block_diag(coach.stiffness, coach.stiffness),
        [*coach.wheel_dofs, *(10 + dof for dof in coach.wheel_dofs)],
        np.concatenate([coach.wheel_offsets, pitch + coach.wheel_offsets]),
        wheel_radius=0.4575,
        name="two coaches",
    )


VEHICLES = {
    "wheel": wheel,
    "column": lambda: Vehicle.column("koh-column"),
    "bar": bar,
    "coach": lambda: Vehicle.coach("seed-multiwheel"),
    "train": train,
}

TRACKS = {
    "slab": lambda: Track.slab("seed-slab", length=32.0),
    "winkler": lambda: Track.winkler("koh-winkler", length=20.0, elements=20),
    "long winkler": lambda: Track.winkler("koh-winkler", length=60.0, elements=60, rails=2),
    "beam": lambda: Track.beam(length=20.0, elements=8, EI=2e9, mass=2000.0, rayleigh=(0.5, 1e-5)),
    "rigid": lambda: Track.rigid(length=60.0),
}


@cache
def model(
    vehicle: str, track: str, law: str = "hertz", splitting: float = EQUAL_SPLITTING, step: float = 1e-4
) -> Model:
    """A model by the names of its parts, built once."""
    return Model.build(VEHICLES[vehicle](), TRACKS[track](), LAWS[law], step=step, splitting=splitting)


def corrugation(amplitude: float, phase: float = 0.0) -> Irregularity:
    """Two short waves that no wheel can follow at 50 m/s and an amplitude of 0.1 mm or more."""
    return Irregularity.cosines([1.0 / 0.21, 1.0 / 0.083], [amplitude, 0.2 * amplitude], [phase, 1.0 + 2.0 * phase])


@dataclass(frozen=True, eq=False)
class OneRun:
    """Every step of a reference run, at t_0 ... t_n."""

    force: np.ndarray
    """[N], shape (n + 1, wheel)."""
    overlap: np.ndarray
    """δ [m], shape (n + 1, wheel)."""
    vehicle: np.ndarray
    """[m, rad], shape (n + 1, dof)."""
    vehicle_velocity: np.ndarray
    """[m/s, rad/s], shape (n + 1, dof)."""
    vehicle_acceleration: np.ndarray
    """[m/s², rad/s²], shape (n + 1, dof); NaN at t_0."""
    track: np.ndarray
    """u [m, -], shape (n + 1, node, dof)."""
    track_velocity: np.ndarray
    """[m/s, 1/s], shape (n + 1, node, dof)."""
    level: np.ndarray
    """r under each wheel [m], shape (n + 1, wheel)."""
    position: np.ndarray
    """x_j [m], shape (n + 1, wheel)."""
    diverged: bool

    @property
    def steps(self) -> int:
        """Steps completed."""
        return len(self.force) - 1


def reference(of: Model, runs: Runs, duration, run: int, initial: str | State = "static") -> OneRun:
    """One run of the table, stepped by the NumPy oracle."""
    preparation = Preparation(of, runs, step_counts(of, runs, duration), initial)
    inputs = preparation.inputs(run)
    oracle = ReferenceRun(
        of.factor,
        of.scheme,
        inputs,
        preparation.start(run, inputs),
        line=of.track,
        compliance=of.compliance,
    )
    kept, good = [], True
    for n in range(-1, inputs.steps):
        with np.errstate(all="ignore"):
            good = n < 0 or oracle.advance(n)
        if not good:
            break
        kept.append(
            (
                oracle.force.copy(),
                oracle.overlap.copy(),
                oracle.q.copy(),
                oracle.q_velocity.copy(),
                oracle.q_acceleration.copy(),
                oracle.u.copy(),
                oracle.u_velocity.copy(),
                inputs.levels((n + 1) * of.step),
                inputs.positions((n + 1) * of.step),
            )
        )
    return OneRun(*(np.array(part) for part in zip(*kept, strict=True)), diverged=not good)
