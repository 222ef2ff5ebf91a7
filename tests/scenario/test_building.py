"""A scenario builds what its numbers say: the model, and for each sample a running surface of its own."""

from pathlib import Path

import numpy as np
import pytest

from tbatch.physics.irregularity import Irregularity
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle
from tbatch.scenario import Scenario

ROUGH = """\
[campaign]
name = "rough"
runs = 8
seed = 5
[vehicle]
model = "seed-multiwheel"
[track]
model = "seed-slab"
length = "100 m"
[irregularity]
spectrum = "china-trunk-line"
wavelengths = ["0.3 m", "50 m"]
tail = 3
[speed]
values = ["200 km/h", "300 km/h", "400 km/h"]
"""

SMOOTH = ROUGH.split("[irregularity]")[0] + "[speed]\nvalues = [50]\n"


def test_the_model_is_the_one_that_the_parts_give() -> None:
    scenario = Scenario.from_text(ROUGH, overrides=["vehicle.wheelset_mass=1.9 t", "track.fastener.damping=90 kN*s/m"])
    model = scenario.model()
    assert model is scenario.model()  # factorised once
    vehicle = Vehicle.coach("seed-multiwheel", wheelset_mass=1900.0)
    track = Track.slab("seed-slab", length=100.0, fastener=(120e6, 90e3))
    assert np.array_equal(model.vehicle.mass, vehicle.mass)
    assert np.array_equal(model.vehicle.stiffness, vehicle.stiffness)
    assert np.array_equal(model.track.damping.diagonal, track.damping.diagonal)
    assert model.vehicle.name == "seed-multiwheel"
    assert "changed: wheelset_mass" in model.vehicle.source  # only what was changed
    assert (model.step, model.splitting) == (1e-4, 2 - 2**0.5)


def test_the_surface_of_an_endless_track_does_not_depend_on_how_far_a_run_goes() -> None:
    endless = ["track.length=endless", "run.start=60 m"]
    short, long = (
        Scenario.from_text(ROUGH, overrides=[*endless, f"run.distance={distance} m"]) for distance in (200, 15_000)
    )
    x = np.linspace(60.0, 250.0, 500)
    assert np.array_equal(short.irregularity(3)(x), long.irregularity(3)(x))
    assert long.irregularity(3).period == np.inf


@pytest.mark.parametrize(
    ("track", "kind"),
    [
        ('model = "koh-winkler"\nlength = 60', "winkler"),
        ('model = "beam"\nlength = 60\nelements = 40\nEI = 6.6e6\nmass = 60', "beam"),
        ('model = "rigid"\nlength = 60', "rigid"),
    ],
)
def test_other_tracks_build(track: str, kind: str) -> None:
    text = f'[vehicle]\nmodel = "koh-column"\n[track]\n{track}\n[speed]\nvalues = [30]\n'
    model = Scenario.from_text(text).model()
    assert (model.track.kind, model.track.length, model.rails) == (kind, 60.0, 1)


def test_runs_of_one_sample_share_one_surface_and_start_where_the_scenario_says() -> None:
    scenario = Scenario.from_text(ROUGH)
    runs, durations = scenario.runs([(0, 3), (2, 3), (2, 4)])
    assert runs.irregularity[0] is runs.irregularity[1] is not runs.irregularity[2]
    assert runs.speed.tolist() == [200 / 3.6, 400 / 3.6, 400 / 3.6]
    assert set(runs.start.tolist()) == {30.0}
    assert set(runs.evaluate_from.tolist()) == {10.0}
    assert durations * runs.speed == pytest.approx(55.1)
    with pytest.raises(ValueError, match="case must be 0 to 2"):
        scenario.runs([(3, 0)])


def test_a_sample_depends_on_the_seed_and_its_number_alone() -> None:
    x = np.linspace(10.0, 85.0, 400)
    base = Scenario.from_text(ROUGH).irregularity(3)(x)
    for same in ("campaign.runs=1", "speed.values=[60]", "integration.step=0.05 ms", "track.model=seed-slab"):
        assert np.array_equal(Scenario.from_text(ROUGH, overrides=[same]).irregularity(3)(x), base)
    assert not np.array_equal(Scenario.from_text(ROUGH, overrides=["campaign.seed=6"]).irregularity(3)(x), base)
    assert not np.array_equal(Scenario.from_text(ROUGH).irregularity(4)(x), base)


def test_the_spectrum_does_not_repeat_itself_within_what_the_wheels_visit() -> None:
    for length in (60, 100, 1000, 9000):
        scenario = Scenario.from_text(ROUGH, overrides=[f"track.length={length}", "integration.step=2e-4"])
        visited = scenario.resolved()["run"]["distance"] + 20.0
        assert visited * 1.02 < scenario.irregularity(0).period < visited * 1.05 + 15.0


def test_the_surface_fades_in_from_start_unless_the_taper_is_zero() -> None:
    wave = "irregularity.cosines=[{wavelength='2 m', amplitude='1 mm', phase='30 deg'}]"
    x = np.array([25.0, 30.0, 32.5, 35.0, 60.3])
    exact = 1e-3 * np.cos(np.pi * x + np.pi / 6)
    tapered = Scenario.from_text(SMOOTH, overrides=[wave]).irregularity(0)(x)
    # The rise 3s² - 2s³ is 1/2 in the middle; the rest is round-off.
    assert tapered == pytest.approx(exact * [0.0, 0.0, 0.5, 1.0, 1.0], abs=1e-15)
    assert Scenario.from_text(SMOOTH, overrides=[wave, "run.taper=0"]).irregularity(0)(x) == pytest.approx(
        exact, abs=1e-15
    )


def test_parts_of_a_surface_add_up() -> None:
    flat = "irregularity.defect=[{kind='flat', at='50 m', depth='2 mm', length='100 mm'}]"
    wave = "irregularity.cosines=[{wavenumber='0.2 cycle/m', amplitude='1 mm'}]"
    x = np.linspace(36.0, 80.0, 300)
    both = Scenario.from_text(ROUGH, overrides=[flat, wave]).irregularity(2)(x)
    rough = Scenario.from_text(ROUGH).irregularity(2)(x)
    expected = rough + Irregularity.flat(2e-3, 0.1, 50.0)(x) + Irregularity.cosines(0.2, 1e-3)(x)
    assert both == pytest.approx(expected, abs=1e-15)


def test_a_smooth_rail_is_smooth() -> None:
    assert not Scenario.from_text(SMOOTH).irregularity(0)(np.linspace(0.0, 100.0, 11)).any()


def test_scale_multiplies_the_amplitude() -> None:
    x = np.linspace(40.0, 80.0, 100)
    twice = Scenario.from_text(ROUGH, overrides=["irregularity.scale=2"]).irregularity(0)(x)
    assert twice == pytest.approx(2.0 * Scenario.from_text(ROUGH).irregularity(0)(x), rel=1e-12)


def test_a_measured_window_is_the_file_shifted(tmp_path: Path) -> None:
    chainage = 1000.0 + 0.25 * np.arange(2000)
    level = 1e-3 * np.sin(0.7 * chainage)  # 9 m long waves at 36 points each: the spline follows to 1e-8 m
    np.savetxt(tmp_path / "level.csv", np.stack([chainage, 1e3 * level], axis=1), delimiter=",")
    file = tmp_path / "s.toml"
    x = np.linspace(36.0, 85.0, 200)

    def surface(table: str, sample: int) -> np.ndarray:
        file.write_text(f"{SMOOTH}[irregularity.measured]\nfile = 'level.csv'\n{table}\n")
        return Scenario.load(file).irregularity(sample)(x)

    assert surface("window = 1200", 0) == pytest.approx(1e-3 * np.sin(0.7 * (x + 1170.0)), abs=1e-8)
    assert surface("window = 1200\nup = true", 0) == pytest.approx(-1e-3 * np.sin(0.7 * (x + 1170.0)), abs=1e-8)
    shifts = []
    for sample in range(20):
        drawn = surface("", sample)
        # A sine of known wavenumber shows its shift, up to whole waves, by its phase.
        a, b = np.linalg.lstsq(np.stack([np.sin(0.7 * x), np.cos(0.7 * x)], axis=1), drawn, rcond=None)[0]
        assert np.hypot(a, b) == pytest.approx(1e-3, rel=1e-4)
        shifts.append(np.arctan2(b, a))
    assert len(np.unique(np.round(shifts, 6))) == 20
    assert np.array_equal(surface("", 3), surface("", 3))
