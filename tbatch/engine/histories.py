"""Histories: the channels of `SaveAt`, from the kernel's sample buffer into arrays by run."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tbatch.engine import rows as channel_rows
from tbatch.engine.aligned import aligned_zeros
from tbatch.engine.batch import Batch
from tbatch.engine.model import Model
from tbatch.engine.rows import LANES, LAYERS
from tbatch.engine.runs import SaveAt
from tbatch.numerics.factorization import BlockFactor, factor_of
from tbatch.numerics.inertia import inertia
from tbatch.numerics.initial import InitialState
from tbatch.numerics.rows import shape_at
from tbatch.numerics.run_inputs import RunInputs
from tbatch.numerics.sparse_factor import SparseFactor

UNDER_WHEEL = {f"{layer}_under_wheel": layer for layer in LAYERS}
"""The layer of each channel that follows the wheels."""


@dataclass(frozen=True, eq=False)
class Piece:
    """What one chunk of steps added to the histories; to be read, not written."""

    runs: tuple[int, ...]
    """The runs that it is of."""
    first: int
    """Number of its first sample."""
    channels: dict[str, np.ndarray]
    """Its samples by channel, shape (run, sample, ...); NaN after a run's end."""


Follow = Callable[[Piece], None]
"""Takes each piece while the simulation goes on; may raise to stop it."""


class Histories:
    """The saved channels of a simulation, shape (saved run, n, ...) each, NaN after a run's end.

    Args:
        model: The model.
        save: What to keep; None for nothing.
        steps: Length of each run in steps, shape (run,).

    Raises:
        ValueError: If `save` does not fit the model: a layer or point the track has not, or a time that
                is no multiple of the step.
    """

    def __init__(self, model: Model, save: SaveAt | None, steps: np.ndarray) -> None:
        self.model, self.save = model, save
        self.every_steps = 0 if save is None else every_steps(save.every, model.step)
        self.time: np.ndarray = np.zeros(0)
        self.channels: dict[str, np.ndarray] = {}
        self._rows: dict[int, int] = {}
        self._layers: list[str] = []
        self.probe_rows, self.probe_shape = np.zeros((0, 2), np.int32), np.zeros((0, 4))
        self.sample_rows = np.full(channel_rows.CHANNELS, -1, np.int32)
        self._width = 0
        self._mass_factor: BlockFactor | SparseFactor | None = None
        if save is None:
            return
        saved = range(len(steps)) if save.runs is None else save.runs
        unknown = [run for run in saved if not 0 <= run < len(steps)]
        if unknown:
            raise ValueError(f"save.runs: {unknown[0]} is not one of the {len(steps)} runs, counted from 0")
        self._rows = {run: row for row, run in enumerate(saved)}
        samples = max((int(steps[run]) for run in saved), default=0) // self.every_steps + 1
        self.time = np.arange(samples) * self.every_steps * model.step
        self._plan(save)
        widths = channel_widths(model, save)
        for name in save.channels:
            self.channels[name] = np.full((len(saved), samples, widths[name]), np.nan)

    def _plan(self, save: SaveAt) -> None:
        """Probes of the layers and the place of each channel in a sample."""
        needed = {"rail" if name == "rail_acceleration" else name for name in save.channels}
        self._layers = [layer for layer in LAYERS if layer in needed]
        track = self.model.track
        if track.window is not None and (self._layers or "rail_acceleration" in needed):
            raise ValueError(
                "save.channels: the points of rail, slab and base come and go on an endless track; "
                "take 'rail_under_wheel', 'slab_under_wheel', 'base_under_wheel' there"
            )
        under = {UNDER_WHEEL[name] for name in needed.intersection(UNDER_WHEEL)}
        # A rigid rail is level under its wheels.
        for layer in (*self._layers, *sorted(under - {"rail"})):
            if layer not in track.layers:
                raise ValueError(f"save.channels: {layer!r} is not a layer of a {track.kind} track")
        if self._layers:
            track.locate(save.rail_at)
            element, _, shape = shape_at(track, np.asarray(save.rail_at, float))
            rows = np.concatenate([track.layer_rows(element, layer) for layer in self._layers])
            self.probe_rows = np.ascontiguousarray(rows[:, [0, 2]].astype(np.int32))
            self.probe_shape = np.tile(shape, (len(self._layers), 1))
        dofs, wheels = self.model.vehicle.dof_count, self.model.vehicle.wheel_count
        plans = (
            (channel_rows.FORCE, "contact_force" in needed, wheels),
            (channel_rows.VEHICLE, "vehicle" in needed, dofs),
            (channel_rows.VEHICLE_ACCELERATION, "vehicle_acceleration" in needed, dofs),
            (channel_rows.LEVEL, "irregularity" in needed, wheels),
            (channel_rows.PROBE, bool(needed.intersection(save.channels).intersection(LAYERS)), len(self.probe_rows)),
            (channel_rows.PROBE_ACCELERATION, "rail_acceleration" in save.channels, len(self.probe_rows)),
            *((_under_wheel_row(name), name in needed, wheels) for name in UNDER_WHEEL),
        )
        for channel, wanted, width in plans:
            if wanted:
                self.sample_rows[channel] = self._width
                self._width += width

    @property
    def probe_rows_needed(self) -> int:
        """Rows of lane memory for the accelerations of the probes."""
        return 2 * len(self.probe_rows)

    def places_of_saved(self, members: list[int]) -> list[int]:
        """Places in a batch of the saved runs, whose blocks come first: the others are not sampled."""
        return [place for place, run in enumerate(members) if run in self._rows]

    def buffer(self, members: list[int], batch: Batch, chunk: int) -> np.ndarray:
        """Room for the samples of one chunk, shape (block, sample, row, lane), for the blocks that hold saved runs."""
        blocks = max((int(batch.seat[place]) // LANES for place in self.places_of_saved(members)), default=0) + 1
        slots = chunk // self.every_steps + 1 if self.every_steps else 1
        return aligned_zeros((blocks, slots, max(self._width, 1), LANES))

    def begin(self, run: int, inputs: RunInputs, state: InitialState) -> None:
        """The sample at t = 0 of one run."""
        if run not in self._rows:
            return
        model = self.model
        track = model.track
        positions = inputs.local_positions(0.0, inputs.passed)
        first: dict[str, np.ndarray] = {
            "contact_force": state.force,
            "vehicle": state.displacement,
            "irregularity": inputs.levels(0.0),
        }
        for name in set(self.channels).intersection(UNDER_WHEEL):
            first[name] = model.ground.under_wheels(positions, state.track, UNDER_WHEEL[name])
        if "vehicle_acceleration" in self.channels:
            vehicle = inputs.vehicle
            load = -vehicle.stiffness @ state.displacement - vehicle.damping @ state.velocity
            load[list(vehicle.wheel_dofs)] += inputs.rest.load - state.force
            first["vehicle_acceleration"] = np.linalg.solve(vehicle.mass, load)
        for number, layer in enumerate(self._layers):
            first[layer] = self._probes(number, state.track)
        if "rail_acceleration" in self.channels:
            if self._mass_factor is None:
                self._mass_factor = factor_of(*inertia(track))
            load = np.einsum("ndw,w->nd", model.ground.loads(positions), state.force)
            load -= track.stiffness.dot(state.track) + track.damping.dot(state.track_velocity)
            first["rail_acceleration"] = self._probes(self._layers.index("rail"), self._mass_factor.solve(load))
        for name, history in self.channels.items():
            history[self._rows[run], 0] = first[name]

    def _probes(self, layer: int, vector: np.ndarray) -> np.ndarray:
        """Values of one layer's probes from a track vector of shape (node, dof)."""
        count = history_points(self.save)
        points = slice(layer * count, (layer + 1) * count)
        rows, shape, flat = self.probe_rows[points], self.probe_shape[points], vector.ravel()
        near, far = rows[:, 0], rows[:, 1]
        return (shape[:, 0] * flat[near] + shape[:, 1] * flat[near + 1]) + (
            shape[:, 2] * flat[far] + shape[:, 3] * flat[far + 1]
        )

    def take(self, members: list[int], samples: np.ndarray, first: int, count: int, batch: Batch) -> None:
        """Copy the samples of steps first + 1 ... first + count, up to each run's end."""
        if not self._rows:
            return
        every = self.every_steps
        begin, end = first // every + 1, (first + count) // every + 1
        completed = batch.steps
        alive = batch.lanes(batch.memory[:, batch.at.active : batch.at.active + 1])[:, 0] > 0.5
        for place, run in enumerate(members):
            if run not in self._rows:
                continue
            stop = end if alive[place] else min(end, int(completed[place]) // every + 1)
            if stop <= begin:
                continue
            seat = int(batch.seat[place])
            taken = samples[seat // LANES, : stop - begin, :, seat % LANES]
            for name, history in self.channels.items():
                row, width = self._rows_of(name), history.shape[2]
                history[self._rows[run], begin:stop] = taken[:, row : row + width]

    def piece(self, members: list[int], first: int, count: int) -> Piece | None:
        """The samples of the same steps, for whoever follows; None where there is none. The first has t = 0 too."""
        runs = tuple(run for run in members if run in self._rows)
        every = max(self.every_steps, 1)
        begin, end = first // every + 1 if first else 0, (first + count) // every + 1
        if not runs or begin >= end:
            return None
        rows = [self._rows[run] for run in runs]
        return Piece(runs, begin, {name: history[rows, begin:end] for name, history in self.channels.items()})

    def _rows_of(self, name: str) -> int:
        """First row of a channel in a sample."""
        if name == "rail_acceleration":
            points = history_points(self.save)
            return int(self.sample_rows[channel_rows.PROBE_ACCELERATION]) + self._layers.index("rail") * points
        if name in LAYERS:
            return int(self.sample_rows[channel_rows.PROBE]) + self._layers.index(name) * history_points(self.save)
        channel = {
            "contact_force": channel_rows.FORCE,
            "vehicle": channel_rows.VEHICLE,
            "vehicle_acceleration": channel_rows.VEHICLE_ACCELERATION,
            "irregularity": channel_rows.LEVEL,
            **{under: _under_wheel_row(under) for under in UNDER_WHEEL},
        }[name]
        return int(self.sample_rows[channel])


def _under_wheel_row(name: str) -> int:
    """Place in `sample_rows` of a channel that follows the wheels."""
    return channel_rows.UNDER_WHEEL + LAYERS.index(UNDER_WHEEL[name])


def channel_widths(model: Model, save: SaveAt) -> dict[str, int]:
    """Numbers in a sample of each saved channel."""
    dofs, wheels, points = model.vehicle.dof_count, model.vehicle.wheel_count, len(save.rail_at)
    width = dict.fromkeys(("contact_force", "irregularity", *UNDER_WHEEL), wheels)
    width |= dict.fromkeys(("vehicle", "vehicle_acceleration"), dofs)
    return {name: width.get(name, points) for name in save.channels}


def history_points(save: SaveAt | None) -> int:
    """Number of points at which layers are saved."""
    return 0 if save is None else len(save.rail_at)


def every_steps(every: float, step: float) -> int:
    """Samples apart in steps.

    Raises:
        ValueError: If `every` is not a whole multiple of the step.
    """
    ratio = every / step
    steps = round(ratio)
    if steps < 1 or abs(ratio - steps) > 1e-6 * max(ratio, 1.0):
        raise ValueError(f"save.every = {every:g} s: a whole multiple of the step {step:g} s is required")
    return steps
