"""A comparison scores every method against a converged reference, saves what it prints, and draws it."""

import csv
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import tbatch as tb
from tbatch.methods.case import METHODS, Case, highest_frequency
from tbatch.methods.comparison import Comparison, compare
from tbatch.methods.report import comparison_text, save_comparison

STEPS = (1e-3, 1e-4, 5e-5)


def case(kind: str) -> Case:
    flat = tb.Irregularity.flat(depth=2.15e-3, length=0.150, at=10.0)
    contact = tb.Contact.hertz(wheel_radius=0.4575)
    if kind == "rigid":
        parts = tb.Vehicle.column("koh-column"), tb.Track.rigid(length=30.0)
    else:
        parts = tb.Vehicle.column("koh-column"), tb.Track.winkler("koh-winkler", length=20.0, elements=80)
    return Case("flat", tb.Model.build(*parts, contact, step=1e-4), 32.5, flat, 9.0, 0.06)


@cache
def comparison(kind: str = "winkler") -> Comparison:
    return compare(case(kind), steps=STEPS)


def test_every_method_is_scored_at_every_step() -> None:
    scores = comparison().scores
    assert [(one.method, one.step) for one in scores] == [(name, step) for step in STEPS for name in METHODS]
    for one in scores:
        assert set(one.error) == {"displacement", "force", "wheel_acceleration", "track_acceleration"}
        assert one.steps == round(0.06 / one.step)
        assert one.wall_time > 0.0


def test_errors_fall_with_the_step_and_are_the_papers_measures() -> None:
    result = comparison()
    errors = {(one.method, one.step): one.error for one in result.scores}
    for measure in ("displacement", "force", "wheel_acceleration"):
        assert errors["two-step", 1e-3][measure] > 5.0 * errors["two-step", 5e-5][measure]
    # Of the force, by hand: the largest difference at the common times by the static load.
    ours, exact = result.responses["two-step", 1e-4], result.responses["reference", 5e-5]
    by_hand = np.abs(ours.contact_force[0] - exact.contact_force[0, ::2]).max() / 40221.0
    assert errors["two-step", 1e-4]["force"] == pytest.approx(by_hand, rel=1e-9)
    assert all(error < 0.2 * errors["two-step", 5e-5][name] for name, error in result.reference_error.items())


def test_nml_pulls_at_the_flat_and_two_step_does_not() -> None:
    scores = {(one.method, one.step): one for one in comparison().scores}
    assert scores["NML", 1e-4].pull > 1e3
    assert scores["two-step", 1e-4].pull == 0.0
    assert scores["NML", 1e-4].error["force"] > 2.0 * scores["two-step linear", 1e-4].error["force"]
    assert scores["NML", 1e-4].iterations_max == 1
    assert scores["NMN", 1e-4].iterations_mean > 1.0


def test_the_spectral_radius_tells_what_rings() -> None:
    radius = {one.method: one.radius for one in comparison().scores if one.step == 1e-3}
    assert radius["NML"] == pytest.approx(1.0, abs=1e-6)
    assert radius["two-step"] < 0.1
    assert radius["two-step"] < radius["APL"] < 0.83


def test_the_highest_frequency_is_the_whole_tracks() -> None:
    from scipy.linalg import eigh

    track = tb.Track.winkler("koh-winkler", length=10.0, elements=40)
    model = tb.Model.build(tb.Vehicle.column("koh-column"), track, tb.Contact.hertz(wheel_radius=0.46), step=1e-4)
    free = track.free.ravel()
    K, M = (part.to_csc().toarray()[np.ix_(free, free)] for part in (track.stiffness, track.mass))
    top = np.sqrt(eigh(K, M, eigvals_only=True)[-1])
    # Its mode is as short as an element; a few elements have it to some per cent.
    assert highest_frequency(Case("x", model, 1.0, None, 1.0, 1.0)) == pytest.approx(top, rel=0.05)


def test_what_is_saved_is_what_is_printed(tmp_path: Path) -> None:
    result = comparison()
    files = save_comparison(result, tmp_path)
    assert {path.name for path in files} == {
        "methods.json", "methods.csv", "responses_100us.csv", "responses_1000us.csv"
    }  # fmt: skip
    document = json.loads((tmp_path / "methods.json").read_text())
    with (tmp_path / "methods.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(document["scores"]) == len(result.scores)
    assert float(rows[0]["error_force"]) == pytest.approx(document["scores"][0]["error_force"])
    text = comparison_text(result)
    assert all(name in text for name in METHODS)
    with (tmp_path / "responses_100us.csv").open() as file:
        header, *lines = csv.reader(file)
    assert header[0] == "time_s"
    assert len(lines) == 601
    assert any("reference" in name for name in header)


def test_plots_are_drawn_from_it(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from tbatch.view.comparison import plot_comparison

    files = plot_comparison(comparison(), tmp_path)
    assert [path.name for path in files] == [
        "work_precision.png", "convergence.png", "responses_100us.png", "responses_1000us.png"
    ]  # fmt: skip
    assert all(path.stat().st_size > 20_000 for path in files)


def test_a_rigid_track_is_compared_by_force_and_wheel() -> None:
    result = compare(case("rigid"), steps=(1e-4,), methods=("two-step", "NML"))
    assert set(result.reference_error) == {"force", "wheel_acceleration"}


def test_unknown_methods_and_steps_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="two-step linear"):
        compare(case("rigid"), methods=("Runge-Kutta",))
    with pytest.raises(ValueError, match="whole multiple"):
        compare(case("rigid"), steps=(1e-4, 7e-5))
    with pytest.raises(ValueError, match="reference_step"):
        compare(case("rigid"), steps=(1e-4,), reference_step=2e-5)
