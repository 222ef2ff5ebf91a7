"""Turns the table of runs into each run's constants and its initial state."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tbatch.engine.model import Model
from tbatch.engine.runs import Runs, State
from tbatch.numerics.initial import InitialState, given_state, rest_state, static_state
from tbatch.numerics.run_inputs import RunInputs, VehicleTables
from tbatch.physics.contact import Contact
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.long_profile import LongProfile
from tbatch.physics.profile import Profile
from tbatch.physics.rails import common_rails
from tbatch.physics.static import RigidRest, rest_on_rigid_rail
from tbatch.physics.vehicle import Vehicle

_SMOOTH = Profile.zero()
_KEPT_STATES = 64  # runs on a smooth start share one; a track of a thousand dofs makes each 16 kB


def step_counts(model: Model, runs: Runs, duration: ArrayLike) -> np.ndarray:
    """Length of each run in steps, the duration rounded up to a whole step.

    Args:
        model: The model.
        runs: The runs.
        duration: [s], scalar or shape (run,).

    Raises:
        ValueError: If a duration is not positive, or a wheel would leave the track; names the run.
    """
    durations = np.asarray(duration, float)
    if durations.shape not in ((), (len(runs),)):
        raise ValueError(f"duration: shape {durations.shape} given; a scalar or one entry for each of {len(runs)} runs")
    durations = np.broadcast_to(durations, (len(runs),))
    if not (np.isfinite(durations) & (durations > 0.0)).all():
        raise ValueError("duration: positive, finite times in s are required")
    steps = whole_steps(durations, model.step)
    if steps.max() > 2**31 - 2:
        raise ValueError(f"duration: {steps.max()} steps; at most {2**31 - 2} are possible")
    for run in range(len(runs)):
        vehicle = model.vehicle if runs.vehicle is None else runs.vehicle[run]
        if model.track.window is not None:
            if vehicle.wheel_offsets.max() > model.vehicle.wheel_offsets.max():
                raise ValueError(f"run {run}: its vehicle is longer than the model's, for which the window was made")
            continue
        first = runs.start[run] - vehicle.wheel_offsets.max()
        last = runs.start[run] + runs.speed[run] * float(steps[run]) * model.step
        if first < model.track.begin or last > model.track.end + 1e-12 * model.track.length:
            raise ValueError(
                f"run {run}: its wheels would be on x = {first:.3f} ... {last:.3f} m, the track is on "
                f"{model.track.begin:g} ... {model.track.end:.3f} m; choose start, speed and duration accordingly"
            )
    return steps


def whole_steps(durations: np.ndarray, step: float) -> np.ndarray:
    """Durations in steps, rounded up, at least one; a whole number of steps to round-off stays that number.

    Args:
        durations: [s], shape (run,).
        step: Δt [s].
    """
    return np.maximum(np.ceil(durations / step * (1.0 - 1e-12) - 1e-9).astype(np.int64), 1)


class Preparation:
    """Builds run inputs and initial states; what runs share is computed once."""

    def __init__(self, model: Model, runs: Runs, steps: np.ndarray, initial: str | State) -> None:
        if isinstance(initial, str) and initial not in ("static", "rest"):
            raise ValueError(f"initial = {initial!r}: accepted are 'static', 'rest' or a State")
        self.model, self.runs, self.steps, self.initial = model, runs, steps, initial
        self._wheel_profiles: dict[tuple[int, float], Profile] = {}
        self.forget()

    def forget(self) -> None:
        """Drop what the runs so far share, which grows with their number; of a batch it is needed once."""
        model = self.model
        self._tables: dict[int, VehicleTables] = {id(model.vehicle): model.tables}
        self._rests: dict[tuple[int, int], RigidRest] = {(id(model.vehicle), id(model.contact)): model.rest}
        self._static: dict[tuple[Any, ...], InitialState] = {}
        self._profiles: dict[tuple[int, float, float], tuple[Any, Profile]] = {}

    def inputs(self, run: int) -> RunInputs:
        """Constants of one run.

        Raises:
            ValueError: If its vehicle, contact or irregularity does not fit the model; names the run.
        """
        model, runs = self.model, self.runs
        vehicle = model.vehicle if runs.vehicle is None else runs.vehicle[run]
        contact = model.contact if runs.contact is None else runs.contact[run]
        if vehicle.dof_count != model.vehicle.dof_count or vehicle.wheel_dofs != model.vehicle.wheel_dofs:
            raise ValueError(f"run {run}: its vehicle must have the dofs and wheel dofs of the model's vehicle")
        try:
            rest = self._rest(vehicle, contact)
            low = runs.start[run] - vehicle.wheel_offsets.max()
            high = runs.start[run] + runs.speed[run] * float(self.steps[run]) * model.step
            rough = runs.irregularity[run]
            # A single wheel that stands still visits a point; a profile needs a span.
            span = float(low), float(max(high, low + 1e-3))
            profile: Profile | LongProfile = _SMOOTH
            if rough is not None and model.track.window is not None:
                profile = LongProfile(Irregularity.of(rough), *span)
            elif rough is not None:
                profile = self._profile(rough, *span)
            own, circumference = self._own_profiles(run, vehicle, contact)
        except ValueError as error:
            raise ValueError(f"run {run}: {error}") from error
        return RunInputs(
            vehicle=vehicle,
            tables=self._vehicle_tables(vehicle),
            rest=rest,
            speed=float(runs.speed[run]),
            start=float(runs.start[run]),
            evaluate_from=float(runs.start[run] + runs.evaluate_from[run]),
            steps=int(self.steps[run]),
            profile=profile,
            wheel_profiles=own,
            circumference=circumference,
            window=model.window,
            passed=model.window.passed(float(runs.start[run])),
        )

    def start(self, run: int, inputs: RunInputs) -> InitialState:
        """Initial state of one run."""
        ground = self.model.ground
        if isinstance(self.initial, State):
            return given_state(inputs, ground, *self._given(run, self.initial))
        if self.initial == "rest":
            return rest_state(inputs, ground)
        key = (
            id(inputs.vehicle), id(inputs.rest), tuple(inputs.local_positions(0.0, inputs.passed).tolist()),
            tuple(inputs.levels(0.0).tolist()),
        )  # fmt: skip
        if key not in self._static:
            if len(self._static) >= _KEPT_STATES:
                self._static.clear()
            try:
                self._static[key] = static_state(inputs, ground)
            except ValueError as error:
                raise ValueError(f"run {run}: {error}") from error
        return self._static[key]

    def _profile(self, rough: Any, low: float, high: float) -> Profile:
        """The spline of a surface, made once for the runs that share it; the surface is held, as its id is the key."""
        key = (id(rough), low, high)
        if key not in self._profiles:
            self._profiles[key] = rough, Irregularity.of(rough).spline(low, high)
        return self._profiles[key][1]

    def _vehicle_tables(self, vehicle: Vehicle) -> VehicleTables:
        if id(vehicle) not in self._tables:
            self._tables[id(vehicle)] = VehicleTables.of(vehicle, self.model.scheme)
        return self._tables[id(vehicle)]

    def _rest(self, vehicle: Vehicle, contact: Contact) -> RigidRest:
        key = (id(vehicle), id(contact))
        if key not in self._rests:
            rails = common_rails(vehicle, self.model.track)
            if rails != self.model.rails:
                raise ValueError(f"its vehicle is for {rails} rail(s), the model for {self.model.rails}")
            self._rests[key] = rest_on_rigid_rail(vehicle, contact, rails)
        return self._rests[key]

    def _own_profiles(self, run: int, vehicle: Vehicle, contact: Contact) -> tuple[tuple[Profile | None, ...], float]:
        """Profiles of a run's wheels over one turn, and the length of a turn [m]."""
        round_wheels: tuple[Profile | None, ...] = (None,) * vehicle.wheel_count
        entry = None if self.runs.wheel_profile is None else self.runs.wheel_profile[run]
        if entry is None:
            return round_wheels, 1.0
        own: Sequence[Any] = (entry,) * vehicle.wheel_count if callable(entry) else tuple(entry)
        if len(own) != vehicle.wheel_count:
            raise ValueError(f"wheel_profile: {len(own)} entries given for {vehicle.wheel_count} wheels")
        radius = contact.wheel_radius or vehicle.wheel_radius
        if radius is None:
            raise ValueError("wheel_profile: needs contact.wheel_radius [m], the period is 2 pi R")
        turn = 2.0 * np.pi * radius
        return tuple(None if rho is None else self._turn(rho, turn) for rho in own), turn

    def _turn(self, rho: Any, turn: float) -> Profile:
        key = (id(rho), turn)
        if key not in self._wheel_profiles:
            self._wheel_profiles[key] = Irregularity.of(rho).profile(0.0, turn)
        return self._wheel_profiles[key]

    def _given(self, run: int, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The arrays of a given state for one run."""
        dofs = self.model.vehicle.dof_count
        track = self.model.track
        nodes = (track.node_count, track.node_dofs)
        return (
            self._part("vehicle", state.vehicle, (dofs,), run),
            self._part("vehicle_velocity", state.vehicle_velocity, (dofs,), run),
            self._part("track", state.track, nodes, run),
            self._part("track_velocity", state.track_velocity, nodes, run),
        )

    def _part(self, name: str, values: ArrayLike | None, shape: tuple[int, ...], run: int) -> np.ndarray:
        if values is None:
            return np.zeros(shape)
        array = np.asarray(values, float)
        if not np.isfinite(array).all():
            raise ValueError(f"initial.{name}: finite numbers are required")
        if array.shape == shape:
            return array.copy()
        if array.shape == (len(self.runs), *shape):
            return array[run].copy()
        raise ValueError(f"initial.{name}: shape {array.shape} given, {shape} or {(len(self.runs), *shape)} required")
