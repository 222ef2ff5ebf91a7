"""Keeps what a method does: forces at every step, the saved channels at the samples."""

import numpy as np

from tbatch.engine.histories import UNDER_WHEEL
from tbatch.engine.rows import LAYERS
from tbatch.engine.runs import SaveAt
from tbatch.numerics.coupled_run import CoupledRun
from tbatch.numerics.rows import shape_at


class Recorder:
    """The histories of one run.

    Args:
        run: The run, at t = 0.
        save: Which channels to keep.
        steps: Length of the run in steps.
        step: Δt [s].

    Raises:
        ValueError: If a layer or point is not the track's, or a time is no multiple of the step.
    """

    def __init__(self, run: CoupledRun, save: SaveAt | None, steps: int, step: float) -> None:
        self.run, self.step, self.done = run, step, 0
        wheels = len(run.force)
        self.force, self.overlap = np.empty((steps + 1, wheels)), np.empty((steps + 1, wheels))
        self.iterations = np.zeros(steps, np.int64)
        self.every = 0 if save is None else whole_multiple(save.every, step)
        self.channels: dict[str, np.ndarray] = {}
        self._probes: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        if save is not None:
            self._plan(save)
            for name in save.channels:
                self.channels[name] = np.full((1, steps // self.every + 1, len(self._value(name))), np.nan)
        self._keep(0)

    @property
    def time(self) -> np.ndarray:
        """Times of the samples [s], shape (n,)."""
        if not self.channels:
            return np.zeros(0)
        return np.arange(next(iter(self.channels.values())).shape[1]) * self.every * self.step

    def step_done(self, n: int) -> None:
        """Keep the state at t_n, after n steps."""
        self.done = n
        self._keep(n)

    def _keep(self, n: int) -> None:
        self.force[n], self.overlap[n] = self.run.force, self.run.overlap
        if self.channels and n % self.every == 0:
            for name, history in self.channels.items():
                history[0, n // self.every] = self._value(name)

    def _plan(self, save: SaveAt) -> None:
        """Rows and Hermite values of the points of each layer."""
        system = self.run.system
        track = system.track
        for name in save.channels:
            layer = UNDER_WHEEL.get(name, name.removesuffix("_acceleration"))
            if layer not in LAYERS or name == "rail_under_wheel":
                continue
            if layer not in track.layers:
                raise ValueError(f"save.channels: {layer!r} is not a layer of a {track.kind} track")
            if name in UNDER_WHEEL:
                continue
            track.locate(save.rail_at)
            element, _, shape = shape_at(track, np.asarray(save.rail_at, float))
            self._probes[layer] = system.vehicle_dofs + track.layer_rows(element, layer), shape

    def _value(self, name: str) -> np.ndarray:
        """A channel now."""
        run, split = self.run, self.run.system.vehicle_dofs
        if name == "contact_force":
            return run.force
        if name == "vehicle":
            return run.y[:split]
        if name == "vehicle_acceleration":
            return run.acceleration[:split]
        if name == "irregularity":
            return run.wheels.level
        if name in UNDER_WHEEL:
            layers = self.run.system.track.layers
            below = layers[UNDER_WHEEL[name]][0] - layers["rail"][0] if layers else 0
            return -(run.wheels.values[:, 1:] * run.y[run.wheels.rows[:, 1:] + below]).sum(axis=1)
        rows, shape = self._probes[name.removesuffix("_acceleration")]
        return (shape * (run.acceleration if name.endswith("acceleration") else run.y)[rows]).sum(axis=1)


def whole_multiple(every: float, step: float) -> int:
    """Steps between samples.

    Raises:
        ValueError: If `every` is not a whole multiple of the step.
    """
    steps = round(every / step)
    if steps < 1 or abs(every / step - steps) > 1e-6 * max(every / step, 1.0):
        raise ValueError(f"save.every = {every:g} s: a whole multiple of the step {step:g} s is required")
    return steps
