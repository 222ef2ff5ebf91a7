"""The methods as functions: a vehicle, a track and a contact in, a result out."""

import time as clock
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from tbatch.engine.prepare import whole_steps
from tbatch.engine.result import DIVERGED, OK, separation_table, summary_table
from tbatch.engine.runs import SaveAt, State
from tbatch.methods.record import Recorder
from tbatch.methods.result import MethodResult
from tbatch.methods.tally import ForceHistory, columns, events
from tbatch.numerics.contact_treatment import ExactContact, FrozenContact, IteratedContact, Treatment
from tbatch.numerics.coupled import CoupledSystem
from tbatch.numerics.coupled_run import CoupledRun, Method
from tbatch.numerics.initial import InitialState, StaticTrack, given_state, rest_state, static_state
from tbatch.numerics.newmark import Newmark, NewmarkMethod
from tbatch.numerics.run_inputs import RunInputs, VehicleTables
from tbatch.numerics.two_step import EQUAL_SPLITTING, TwoStep
from tbatch.numerics.two_step_run import TwoStepMethod
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.profile import Profile
from tbatch.physics.rails import common_rails
from tbatch.physics.static import rest_on_rigid_rail
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle

HHT_ALPHA = -0.1
"""α of the method APL [-]."""
LANDING_WINDOW = 5e-3
"""As the engine's [s]."""


def newmark_linear(
    vehicle: Vehicle,
    track: Track,
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
    scheme = Newmark(float(step))
    system, state, steps = _prepare(vehicle, track, linear_of(contact), speed, irregularity, start, duration, step,
                                    initial, local_compliance)  # fmt: skip

    def method() -> Method:
        frozen = FrozenContact(system.inputs.rest.constants)
        return NewmarkMethod(CoupledRun(system, state, frozen, refactor=refactor), scheme)

    return _carry_out(system, method, steps, scheme.step, save)


def newmark_hertz(
    vehicle: Vehicle,
    track: Track,
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
    system, state, steps = _prepare(vehicle, track, contact, speed, irregularity, start, duration, step, initial,
                                    local_compliance)  # fmt: skip

    def method() -> Method:
        rest = system.inputs.rest
        return NewmarkMethod(
            CoupledRun(system, state, IteratedContact(rest.constants, rest.load, relaxed=relaxed)), scheme
        )

    return _carry_out(system, method, steps, scheme.step, save)


def hht_alpha(
    vehicle: Vehicle,
    track: Track,
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
    system, state, steps = _prepare(vehicle, track, linear_of(contact), speed, irregularity, start, duration, step,
                                    initial, local_compliance)  # fmt: skip

    def method() -> Method:
        frozen = FrozenContact(system.inputs.rest.constants)
        return NewmarkMethod(CoupledRun(system, state, frozen, refactor=refactor), scheme)

    return _carry_out(system, method, steps, scheme.step, save)


def two_step(
    vehicle: Vehicle,
    track: Track,
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
    system, state, steps = _prepare(vehicle, track, contact, speed, irregularity, start, duration, step, initial,
                                    local_compliance)  # fmt: skip

    def method() -> Method:
        constants = system.inputs.rest.constants
        treatment: Treatment = ExactContact(constants) if contact_state == "exact" else FrozenContact(constants)
        return TwoStepMethod(CoupledRun(system, state, treatment, refactor=refactor), scheme)

    return _carry_out(system, method, steps, scheme.step, save)


def linear_of(contact: Contact) -> Contact:
    """The linear contact that stands for one: Hertz's tangent at the static load; linear and affine ones stay."""
    return replace(contact, law="linear") if contact.law == "hertz" else contact


def _prepare(
    vehicle: Vehicle,
    track: Track,
    contact: Contact,
    speed: float,
    irregularity: Any,
    start: float,
    duration: float,
    step: float,
    initial: str | State,
    local_compliance: bool,
) -> tuple[CoupledSystem, InitialState, int]:
    """The coupled system, its initial state and its length in steps."""
    if not (np.isfinite(speed) and speed >= 0.0):
        raise ValueError(f"speed = {speed!r}: a finite number >= 0 m/s is required")
    if not (np.isfinite(duration) and duration > 0.0):
        raise ValueError(f"duration = {duration!r}: a positive, finite time in s is required")
    steps = int(whole_steps(np.array([duration]), step)[0])
    first, last = start - float(vehicle.wheel_offsets.max()), start + speed * steps * step
    if not (first >= 0.0 and last <= track.length * (1.0 + 1e-12)):
        raise ValueError(
            f"start = {start!r}: the wheels would be on x = {first:.3f} ... {last:.3f} m, the track is on "
            f"0 ... {track.length:.3f} m; choose start, speed and duration accordingly"
        )
    span = first, max(last, first + 1e-3)
    inputs = RunInputs(
        vehicle=vehicle,
        tables=VehicleTables.of(vehicle, TwoStep(step)),
        rest=rest_on_rigid_rail(vehicle, contact, common_rails(vehicle, track)),
        speed=float(speed),
        start=float(start),
        evaluate_from=float(start),
        steps=steps,
        profile=Profile.zero() if irregularity is None else Irregularity.of(irregularity).profile(*span),
        wheel_profiles=(None,) * vehicle.wheel_count,
        circumference=1.0,
    )
    ground = StaticTrack(track, track.rail_EI if local_compliance and track.node_dofs else None)
    return CoupledSystem(inputs, ground), _initial(initial, inputs, ground), steps


def _initial(initial: str | State, inputs: RunInputs, ground: StaticTrack) -> InitialState:
    if isinstance(initial, State):
        nodes = (ground.track.node_count, ground.track.node_dofs)
        shapes = {"vehicle": (inputs.vehicle.dof_count,), "track": nodes}
        parts = []
        for name in ("vehicle", "vehicle_velocity", "track", "track_velocity"):
            shape, given = shapes[name.removesuffix("_velocity")], getattr(initial, name)
            array = np.zeros(shape) if given is None else np.asarray(given, float)
            if array.shape not in (shape, (1, *shape)) or not np.isfinite(array).all():
                raise ValueError(f"initial.{name}: finite numbers of shape {shape} are required")
            parts.append(array.reshape(shape))
        return given_state(inputs, ground, *parts)
    if initial not in ("static", "rest"):
        raise ValueError(f"initial = {initial!r}: accepted are 'static', 'rest' or a State")
    return rest_state(inputs, ground) if initial == "rest" else static_state(inputs, ground)


def _carry_out(
    system: CoupledSystem, make: Callable[[], Method], steps: int, step: float, save: SaveAt | None
) -> MethodResult:
    """Step a run to its end, or to where it fails."""
    began = clock.perf_counter()
    method = make()
    recorder = Recorder(method.run, save, steps, step)
    recording, converged, status = 0.0, True, OK
    with np.errstate(all="ignore"):
        for n in range(steps):
            before = method.run.iterations
            try:
                method.advance(n)
                converged = True
            except FloatingPointError:
                converged = False
            recorder.iterations[n] = method.run.iterations - before
            sound = np.isfinite(method.run.force).all() and np.isfinite(method.run.y).all()
            if not (converged and sound):
                status = DIVERGED
                break
            noted = clock.perf_counter()
            recorder.step_done(n + 1)
            recording += clock.perf_counter() - noted
    wall_time = clock.perf_counter() - began - recording
    return _result(system, recorder, step, status, converged, wall_time)


def _result(
    system: CoupledSystem, recorder: Recorder, step: float, status: int, converged: bool, wall_time: float
) -> MethodResult:
    inputs, done = system.inputs, recorder.done
    rest = inputs.rest
    history = ForceHistory(
        step=step,
        force=recorder.force[: done + 1],
        overlap=recorder.overlap[: done + 1],
        position=np.array([inputs.positions(n * step) for n in range(done + 1)]),
        beyond=inputs.evaluate_from,
        load=rest.load,
        separation=rest.constants.separation,
    )
    log = events(history, int(np.floor(LANDING_WINDOW / step * (1.0 + 1e-12))))
    speed = np.array([inputs.speed])
    return MethodResult(
        time=recorder.time,
        status=np.array([status], np.int32),
        steps=np.array([done], np.int64),
        separations=separation_table(log, step),
        summary=summary_table(log, len(rest.load), columns(history), rest.load, speed, step),
        run_steps_per_second=done / wall_time,
        channels=recorder.channels,
        iterations=recorder.iterations[: min(done + 1, len(recorder.iterations))],
        wall_time=wall_time,
        converged=converged,
    )
