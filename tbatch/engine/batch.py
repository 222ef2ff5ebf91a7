"""Batch: some runs of one model, laid out in blocks of lanes for the kernels."""

from collections.abc import Iterable, Sequence

import numpy as np

from tbatch.engine.aligned import aligned_zeros
from tbatch.engine.model import Model
from tbatch.engine.rows import (
    CLOSED,
    EVENT_COLUMNS,
    EVENTS,
    LANES,
    MARKS,
    OPENED,
    PER_WHEEL,
    PROFILE_COUNT,
    PROFILE_FIRST,
    SEPARATED,
    MarkRows,
    MemoryRows,
)
from tbatch.engine.seating import seats
from tbatch.engine.statistics import Statistics
from tbatch.engine.surfaces import Surfaces
from tbatch.numerics.initial import InitialState
from tbatch.numerics.rows import first_load, shape_at
from tbatch.numerics.run_inputs import RunInputs


class Batch:
    """Lane-blocked memory of some runs. Spare lanes are inactive copies of a run of their block.

    Attributes:
        seat: Lane of each run, counted through all blocks, shape (run,); see `tbatch.engine.seating`.
        memory: Real numbers of each run, shape (block, row, lane); rows by `MemoryRows`.
        marks: Whole numbers of each run, int32, shape (block, row, lane); rows by `MarkRows`.
        displacement: Track u [m, -], shape (block, node * dof, lane).
        velocity: Track u̇ [m/s, 1/s], same shape.
        load: Right-hand side of the track's next solve [N], same shape.
        surfaces: The irregularities and wheel profiles of all runs.
        lockstep: 1 for the blocks whose lanes keep the same course, int32, shape (block,).
        events: Log of separations, shape (block, wheel, place, column, lane).
    """

    def __init__(
        self,
        model: Model,
        inputs: Sequence[RunInputs],
        states: Iterable[InitialState],
        statistics: Statistics,
        *,
        spare_rows: int,
        chunk: int,
    ) -> None:
        vehicle, track, rates = model.vehicle, model.track, len(model.tables.inverse)
        self.count = len(inputs)
        self.at = MemoryRows.of(vehicle.dof_count, vehicle.wheel_count, rates)
        self.seat = seats([course_of(one) for one in inputs])
        blocks = int(self.seat.max()) // LANES + 1
        self._run = np.full((blocks, LANES), -1)  # of each lane, -1 where it is spare
        self._run[self.seat // LANES, self.seat % LANES] = np.arange(self.count)
        wheels = vehicle.wheel_count
        self.spare = self.at.outputs + wheels * statistics.rows
        self.memory = aligned_zeros((blocks, self.spare + spare_rows, LANES))
        self.marks = np.zeros((blocks, MarkRows.total(wheels, statistics.counters), LANES), np.int32)
        track_rows = max(track.node_count * track.node_dofs, 1)
        self.displacement, self.velocity, self.load = (aligned_zeros((blocks, track_rows, LANES)) for _ in range(3))
        self.events = np.zeros((blocks, wheels, event_capacity(chunk), EVENT_COLUMNS, LANES))
        self.surfaces = Surfaces(inputs, model.step, chunk)
        for run, (one, state) in enumerate(zip(inputs, states, strict=True)):
            self._pack(model, int(self.seat[run]), one, state)
            self.surfaces.begin(run)
        self._fill_spare_lanes()
        self._place_surfaces()
        self._pack_statistics(statistics, model.step)
        course = [self.at.speed, self.at.start, self.at.end, *range(self.at.offset, self.at.offset + wheels)]
        self.lockstep = (self.memory[:, course] == self.memory[:, course, :1]).all(axis=(1, 2)).astype(np.int32)

    def _pack(self, model: Model, lane: int, inputs: RunInputs, state: InitialState) -> None:
        """Fill one lane."""
        at, wheels = self.at, self.at.wheels
        memory = self.memory[lane // LANES, :, lane % LANES]
        marks = self.marks[lane // LANES, :, lane % LANES]
        square = at.dofs * at.dofs
        tables, rest = inputs.tables, inputs.rest
        memory[at.stiffness : at.stiffness + square] = tables.stiffness.ravel()
        memory[at.mass : at.mass + square] = tables.mass.ravel()
        memory[at.damping : at.damping + square] = tables.damping.ravel()
        memory[at.inverse : at.inverse + tables.inverse.size] = tables.inverse.ravel()
        memory[at.speed], memory[at.start] = inputs.speed, inputs.start
        memory[at.end], memory[at.evaluate_from] = inputs.steps, inputs.evaluate_from
        memory[at.circumference], marks[MARKS.passed] = inputs.circumference, inputs.passed
        memory[at.hertz] = float(rest.constants.exponent == 1.5)
        for row, values in (
            (at.offset, inputs.vehicle.wheel_offsets),
            (at.contact_stiffness, rest.constants.stiffness),
            (at.separation, rest.constants.separation),
            (at.approach, rest.constants.approach),
            (at.load, rest.load),
            (at.force, state.force),
            (at.overlap, state.overlap),
        ):
            memory[row : row + wheels] = values
        memory[at.active] = 1.0
        memory[at.displacement : at.displacement + at.dofs] = state.displacement
        memory[at.velocity : at.velocity + at.dofs] = state.velocity
        if model.track.node_dofs:
            self.displacement[lane // LANES, :, lane % LANES] = state.track.ravel()
            self.velocity[lane // LANES, :, lane % LANES] = state.track_velocity.ravel()
            first = first_load(model.factor, model.scheme, state.track, state.track_velocity)
            self.load[lane // LANES, :, lane % LANES] = first.ravel()
        self._place(model, memory, marks, inputs)
        for wheel in range(wheels):
            mark = MARKS.wheels + PER_WHEEL * wheel
            marks[mark + OPENED] = marks[mark + CLOSED] = -1
            marks[mark + SEPARATED] = int(state.force[wheel] <= 0.0)
            own = inputs.wheel_profiles[wheel]
            if own is not None:
                marks[mark + PROFILE_FIRST], marks[mark + PROFILE_COUNT] = self.surfaces.own(own)

    def _place(self, model: Model, memory: np.ndarray, marks: np.ndarray, inputs: RunInputs) -> None:
        """Elements and Hermite values of the wheels at t = 0, where the forces f₀ act."""
        element, local, shape = shape_at(model.track, inputs.local_positions(0.0, inputs.passed))
        memory[self.at.local : self.at.local + self.at.wheels] = local
        memory[self.at.shape : self.at.shape + 4 * self.at.wheels] = shape.ravel()
        memory[self.at.level : self.at.level + self.at.wheels] = inputs.levels(0.0)
        marks[MARKS.wheels : MARKS.wheels + PER_WHEEL * self.at.wheels : PER_WHEEL] = element

    def _fill_spare_lanes(self) -> None:
        """Copy a block's first run into its spare lanes, so that nothing there is out of range; none is stepped."""
        for block, lane in np.argwhere(self._run < 0):
            for array in (self.memory, self.marks, self.displacement, self.velocity, self.load):
                array[block, :, lane] = array[block, :, 0]
            self.memory[block, self.at.active, lane] = 0.0

    def need_surfaces(self, first: int, count: int) -> None:
        """Hold the irregularity that the wheels of long runs meet in `count` steps from step `first`."""
        if self.surfaces.need(first, count):
            self._place_surfaces()

    def _place_surfaces(self) -> None:
        """Tell every lane where its irregularity stands."""
        # A spare lane takes the first lane's, which is always used.
        places = self.surfaces.rail[np.where(self._run < 0, self._run[:, :1], self._run)]
        self.marks[:, MARKS.profile : MARKS.profile + 2] = places.swapaxes(1, 2)

    def _pack_statistics(self, statistics: Statistics, step: float) -> None:
        """First values of every accumulator."""
        for wheel in range(self.at.wheels):
            load = self.memory[:, self.at.load + wheel].ravel()
            rows = statistics.start(step, load).reshape(-1, len(self.memory), LANES)
            first = self.at.outputs + wheel * statistics.rows
            self.memory[:, first : first + statistics.rows] = rows.swapaxes(0, 1)

    @property
    def active(self) -> bool:
        """Whether any run is still stepped."""
        return bool(self.memory[:, self.at.active].any())

    def lanes(self, rows: np.ndarray) -> np.ndarray:
        """Reorder (block, row, lane) as (run, row), spare lanes left out."""
        return rows[self.seat // LANES, :, self.seat % LANES]

    @property
    def status(self) -> np.ndarray:
        """0 ok, 1 diverged, shape (run,)."""
        return self.lanes(self.marks[:, MARKS.status : MARKS.status + 1])[:, 0]

    @property
    def steps(self) -> np.ndarray:
        """Steps completed, shape (run,)."""
        return self.lanes(self.marks[:, MARKS.steps : MARKS.steps + 1])[:, 0]

    def take_events(self) -> np.ndarray:
        """Empty the log: shape (event, 2 + column): run in the batch, wheel from 0, then the event's columns."""
        rows = slice(MARKS.wheels + EVENTS, MARKS.wheels + PER_WHEEL * self.at.wheels, PER_WHEEL)
        counts = self.marks[:, rows]
        if not counts.any():
            return np.empty((0, 2 + EVENT_COLUMNS))
        written = np.arange(self.events.shape[2])[:, None] < counts[:, :, None, :]
        block, wheel, place, lane = np.nonzero(written)
        taken = np.column_stack([self._run[block, lane], wheel, self.events[block, wheel, place, :, lane]])
        self.marks[:, rows] = 0
        return taken


def course_of(inputs: RunInputs) -> tuple[object, ...]:
    """What two runs have in common whose wheels are at the same places all the way."""
    return inputs.speed, inputs.start, inputs.steps, inputs.vehicle.wheel_offsets.tobytes()


def event_capacity(chunk: int) -> int:
    """Separations that one wheel can write in a chunk: each needs a step apart and a step in contact, and two ends."""
    return chunk // 2 + 2
