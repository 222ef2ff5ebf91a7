"""One run by one method: its constants and initial state, the stepping, the result."""

import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from tbatch.engine.prepare import whole_steps
from tbatch.engine.result import DIVERGED, OK, separation_table, summary_table
from tbatch.engine.runs import SaveAt, State
from tbatch.methods.record import Recorder
from tbatch.methods.result import MethodResult
from tbatch.methods.tally import ForceHistory, columns, events
from tbatch.numerics.coupled import CoupledSystem
from tbatch.numerics.coupled_run import Method
from tbatch.numerics.initial import InitialState, StaticTrack, given_state, rest_state, static_state
from tbatch.numerics.one_thread import one_blas_thread
from tbatch.numerics.run_inputs import RunInputs, VehicleTables
from tbatch.numerics.two_step import TwoStep
from tbatch.numerics.window import Window
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.line import Line
from tbatch.physics.profile import Profile
from tbatch.physics.rails import common_rails
from tbatch.physics.static import rest_on_rigid_rail
from tbatch.physics.vehicle import Vehicle

LANDING_WINDOW = 5e-3
"""As the engine's [s]."""


@one_blas_thread
def prepare(
    vehicle: Vehicle,
    track: Line,
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
    if track.window is not None:
        raise ValueError("track: the comparison methods step a finite line; give track.length in m")
    if not (np.isfinite(speed) and speed >= 0.0):
        raise ValueError(f"speed = {speed!r}: a finite number >= 0 m/s is required")
    if not (np.isfinite(duration) and duration > 0.0):
        raise ValueError(f"duration = {duration!r}: a positive, finite time in s is required")
    steps = int(whole_steps(np.array([duration]), step)[0])
    first, last = start - float(vehicle.wheel_offsets.max()), start + speed * steps * step
    if not (first >= track.begin and last <= track.end + 1e-12 * track.length):
        raise ValueError(
            f"start = {start!r}: the wheels would be on x = {first:.3f} ... {last:.3f} m, the track is on "
            f"{track.begin:g} ... {track.end:.3f} m; choose start, speed and duration accordingly"
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
        window=Window.fixed(),
        passed=0,
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


@one_blas_thread
def carry_out(
    system: CoupledSystem, make: Callable[[], Method], steps: int, step: float, save: SaveAt | None
) -> MethodResult:
    """Step a run to its end, or to where it fails."""
    began, began_cpu = clock.perf_counter(), clock.process_time()
    method = make()
    recorder = Recorder(method.run, save, steps, step)
    recording, recording_cpu, converged, status = 0.0, 0.0, True, OK
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
            noted, noted_cpu = clock.perf_counter(), clock.process_time()
            recorder.step_done(n + 1)
            recording += clock.perf_counter() - noted
            recording_cpu += clock.process_time() - noted_cpu
    result = _result(system, recorder, step, status, converged, clock.perf_counter() - began - recording)
    result.cpu_time = clock.process_time() - began_cpu - recording_cpu
    return result


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
