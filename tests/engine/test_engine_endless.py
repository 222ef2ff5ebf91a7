"""An endless track is a window that follows the vehicle: same bits as its reference, same forces as a long line."""

import numpy as np
import pytest
from engine_cases import reference

import tbatch as tb
from tbatch.engine import surfaces
from tbatch.physics import long_profile
from tbatch.physics.long_profile import LongProfile

STEP = 1e-4


@pytest.fixture(scope="module")
def endless() -> tb.Model:
    """The seed coach on the endless slab track; 20 m of margin are enough where only bits are compared."""
    track = tb.Track.slab("seed-slab", length="endless")
    return tb.Model.build(
        tb.Vehicle.coach("seed-multiwheel"), track, tb.Contact.hertz(), step=STEP, window_tolerance=0.02
    )


def rough(sample: int, start: float) -> tb.Irregularity:
    """A rough line that lifts wheels."""
    line = tb.Irregularity.spectrum("china-trunk-line", wavelengths=(0.3, 50.0), tail=3, seed=3, sample=sample)
    return line.taper(start, 0.5)


@pytest.mark.parametrize("speeds", [(83.0,) * 3, (83.0, 60.0, 100.0)], ids=["in lockstep", "lane by lane"])
def test_the_kernels_equal_the_reference_while_the_line_moves(endless: tb.Model, speeds: tuple[float, ...]) -> None:
    runs = tb.Runs(speeds, [rough(sample, 40.3) for sample in range(3)], 40.3)
    result = tb.simulate(endless, runs, 0.03, save=tb.SaveAt(STEP, ("contact_force", "vehicle")))
    # In 0.03 s wheel 1 runs 2.5 m: the line moves three times or more.
    assert (endless.window.passed(40.3 + 0.03 * min(speeds[0], speeds[2])) - endless.window.passed(40.3)) >= 3
    for run in (0, 2):
        alone = reference(endless, runs, 0.03, run)
        assert np.array_equal(alone.force, result.contact_force[run])
        assert np.array_equal(alone.vehicle, result.vehicle[run])


def test_pieces_of_the_irregularity_do_not_show(endless: tb.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_profile, "PIECE", 8.0)
    surface = rough(1, 40.3) + tb.Irregularity.flat(depth=1e-3, length=0.2, at=47.95)
    runs = tb.Runs([83.0, 60.0], [surface, rough(2, 40.3)], 40.3)
    histories = []
    for ahead, chunk in ((128.0, None), (0.5, 7), (3.0, 50)):
        monkeypatch.setattr(surfaces, "AHEAD", ahead)
        histories.append(tb.simulate(endless, runs, 0.12, save=tb.SaveAt(STEP), chunk=chunk).contact_force)
    assert np.array_equal(histories[0], histories[1])
    assert np.array_equal(histories[0], histories[2])


def test_forces_over_200_m_are_those_of_a_260_m_line() -> None:
    vehicle, contact = tb.Vehicle.coach("seed-multiwheel"), tb.Contact.hertz()
    slab = tb.Track.slab
    models = [
        tb.Model.build(vehicle, slab("seed-slab", length="endless"), contact, step=2e-4, window_tolerance=1e-3),
        tb.Model.build(vehicle, slab("seed-slab", length=260.0), contact, step=2e-4),
    ]
    surfaces = [
        tb.Irregularity.spectrum("china-ballastless", wavelengths=(2.0, 50.0), seed=1, sample=sample).taper(40.0, 10.0)
        for sample in range(2)
    ]
    runs = tb.Runs([80.0, 100.0], surfaces, 40.0)
    save = tb.SaveAt(2e-4, ("contact_force", "slab_under_wheel", "base_under_wheel"))
    window, line = (tb.simulate(model, runs, 200.0 / runs.speed, save=save).channels for model in models)
    moving, fixed = window["contact_force"], line["contact_force"]
    difference = np.nanmax(np.abs(moving - fixed), axis=(0, 2)) / models[0].static_load[0]
    # The forces vary by 5 % of the static load; 0.1 % of that is what the window may echo, here 2e-4. Where the wheels
    # are near the long line's own ends, that line's echo is ten times as large.
    middle = slice(len(difference) // 5, len(difference) // 2)
    assert difference[middle].max() < 3e-4
    assert np.nanmax(difference) < 5e-3
    assert np.nanstd(fixed) / models[0].static_load[0] > 0.04
    for layer in ("slab_under_wheel", "base_under_wheel"):
        apart = np.nanmax(np.abs(window[layer] - line[layer]), axis=(0, 2)) / np.nanmax(line[layer])
        assert apart[middle].max() < 3e-4  # 1.1e-4


def test_a_looser_window_is_shorter_and_both_say_what_they_echo() -> None:
    vehicle, track = tb.Vehicle.column("koh-column"), tb.Track.winkler("koh-winkler", length="endless")
    loose, tight = (
        tb.Model.build(vehicle, track, tb.Contact.hertz(), step=STEP, window_tolerance=tolerance)
        for tolerance in (0.05, 0.005)
    )
    assert loose.track.length < tight.track.length
    assert tight.window.echo <= 0.005 < loose.window.echo <= 0.05
    assert "endless" in tight.describe() and f"{tight.window.margin:g} m beyond the outer wheels" in tight.describe()


def test_a_long_profile_holds_two_pieces_whatever_its_length() -> None:
    surface = tb.Irregularity.spectrum("china-trunk-line", wavelengths=(1.0, 50.0), tail=3, seed=1, period=12_000.0)
    profile = LongProfile(surface, 0.0, 10_000.0)
    held = [profile.covering(x, x + 60.0).nbytes for x in np.arange(0.0, 9_900.0, 300.0)]
    # Two pieces of 128 m at 20 knots a metre, and the few knots that each has beyond its ends.
    assert max(held) < 8 * 2 * (128 * 20 + 20)
    x = np.linspace(250.0, 260.0, 101)
    assert np.array_equal(profile(x), LongProfile(surface, 0.0, 10_000.0).covering(200.0, 400.0)(x))
    assert np.abs(profile(x) - surface(x)).max() < 1e-8


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda model: tb.simulate(model, tb.Runs([50.0], None, 3.0), 0.01, save=tb.SaveAt(STEP, ("rail",), 5.0)),
         "slab_under_wheel"),
        (lambda model: tb.simulate(model, tb.Runs([50.0], [rough(0, 40.0)], 40.0), 30.0), "period"),
        (lambda model: tb.Track.winkler("koh-winkler", length="endless", elements=40), "elements"),
        (lambda model: tb.Model.build(model.vehicle, tb.Track.slab("seed-slab", length="endless"), model.contact,
                                      step=STEP, window_tolerance=2.0), "window_tolerance"),
    ],
)  # fmt: skip
def test_what_an_endless_track_cannot_do_is_refused(endless: tb.Model, call, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        call(endless)
