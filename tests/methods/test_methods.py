"""The comparison methods solve the engine's equations, with the order and the faults that they are known for."""

from itertools import pairwise

import numpy as np
import pytest
from method_cases import CHANNELS, HERTZ, LINEAR, METHODS, asked, engine, parts, waves, worst

import tbatch as tb


@pytest.mark.parametrize(("kind", "splitting"), [("column", 0.5), ("rigid", 0.5), ("coach", 2.0 - 2.0**0.5)])
@pytest.mark.parametrize("amplitude", [1e-4, 2e-3])
def test_two_step_on_the_host_is_the_engine(kind: str, splitting: float, amplitude: float) -> None:
    given = asked(kind, 1e-4, waves(amplitude))
    ours = tb.methods.two_step(*parts(kind), HERTZ, **given, splitting=splitting)
    theirs = engine(kind, HERTZ, given, splitting=splitting)
    for channel in given["save"].channels:
        # Same scheme, other algebra: round-off of banded and block factors over 500 steps.
        assert worst(ours.channels[channel], theirs.channels[channel]) < 1e-8
    a, b = ours.summary.to_pylist(), theirs.summary.to_pylist()
    assert len(a) == len(b)
    assert sum(row["separations"] for row in a) > 0 or amplitude < 1e-3
    for mine, other in zip(a, b, strict=True):
        assert mine.keys() == other.keys()
        for key, value in other.items():
            assert mine[key] == pytest.approx(value, rel=1e-6, abs=1e-9, nan_ok=True), key
    for mine, other in zip(ours.separations.to_pylist(), theirs.separations.to_pylist(), strict=True):
        assert mine == pytest.approx(other, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("kind", ["column", "coach"])
@pytest.mark.parametrize("method", ["NML", "APL", "two-step"])
def test_factorising_the_coupled_matrix_at_every_step_gives_the_same(kind: str, method: str) -> None:
    given = asked(kind, 2e-4, waves(2e-3), duration=0.03)
    options = {"contact_state": "lagged"} if method == "two-step" else {}
    one = METHODS[method](*parts(kind), LINEAR, **given, **options)
    other = METHODS[method](*parts(kind), LINEAR, **given, **options, refactor=True)
    assert one.contact_force.min() < 0.0 or kind == "coach"
    for channel in CHANNELS:
        # The same equations by sparse LU and by a low-rank update, round-off over 150 steps.
        assert worst(one.channels[channel], other.channels[channel]) < 1e-7


@pytest.mark.parametrize("method", list(METHODS))
def test_every_method_agrees_with_the_engine_on_fine_steps(method: str) -> None:
    contact = HERTZ if method in ("NMN", "two-step") else LINEAR
    fine = asked("column", 5e-6, waves(1e-4), every=1e-4)
    exact = engine("column", contact, fine)
    result = METHODS[method](*parts("column"), contact, **(asked("column", 2e-5, waves(1e-4), every=1e-4)))
    # 4e-4 is what all have: the start from standstill and the passage of nodes excite waves that 20 µs resolve in part.
    assert worst(result.contact_force, exact.contact_force) < 1e-3
    assert worst(result.rail, exact.rail) < 1e-3


@pytest.mark.parametrize("method", list(METHODS))
def test_every_method_is_second_order_while_the_wheel_keeps_contact(method: str) -> None:
    # On a rigid rail nothing but the wheel on its spring is fast.
    contact = HERTZ if method in ("NMN", "two-step") else LINEAR
    irregularity = waves(1e-4).taper(5.0, 1.0)
    runs = [
        METHODS[method](*parts("rigid"), contact, **asked("rigid", step, irregularity, every=4e-4))
        for step in (2e-4, 1e-4, 5e-5)
    ]
    first, second = (worst(a.vehicle, b.vehicle) for a, b in pairwise(runs))
    # NMN ends its iteration at 1e-6 of the load, far below these differences.
    assert np.log2(first / second) == pytest.approx(2.0, abs=0.15)


def test_a_lagged_contact_pulls_and_errs_more_where_a_wheel_leaves_and_lands() -> None:
    irregularity = tb.Irregularity.flat(depth=2.15e-3, length=0.150, at=5.5)

    def run(step: float, state: str) -> tb.methods.MethodResult:
        given = asked("column", step, irregularity, duration=0.03, every=1e-4)
        return tb.methods.two_step(*parts("column"), LINEAR, **given, contact_state=state)

    best = run(2e-6, "exact")
    errors = []
    for step in (5e-5, 1.25e-5):
        exact, lagged = run(step, "exact"), run(step, "lagged")
        assert exact.summary["force_min"][0].as_py() == 0.0
        assert lagged.summary["force_min"][0].as_py() < 0.0
        errors.append(worst(exact.contact_force, best.contact_force))
        # The exact contact's error is 3.1 % and 0.19 % of the peak; a landing noticed a step late costs five times it.
        assert worst(lagged.contact_force, best.contact_force) > 3.0 * errors[-1]
    # Second order through the impact: a quarter of the step, a sixteenth of the error, with an erratic constant.
    assert errors[0] / errors[1] > 8.0


def test_nmn_reports_its_iterations_and_where_they_fail() -> None:
    given = asked("column", 1e-3, waves(1e-4))
    relaxed = tb.methods.newmark_hertz(*parts("column"), HERTZ, **given)
    plain = tb.methods.newmark_hertz(*parts("column"), HERTZ, **given, relaxed=False)
    assert relaxed.converged
    assert relaxed.iterations.shape == (50,)
    assert 1 < relaxed.iterations.max() < 60
    # At 1 ms the slope of the law times the flexibility under the wheel exceeds one: the plain iteration diverges.
    assert not plain.converged
    assert plain.status[0] == 1
    assert len(plain.iterations) == plain.steps[0] + 1
    assert np.isnan(plain.contact_force[0, int(plain.steps[0]) + 1 :]).all()


def test_both_iterations_end_at_the_same_forces() -> None:
    given = asked("coach", 5e-5, waves(1e-3), duration=0.02)
    relaxed, plain = (tb.methods.newmark_hertz(*parts("coach"), HERTZ, **given, relaxed=flag) for flag in (True, False))
    # Either stops within 1e-6 of the static load; a hundred steps carry that on.
    assert worst(relaxed.contact_force, plain.contact_force) < 2e-5
    assert relaxed.iterations.mean() <= plain.iterations.mean()


def test_newmark_rings_where_two_step_and_hht_do_not() -> None:
    # The vehicle starts from standstill on a smooth rail; 1 ms cannot resolve what that excites in the rail.
    track = tb.Track.winkler("koh-winkler", length=60.0)
    level = {}
    for name, method in METHODS.items():
        contact = HERTZ if name in ("NMN", "two-step") else LINEAR
        save = tb.SaveAt(1e-3, ("rail_acceleration",), [30.0])
        result = method(parts("column")[0], track, contact, speed=32.5, irregularity=None, start=20.0, duration=0.6,
                        step=1e-3, save=save)  # fmt: skip
        level[name] = float(np.sqrt(np.mean(result.rail_acceleration[0, 60:] ** 2)))
    assert level["NML"] > 3.0 * level["two-step"]
    assert level["NMN"] > 3.0 * level["two-step"]
    # HHT with -0.1 leaves what two-step leaves, the quasi-static passage.
    assert level["APL"] == pytest.approx(level["two-step"], rel=0.05)


def test_nml_grows_without_bound_at_a_flat_with_1_ms() -> None:
    track = tb.Track.winkler("koh-winkler", length=60.0)
    flat = tb.Irregularity.flat(depth=2.15e-3, length=0.150, at=25.0)
    given = {"speed": 32.5, "irregularity": flat, "start": 20.0, "duration": 0.3, "step": 1e-3,
             "save": tb.SaveAt(1e-3, ("contact_force",))}  # fmt: skip
    column = parts("column")[0]
    wrong = tb.methods.newmark_linear(column, track, HERTZ, **given)
    right = tb.methods.two_step(column, track, HERTZ, **given)
    assert np.abs(wrong.contact_force).max() > 1e6 * 40.2e3
    assert right.contact_force.max() < 20.0 * 40.2e3
    assert right.contact_force.min() == 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"speed": -1.0}, "speed"),
        ({"duration": 0.0}, "duration"),
        ({"start": 19.9}, "start"),
        ({"step": 0.0}, "step"),
        ({"initial": "anything"}, "initial"),
    ],
)
def test_what_is_out_of_range_is_refused_by_name(changes: dict, said: str) -> None:
    given = asked("column", 1e-3, None) | changes
    with pytest.raises(ValueError, match=said):
        tb.methods.newmark_linear(*parts("column"), LINEAR, **given)


def test_an_endless_track_is_refused() -> None:
    track = tb.Track.winkler("koh-winkler", length="endless")
    with pytest.raises(ValueError, match="finite line"):
        tb.methods.two_step(parts("column")[0], track, LINEAR, **asked("column", 1e-3, None))


def test_options_that_do_not_fit_are_refused() -> None:
    given = asked("column", 1e-3, None)
    with pytest.raises(ValueError, match="contact_state"):
        tb.methods.two_step(*parts("column"), LINEAR, **given, contact_state="frozen")
    with pytest.raises(ValueError, match="hertz"):
        tb.methods.newmark_hertz(*parts("column"), LINEAR, **given)
    with pytest.raises(ValueError, match="refactor"):
        tb.methods.two_step(*parts("column"), LINEAR, **given, refactor=True)


def test_all_initial_states_are_the_engines() -> None:
    given = asked("column", 1e-4, waves(1e-4), duration=0.01)
    vehicle, track = parts("column")
    model = tb.Model.build(vehicle, track, HERTZ, step=1e-4)
    runs = tb.Runs([given["speed"]], [given["irregularity"]], given["start"])
    moving = tb.State(np.array([0.0, 1e-4, 2e-4]), np.array([0.01, 0.0, 0.02]))
    for initial in ("rest", moving):
        ours = tb.methods.two_step(vehicle, track, HERTZ, **given, initial=initial)
        theirs = tb.simulate(model, runs, given["duration"], save=given["save"], initial=initial)
        assert worst(ours.contact_force, theirs.contact_force) < 1e-8
        assert worst(ours.rail_acceleration, theirs.rail_acceleration) < 1e-8
