"""Saved histories: their times, their places, and that they obey the equations of motion."""

import numpy as np
import pytest
from engine_cases import LAWS, corrugation, model, reference
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from tbatch.engine.model import Model
from tbatch.engine.runs import CHANNELS, Runs, SaveAt, State
from tbatch.engine.simulate import simulate

STEPS = 60


def table(of: Model, count: int = 2) -> Runs:
    back = float(of.vehicle.wheel_offsets.max())
    return Runs(
        speed=np.linspace(45.0, 55.0, count),
        irregularity=[corrugation(0.5e-3, run) for run in range(count)],
        start=back + 4.0,
    )


def available(of: Model) -> tuple[str, ...]:
    """The channels that a model's track has."""
    missing = {"rail", "slab", "base"} - set(of.track.layers)
    return tuple(name for name in CHANNELS if name.split("_")[0] not in missing)


@pytest.mark.parametrize(("vehicle", "track"), [("column", "winkler"), ("coach", "slab")])
@pytest.mark.parametrize("chunk", [5, None])
def test_a_coarser_history_is_every_third_sample_of_the_full_one(vehicle, track, chunk):
    of = model(vehicle, track)
    points = (2.1, 4.0, 5.3)
    full = simulate(of, table(of), 0.004, save=SaveAt(of.step, available(of), points), threads=1)
    third = simulate(of, table(of), 0.004, save=SaveAt(3 * of.step, available(of), points), threads=1, chunk=chunk)
    np.testing.assert_allclose(third.time, 3e-4 * np.arange(14), rtol=1e-14)
    assert full.time[-1] == pytest.approx(0.004, rel=1e-14)
    assert set(third.channels) == set(available(of))
    for name, history in third.channels.items():
        np.testing.assert_array_equal(history, full.channels[name][:, ::3])


@pytest.mark.parametrize("step", [1e-4, 3e-4, 1e-3])
def test_samples_end_with_each_run_s_last_whole_multiple(step):
    of = Model.build(model("column", "winkler").vehicle, model("column", "winkler").track, LAWS["hertz"], step=step)
    save = SaveAt(4 * step, ("vehicle",))
    result = simulate(of, table(of, 3), [8 * step, 7 * step, 12 * step], save=save, threads=1)
    np.testing.assert_allclose(result.time, 4 * step * np.arange(4), rtol=1e-14)
    known = np.isfinite(result.vehicle[:, :, 0]).sum(axis=1)
    assert known.tolist() == [3, 2, 4]


def test_durations_are_rounded_up_to_whole_steps():
    of = model("column", "winkler")
    durations = [10 * of.step, 10.001 * of.step, 10.999 * of.step, 0.3 * of.step, 0.0123, 3 * 0.1e-4 * 10]
    result = simulate(of, table(of, 6), durations, threads=1)
    # A duration that is a whole number of steps but for round-off is that number.
    assert result.steps.tolist() == [10, 11, 11, 1, 123, 3]


STARTS = {
    "static": "static",
    "rest": "rest",
    "given": State(vehicle=np.linspace(-1e-3, 1e-3, 10), vehicle_velocity=np.linspace(0.2, -0.1, 10)),
}


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("law", LAWS)
def test_accelerations_obey_the_equations_of_motion(law, start):
    of = model("coach", "slab", law)
    runs, duration = table(of), 20 * of.step
    nodes = np.array([3, 31, 40])
    at = nodes * of.track.element_length
    channels = ("vehicle_acceleration", "rail_acceleration")
    result = simulate(of, runs, duration, initial=STARTS[start], save=SaveAt(of.step, channels, at), threads=1)
    one = reference(of, runs, duration, 1, STARTS[start])

    # M q̈ + C q̇ + K q = Γᵀ (P₀ - F), at t_0 too, where the scheme itself needs no acceleration.
    vehicle = of.vehicle
    pull = np.zeros_like(one.vehicle)
    pull[:, list(vehicle.wheel_dofs)] = of.static_load - one.force
    terms = (
        result.vehicle_acceleration[1] @ vehicle.mass,
        one.vehicle_velocity @ vehicle.damping,
        one.vehicle @ vehicle.stiffness,
        -pull,
    )
    # The scheme forms accelerations from differences over Δt: round-off of q times M/Δt².
    allowed = 1e-15 * np.abs(one.vehicle).max() * vehicle.mass.max() / of.step**2
    np.testing.assert_allclose(sum(terms), 0.0, atol=100.0 * allowed + 1e-9 * of.static_load.max())

    # M ü = Nᵀ F - C u̇ - K u; a rail node's own value is its acceleration.
    track = of.track
    factor = splu((track.mass.to_csc() + diags_array(track.pinned.ravel().astype(float))).tocsc())
    for n in (0, 1, 7, 20):
        load = np.einsum("ndw,w->nd", of.ground.loads(one.position[n]), one.force[n])
        load -= track.damping.dot(one.track_velocity[n]) + track.stiffness.dot(one.track[n])
        load[track.pinned] = 0.0
        acceleration = factor.solve(load.ravel()).reshape(load.shape)
        scale = max(np.abs(acceleration).max(), 1.0)
        np.testing.assert_allclose(result.rail_acceleration[1, n], acceleration[nodes, 0], atol=1e-8 * scale)


def test_a_static_start_is_at_rest():
    of = model("coach", "slab")
    save = SaveAt(of.step, ("vehicle_acceleration", "rail_acceleration", "contact_force"), (25.0, 24.0))
    result = simulate(of, Runs([0.0], start=24.0), 10 * of.step, save=save, threads=1)
    # Round-off of the equilibrium: 1e-14 of the load, over the wheelset's mass and the rail's per metre.
    np.testing.assert_allclose(result.vehicle_acceleration, 0.0, atol=1e-6)
    np.testing.assert_allclose(result.rail_acceleration, 0.0, atol=1e-4)
    np.testing.assert_allclose(result.contact_force, of.static_load[0], rtol=1e-9)


def test_the_level_under_each_wheel_is_the_irregularity_there():
    of = model("coach", "slab")
    runs = table(of)
    result = simulate(of, runs, 0.004, save=SaveAt(of.step, ("irregularity",)), threads=1)
    for run in range(2):
        x = (runs.start[run] + runs.speed[run] * result.time)[:, None] - of.vehicle.wheel_offsets
        # The spline is within 1e-9 m of a cosine.
        np.testing.assert_allclose(result.irregularity[run], runs.irregularity[run](x), atol=2e-9)


def test_a_channel_that_was_not_saved_is_an_error_that_names_those_that_were():
    of = model("column", "winkler")
    result = simulate(of, table(of), 0.001, save=SaveAt(of.step, ("vehicle",)), threads=1)
    with pytest.raises(AttributeError, match=r"result.rail was not saved.*vehicle"):
        _ = result.rail
    none = simulate(of, table(of), 0.001, threads=1)
    assert none.time.size == 0
    with pytest.raises(AttributeError, match="none"):
        _ = none.contact_force


def test_progress_counts_every_run_step_once():
    of = model("column", "winkler")
    seen = []
    result = simulate(of, table(of, 9), 1e-4 * np.arange(20, 29), threads=1, chunk=6, progress=seen.append)
    total = sum(range(20, 29))
    assert [one.run_steps_total for one in seen] == [total] * len(seen)
    done = [one.run_steps_done for one in seen]
    assert done == [sum(min(steps, n) for steps in range(20, 29)) for n in (6, 12, 18, 24, 30)]
    assert [one.separations for one in seen] == sorted(one.separations for one in seen)
    assert seen[-1].separations == result.separations.num_rows
    assert result.run_steps_per_second > 0.0


def test_a_caller_can_stop_a_simulation_and_start_another():
    of = model("column", "winkler")

    class Enough(Exception):
        pass

    def stop(progress):
        if progress.run_steps_done >= 40:
            raise Enough

    before = simulate(of, table(of), 0.005, save=SaveAt(of.step), threads=1)
    with pytest.raises(Enough):
        simulate(of, table(of), 0.005, threads=1, chunk=10, progress=stop)
    after = simulate(of, table(of), 0.005, save=SaveAt(of.step), threads=1)
    np.testing.assert_array_equal(before.contact_force, after.contact_force)
