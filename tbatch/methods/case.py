"""One run to compare methods on, and how each method runs it."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tbatch.engine.model import Model
from tbatch.engine.result import Result
from tbatch.engine.runs import Runs, SaveAt
from tbatch.engine.simulate import simulate
from tbatch.methods.result import MethodResult
from tbatch.methods.solvers import HHT_ALPHA, hht_alpha, linear_of, newmark_hertz, newmark_linear, two_step
from tbatch.numerics.inertia import inertia
from tbatch.numerics.newmark import Newmark
from tbatch.numerics.two_step import TwoStep
from tbatch.physics.contact import Contact

METHODS: dict[str, str] = {
    "two-step": "own",
    "two-step linear": "linear",
    "two-step lagged": "linear",
    "NML": "linear",
    "NMN": "own",
    "APL": "linear",
}
"""Methods by the name they are printed with, and their contact law: the scenario's own or the linear one."""
CHANNELS = ("contact_force", "vehicle_acceleration", "rail", "rail_acceleration")


@dataclass(frozen=True, eq=False)
class Case:
    """One run to compare methods on."""

    name: str
    model: Model
    """Vehicle, track, contact, splitting; its step is the one that responses are shown for."""
    speed: float
    """[m/s]."""
    irregularity: Any
    start: float
    """[m]."""
    duration: float
    """[s]."""

    @property
    def point(self) -> float:
        """Mid-track, or the middle of the way if wheel 1 does not come by there [m]."""
        track, way = self.model.track, self.speed * self.duration
        middle = track.begin + 0.5 * track.length
        return middle if self.start < middle < self.start + way else self.start + 0.5 * way

    @property
    def local_compliance(self) -> bool:
        """Whether the local rail compliance is in series with the contact."""
        return self.model.compliance > 0.0

    def contact(self, law: str) -> Contact:
        """The contact for the "own" or the "linear" law."""
        return linear_of(self.model.contact) if law == "linear" else self.model.contact

    def law(self, law: str) -> str:
        """Name of the "own" or the "linear" law."""
        return self.contact(law).law

    def save(self, step: float) -> SaveAt:
        """Every step of all that is compared, and the layers that the track has."""
        track = self.model.track
        names = CHANNELS if track.node_dofs else CHANNELS[:2]
        return SaveAt(step, (*names, *(layer for layer in track.layers if layer != "rail")), [self.point])


def reference(case: Case, law: str, step: float, every: float) -> Result:
    """The batch engine's run with a step [s], sampled every so often [s]."""
    model = case.model
    fine = Model.build(
        model.vehicle,
        model.track,
        case.contact(law),
        step=step,
        splitting=model.splitting,
        local_compliance=case.local_compliance,
    )
    runs = Runs([case.speed], [case.irregularity], case.start)
    return simulate(fine, runs, case.duration, save=case.save(every))


def run_method(case: Case, name: str, step: float, *, direct: bool = False) -> MethodResult:
    """One method with one step [s]; `direct` as in `compare`."""
    model = case.model
    given: dict[str, Any] = {
        "speed": case.speed,
        "irregularity": case.irregularity,
        "start": case.start,
        "duration": case.duration,
        "step": step,
        "save": case.save(step),
        "local_compliance": case.local_compliance,
    }
    parts = model.vehicle, model.track
    contact = case.contact(METHODS[name])
    if name == "NML":
        return newmark_linear(*parts, contact, **given, refactor=direct)
    if name == "NMN":
        return newmark_hertz(*parts, _hertz_of(contact), **given)
    if name == "APL":
        return hht_alpha(*parts, contact, **given, refactor=direct)
    lagged = name == "two-step lagged"
    state = "lagged" if lagged else "exact"
    return two_step(
        *parts, contact, **given, splitting=model.splitting, contact_state=state, refactor=direct and lagged
    )


def spectral_radius(case: Case, name: str, step: float, omega: float) -> float:
    """Spectral radius [-] of a method at an angular frequency [rad/s]."""
    scheme: Newmark | TwoStep
    if name in ("NML", "NMN"):
        scheme = Newmark(step)
    elif name == "APL":
        scheme = Newmark(step, HHT_ALPHA)
    else:
        scheme = TwoStep(step, case.model.splitting)
    return float(np.abs(np.linalg.eigvals(scheme.amplification(omega))).max())


def highest_frequency(case: Case) -> float:
    """The track's highest natural frequency [rad/s]; that of the wheel on its contact spring for a rigid track."""
    from scipy.linalg import eigh

    track, rest = case.model.track, case.model.rest
    if not track.node_dofs:
        spring = rest.constants.exponent * rest.load / np.maximum(rest.constants.approach, 1e-12)
        mass = np.diag(case.model.vehicle.mass)[list(case.model.vehicle.wheel_dofs)]
        return float(np.sqrt((spring / mass).max()))
    if track.imported is not None:
        from scipy.sparse.linalg import eigsh

        weights, still = inertia(track)
        moves = ~still.ravel()
        stiff, heavy = (part.to_csc()[moves][:, moves] for part in (track.stiffness, weights))
        return math.sqrt(float(eigsh(stiff, 1, heavy, which="LM", return_eigenvectors=False)[0]))
    # The highest mode is as short as an element: that of a few elements is that of the line.
    few = min(track.node_count, 4 * track.period + 1) * track.node_dofs
    free = track.free.ravel()[:few]
    K, M = (part.to_csc()[:few, :few].toarray()[np.ix_(free, free)] for part in (track.stiffness, track.mass))
    return math.sqrt(float(eigh(K, M, eigvals_only=True)[-1]))


def _hertz_of(contact: Contact) -> Contact:
    if contact.law != "hertz":
        return Contact("hertz", contact.wheel_radius, contact.profile, contact.constant)
    return contact
