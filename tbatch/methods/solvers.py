"""The methods as functions: a vehicle, a track and a contact in, a result out."""

from dataclasses import replace
from typing import Any

from tbatch.engine.runs import SaveAt, State
from tbatch.methods.one_run import carry_out, prepare
from tbatch.methods.result import MethodResult
from tbatch.numerics.contact_treatment import ExactContact, FrozenContact, IteratedContact, Treatment
from tbatch.numerics.coupled_run import CoupledRun, Method
from tbatch.numerics.newmark import Newmark, NewmarkMethod
from tbatch.numerics.two_step import EQUAL_SPLITTING, TwoStep
from tbatch.numerics.two_step_run import TwoStepMethod
from tbatch.physics.contact import Contact
from tbatch.physics.line import Line
from tbatch.physics.vehicle import Vehicle

HHT_ALPHA = -0.1
"""α of the method APL [-]."""


def newmark_linear(
    vehicle: Vehicle,
    track: Line,
    contact: Contact,
    *,
    speed: float,
    irregularity: Any,
    start: float,
    duration: float,
    step: float,
    initial: str | State = "static",
    save: SaveAt | None = None,
    local_compliance: bool = True,
    refactor: bool = False,
) -> MethodResult:
    """NML: Newmark's average acceleration, linear contact coupled directly.

    For each wheel with δ > δ_sep at step n the coupled stiffness gains k_c [Γ -N]ᵀ[Γ -N] and the load k_c r, with N
    and r at step n+1. Nothing is iterated: a wheel that leaves or meets the rail is noticed one step late. The local
    rail compliance is in series with the spring.

    Args:
        vehicle: The vehicle.
        track: The track.
        contact: The contact. A Hertz law stands for its tangent at the static load, F = k_c max(δ, 0).
        speed: [m/s].
        irregularity: r(x): an `Irregularity`, a callable of an array, or None.
        start: x of wheel 1 at t = 0 [m].
        duration: [s], rounded up to a whole step.
        step: Δt [s].
        initial: "static", "rest" or a `State` of one run.
        save: Histories to keep.
        local_compliance: As in `Model.build`.
        refactor: Factorise the coupled matrix at every step, as the paper writes it, instead of the constant K̂ once;
            the same result, other cost.

    Raises:
        ValueError: If an input is out of range.
    """
    return hht_alpha(
        vehicle, track, contact, speed=speed, irregularity=irregularity, start=start, duration=duration, step=step,
        initial=initial, save=save, local_compliance=local_compliance, refactor=refactor, alpha=0.0,
    )  # fmt: skip


def newmark_hertz(
    vehicle: Vehicle,
    track: Line,
    contact: Contact,
    *,
    speed: float,
    irregularity: Any,
    start: float,
    duration: float,
    step: float,
    initial: str | State = "static",
    save: SaveAt | None = None,
    local_compliance: bool = True,
    relaxed: bool = True,
) -> MethodResult:
    """NMN: Newmark's average acceleration, Hertz contact, iterated between vehicle and track in every step.

    The iteration ends when no force changes by 1e-6 of the static load; `result.iterations` counts its passes. Where it
    does not end the run stops: `status` is 1 and `converged` false. The local rail compliance is solved with the law.

    Args:
        vehicle: The vehicle.
        track: The track.
        contact: A Hertz contact.
        speed: [m/s].
        irregularity: r(x): an `Irregularity`, a callable of an array, or None.
        start: x of wheel 1 at t = 0 [m].
        duration: [s], rounded up to a whole step.
        step: Δt [s].
        initial: "static", "rest" or a `State` of one run.
        save: Histories to keep.
        local_compliance: As in `Model.build`.
        relaxed: Scale the changes by Aitken's factor; false for the plain iteration, which needs short steps.

    Raises:
        ValueError: If an input is out of range or the contact is not Hertz's.
    """
    if contact.law != "hertz":
        raise ValueError(f"contact.law = {contact.law!r}: newmark_hertz iterates on Hertz's law, accepted is 'hertz'")
    scheme = Newmark(float(step))
    system, state, steps = prepare(vehicle, track, contact, speed, irregularity, start, duration, step, initial,
                                    local_compliance)  # fmt: skip

    def method() -> Method:
        rest = system.inputs.rest
        return NewmarkMethod(
            CoupledRun(system, state, IteratedContact(rest.constants, rest.load, relaxed=relaxed)), scheme
        )

    return carry_out(system, method, steps, scheme.step, save)


def hht_alpha(
    vehicle: Vehicle,
    track: Line,
    contact: Contact,
    *,
    speed: float,
    irregularity: Any,
    start: float,
    duration: float,
    step: float,
    initial: str | State = "static",
    save: SaveAt | None = None,
    local_compliance: bool = True,
    refactor: bool = False,
    alpha: float = HHT_ALPHA,
) -> MethodResult:
    """APL: the HHT-α method, linear contact coupled directly.

    The contact's stiffness and load are part of K and f, and thus weighted between the ends of the step; which wheels
    are in contact is taken from step n, as in `newmark_linear`.

    Args:
        vehicle: The vehicle.
        track: The track.
        contact: The contact. A Hertz law stands for its tangent at the static load, F = k_c max(δ, 0).
        speed: [m/s].
        irregularity: r(x): an `Irregularity`, a callable of an array, or None.
        start: x of wheel 1 at t = 0 [m].
        duration: [s], rounded up to a whole step.
        step: Δt [s].
        initial: "static", "rest" or a `State` of one run.
        save: Histories to keep.
        local_compliance: As in `Model.build`.
        refactor: As in `newmark_linear`.
        alpha: α [-], from -1/3 to 0.

    Raises:
        ValueError: If an input is out of range.
    """
    scheme = Newmark(float(step), float(alpha))
    system, state, steps = prepare(vehicle, track, linear_of(contact), speed, irregularity, start, duration, step,
                                    initial, local_compliance)  # fmt: skip

    def method() -> Method:
        frozen = FrozenContact(system.inputs.rest.constants)
        return NewmarkMethod(CoupledRun(system, state, frozen, refactor=refactor), scheme)

    return carry_out(system, method, steps, scheme.step, save)


def two_step(
    vehicle: Vehicle,
    track: Line,
    contact: Contact,
    *,
    speed: float,
    irregularity: Any,
    start: float,
    duration: float,
    step: float,
    splitting: float = EQUAL_SPLITTING,
    contact_state: str = "exact",
    initial: str | State = "static",
    save: SaveAt | None = None,
    local_compliance: bool = True,
    refactor: bool = False,
) -> MethodResult:
    """The two-step composite scheme, on the host.

    Args:
        vehicle: The vehicle.
        track: The track.
        contact: The contact, any law.
        speed: [m/s].
        irregularity: r(x): an `Irregularity`, a callable of an array, or None.
        start: x of wheel 1 at t = 0 [m].
        duration: [s], rounded up to a whole step.
        step: Δt [s].
        splitting: γ [-]; 2 - √2 shares one matrix between the substeps, 1/2 is the seed paper's.
        contact_state: "exact" solves for the forces within each substep, as the engine does; "lagged" is the seed
            paper's variant, which freezes the state of step n for both substeps: which wheels are in contact and, for
            Hertz, the secant stiffness K_H √δ_n.
        initial: "static", "rest" or a `State` of one run.
        save: Histories to keep.
        local_compliance: As in `Model.build`.
        refactor: As in `newmark_linear`, for the lagged contact.

    Raises:
        ValueError: If an input is out of range.
    """
    if contact_state not in ("exact", "lagged"):
        raise ValueError(f"contact_state = {contact_state!r}: accepted are 'exact' and 'lagged'")
    scheme = TwoStep(float(step), float(splitting))
    system, state, steps = prepare(vehicle, track, contact, speed, irregularity, start, duration, step, initial,
                                    local_compliance)  # fmt: skip

    def method() -> Method:
        constants = system.inputs.rest.constants
        treatment: Treatment = ExactContact(constants) if contact_state == "exact" else FrozenContact(constants)
        return TwoStepMethod(CoupledRun(system, state, treatment, refactor=refactor), scheme)

    return carry_out(system, method, steps, scheme.step, save)


def linear_of(contact: Contact) -> Contact:
    """The linear contact that stands for one: Hertz's tangent at the static load; linear and affine ones stay."""
    return replace(contact, law="linear") if contact.law == "hertz" else contact
