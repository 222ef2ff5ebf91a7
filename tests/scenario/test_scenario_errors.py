"""Whatever is wrong with a scenario is said at once, with its place and what is accepted."""

import re
from pathlib import Path

import pytest

from tbatch.scenario import Problem, Scenario, ScenarioError
from tbatch.scenario.source import shipped_scenarios

GOOD = """\
[campaign]
name = "good"

[vehicle]
model = "koh-column"

[track]
model = "koh-winkler"
length = "100 m"

[speed]
values = ["117 km/h", 50]

[run]
distance = "40 m"
"""


def problems(text: str = GOOD, *overrides: str) -> dict[str, Problem]:
    with pytest.raises(ScenarioError) as caught:
        Scenario.from_text(text, file="my.toml", overrides=overrides)
    assert str(caught.value) == "\n".join(str(problem) for problem in caught.value.problems)
    return {problem.key: problem for problem in caught.value.problems}


def only(text: str = GOOD, *overrides: str) -> Problem:
    found = problems(text, *overrides)
    assert len(found) == 1, found
    return next(iter(found.values()))


def test_the_good_scenario_is_good() -> None:
    assert Scenario.from_text(GOOD).name == "good"


def test_all_errors_are_reported_at_once_with_their_lines() -> None:
    text = """\
[campaign]
runs = 1.5
[vehicle]
model = "seed-multiwhel"
primary = { stiffnes = 1, damping = "3 kg" }
[track]
length = "70 kg"
[speed]
values = [300, "200 km/h",
   "3 kmh"]
[integration]
step = -1e-4
[keep]
wheel_radius = 3
[speeed]
"""
    found = problems(text)
    assert {key: problem.line for key, problem in found.items()} == {
        "campaign.runs": 2,
        "vehicle.model": 4,
        "vehicle.primary.stiffnes": 5,
        "vehicle.primary.damping": 5,
        "track.model": 6,
        "track.length": 7,
        "speed.values[0]": 9,
        "speed.values[2]": 10,
        "integration.step": 12,
        "keep.wheel_radius": 14,
        "speeed": 15,
    }
    assert all(problem.file == "my.toml" for problem in found.values())
    assert 'did you mean "seed-multiwheel"?' in found["vehicle.model"].message
    assert 'did you mean "stiffness"?' in found["vehicle.primary.stiffnes"].message
    assert "it belongs in [vehicle]" in found["keep.wheel_radius"].message
    assert 'did you mean "speed"?' in found["speeed"].message
    assert "km/h" in found["speed.values[0]"].message  # 300 is meant as km/h, but bare numbers are m/s


def test_a_line_of_text_names_place_key_value_and_what_is_accepted() -> None:
    problem = only(GOOD.replace('"100 m"', '"70 kg"'))
    assert str(problem) == (
        'my.toml:9: track.length = "70 kg": measures mass, not length; '
        'accepted: 1 to 20000 m (a number, or a string such as "100 m") or "endless"'
    )


def test_a_syntax_error_has_line_and_column() -> None:
    problem = only("[campaign]\nruns = \n")
    assert (problem.line, problem.column) == (2, 8)
    assert str(problem).startswith("my.toml:2:8: TOML: ")
    unclosed = only("[campaign]\nruns = [1,\n 2")
    assert (unclosed.line, unclosed.column) == (3, 3)


@pytest.mark.parametrize(
    "value", ["nan", "inf", "1e400", "0", "-3", "true", '"3 m"', "[1]", "1979-05-27", "0x" + "f" * 400]
)
def test_a_step_that_is_no_time_in_range_is_refused(value: str) -> None:
    problem = only(f"{GOOD}[integration]\nstep = {value}\n")
    assert (problem.key, problem.line) == ("integration.step", 17)
    assert problem.accepted is not None and problem.accepted.startswith("1e-07 to 0.01 s")


@pytest.mark.parametrize(
    ("lines", "key"),
    [
        ("[track]\nsections = []", "track.sections"),
        ('[track]\nmodel = "ballast"', "track.model"),
        ('[vehicle]\nmodel = "koh-column"\ncount = 3', "vehicle.count"),
        ('[vehicle]\nmodel = "koh-column"\ncoach_pitch = 25', "vehicle.coach_pitch"),
        *(
            (f'[[irregularity.defect]]\nkind = "{kind}"\nat = 50\nheight = 3', "irregularity.defect[0].kind")
            for kind in ("chord-flat", "periodic-flat", "joint", "weld", "settlement", "corrugation")
        ),
    ],
)
def test_what_comes_later_is_known_and_refused_as_not_yet(lines: str, key: str) -> None:
    table = lines.split("\n")[0]
    text = GOOD
    if table in GOOD.split("\n"):  # put the lines into the table that is there, instead of its own keys
        text = re.sub(re.escape(table) + r"\n(?:[^\[\n].*\n)*", lines + "\n", GOOD, count=1)
    else:
        text += lines + "\n"
    found = problems(text)
    assert "not yet available" in found[key].message
    assert len(found) == 1


def test_an_override_is_named_as_such_and_beats_the_file() -> None:
    assert Scenario.from_text(GOOD, overrides=["run.distance=30 m"]).resolved()["run"]["distance"] == 30.0
    problem = only(GOOD, "run.distance=30 kg")
    assert (problem.file, problem.line, problem.key) == ("--set", None, "run.distance")
    assert "not an override" in only(GOOD, "run.distance").message
    assert "not an override" in only(GOOD, "a]\n[b=3").message
    assert "is not a table" in only(GOOD, "run.distance.x=3").message
    assert only(GOOD, "unknown.x=3").file == "--set"


def test_an_override_takes_toml_values_and_bare_strings() -> None:
    overrides = ['speed.values=["100 km/h", 20]', "vehicle.model=koh-column", "campaign.seed=7", "vehicle.count=1"]
    scenario = Scenario.from_text(GOOD, overrides=[*overrides, "vehicle.primary.stiffness=2 MN/m"])
    assert scenario.speeds == (100 / 3.6, 20.0)
    assert scenario.seed == 7
    assert scenario.resolved()["vehicle"]["primary"] == {"stiffness": 2e6, "damping": 7.1e3}


@pytest.mark.parametrize(
    ("overrides", "key", "accepted"),
    [
        (["vehicle.model=seed-multiwheel", "track.model=seed-slab", "run.start=19.9"], "run.start", "20 to below"),
        (["run.start=86", "run.distance=auto"], "run.start", "0 to below 85 m"),
        (["run.distance=71"], "run.distance", "0.01 to 69.995 m"),
        (["run.evaluate_from=40"], "run.evaluate_from", "0 to below run.distance = 40 m"),
        (["run.distance=auto", "track.length=12 m"], "run.start", "nothing on this track; track.length above 15 m"),
        (["keep.every=0.25 ms"], "keep.every", "a whole multiple of integration.step = 0.0001 s"),
        (['keep.timelines=["c02-s000000"]'], "keep.timelines[0]", "up to c01-s000000"),
        (['keep.channels=["slab"]'], "keep.channels[0]", "a layer of the track"),
        (["contact.stiffness=1 GN/m"], "contact.stiffness", "constant"),
        (["contact.constant=1e11", "contact.profile=worn"], "contact.profile", "either constant"),
        (["irregularity.tail=3"], "irregularity.tail", "china-trunk-line"),
        (["irregularity.spectrum=iso3095"], "irregularity.wavelengths", "two lengths"),
        (
            ["irregularity.spectrum=german-low", "irregularity.wavelengths=[50, 1]"],
            "irregularity.wavelengths",
            "shortest",
        ),
        (
            ["irregularity.spectrum=german-low", "irregularity.wavelengths=[1]"],
            "irregularity.wavelengths",
            "a list of 2, each 0.001 to 10000 m",
        ),
        (["irregularity.cosines=[{amplitude=1e-3}]"], "irregularity.cosines[0]", "either wavenumber"),
        (["vehicle.wheelset_mass=3"], "vehicle.wheelset_mass", "wheel_mass"),
        (["track.fastener.stiffness=1e6"], "track.fastener", "damping, elements, length"),
        (["track.model=seed-slab"], "track.model", "rails = 1"),
        (["speed.values=[]"], "speed.values", "a list of 1 to 1000, each 0.1 to 200 m/s"),
        (["speed.values=3"], "speed.values", "a list of 1 to 1000"),
        (["keep.channels=[]"], "keep.channels", 'a list of 1 to 11, each "contact_force"'),
        (["speed.values=[30, '108 km/h']"], "speed.values", "each speed once"),
        (["vehicle=3"], "vehicle", "model, carbody_mass"),
        (["campaign.name=../elsewhere"], "campaign.name", "letters"),
    ],
)
def test_what_does_not_fit_together_names_its_key_and_the_way_out(
    overrides: list[str], key: str, accepted: str
) -> None:
    problem = only(GOOD, *overrides)
    assert problem.key == key
    assert problem.accepted is not None and accepted in problem.accepted


def test_waves_shorter_than_ten_steps_are_refused_with_the_step_that_would_do() -> None:
    overrides = ["irregularity.spectrum=china-trunk-line", "irregularity.tail=3"]
    wave = "irregularity.wavelengths=[0.049, 50]"  # 50 m/s and 0.1 ms: ten steps are 50 mm
    problem = only(GOOD, *overrides, wave)
    assert problem.key == "irregularity.wavelengths[0]"
    assert problem.accepted == "0.05 m and longer, or integration.step up to 9.8e-05 s"
    Scenario.from_text(GOOD, overrides=[*overrides, wave, "integration.step=0.098 ms"])
    assert only(GOOD, "irregularity.cosines=[{wavelength=0.04, amplitude=1e-5}]").key == "irregularity.cosines[0]"


def test_mortar_and_subgrade_take_the_unit_that_per_says() -> None:
    slab = GOOD.replace("koh-column", "seed-multiwheel").replace("koh-winkler", "seed-slab")
    per_fastener, per_metre = 'track.mortar.stiffness="60 MN/m"', 'track.mortar.stiffness="60 MN/m^2"'
    Scenario.from_text(slab, overrides=[per_fastener])
    Scenario.from_text(slab, overrides=[per_metre, "track.per=metre"])
    assert only(slab, per_metre).key == "track.mortar.stiffness"
    assert only(slab, per_fastener, "track.per=metre").key == "track.mortar.stiffness"


def test_numbers_of_a_vehicle_without_a_catalogue_are_all_asked_for() -> None:
    found = problems(GOOD.replace('model = "koh-column"', "wheel_mass = '350 kg'\nprimary = { stiffness = 1.26e6 }"))
    assert set(found) == {
        "vehicle.carbody_mass",
        "vehicle.bogie_mass",
        "vehicle.primary.damping",
        "vehicle.secondary.stiffness",
        "vehicle.secondary.damping",
    }
    assert all("kg" in (found[f"vehicle.{key}"].accepted or "") for key in ("carbody_mass", "bogie_mass"))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x7fELF\x00\xff\xfe", "UTF-8"),
        ("Fahrspur = 'ä'".encode("latin-1"), "UTF-8"),
        (b"a = 1\x00", "TOML"),
        (b"[" * 1900, "TOML|nested too deeply"),
        (b"a = " + b"[" * 990 + b"]" * 990, "nested too deeply"),
        (b"a." * 5000 + b"a = 1", "too long a line"),
        (b"# " + b"x\n" * 200_000, "too large"),
        (b"a = " + b"\n".join([b"1"]) + b"9" * 1900, "not a known table"),
    ],
)
def test_a_file_that_is_no_scenario_is_refused_in_words(tmp_path: Path, content: bytes, says: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    with pytest.raises(ScenarioError, match=says):
        Scenario.load(file)


def test_a_missing_file_a_folder_and_a_misspelt_name_are_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="no such scenario"):
        Scenario.load(tmp_path / "none.toml")
    with pytest.raises(ScenarioError, match="is a folder"):
        Scenario.load(tmp_path)
    with pytest.raises(ScenarioError, match='did you mean "quick"'):
        Scenario.load("quik")
    for path in ("", "a\0b", "x" * 5000, "/dev/null"):
        with pytest.raises(ScenarioError):
            Scenario.load(path)


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    file = tmp_path / "bom.toml"
    file.write_bytes(b"\xef\xbb\xbf" + GOOD.encode())
    assert Scenario.load(file).name == "good"


def test_the_campaign_is_named_after_its_file_if_it_has_no_name(tmp_path: Path) -> None:
    file = tmp_path / "from file.toml"
    file.write_text(GOOD.replace('name = "good"', ""))
    assert Scenario.load(file).name == "from file"
    odd = tmp_path / "ö.toml"
    odd.write_text(GOOD.replace('name = "good"', ""))
    with pytest.raises(ScenarioError, match=re.escape("campaign.name: is missing")):
        Scenario.load(odd)


def test_measured_files_that_cannot_serve_are_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"

    def refused(lines: str, content: str | None = None) -> Problem:
        if content is not None:
            (tmp_path / "level.csv").write_text(content)
        file.write_text(f"{GOOD}[irregularity]\nmeasured = {{ file = 'level.csv'{lines} }}\n")
        with pytest.raises(ScenarioError) as caught:
            Scenario.load(file)
        (problem,) = caught.value.problems
        assert problem.line == 17
        return problem

    assert "does not exist" in refused("").message
    assert "not two numbers" in refused("", "0 1\n1 x\n").message
    assert "does not lie beyond" in refused("", "0 1\n1 2\n1 3\n2 3\n").message
    short = "".join(f"{0.25 * i} {i % 3}\n" for i in range(100))
    assert refused("", short).accepted == "a file over at least 42 m, or a shorter run.distance"
    long = "".join(f"{0.25 * i} {i % 3}\n" for i in range(400))
    assert refused(", window = 60", long).accepted == '0 to 59.745 m, or "random"'
    assert refused(", unit = 'm'", long).key == "irregularity.measured.unit"
    assert refused(f", sha256 = '{'0' * 64}'", long).message.startswith("has changed")


def test_shipped_scenarios_load_without_a_warning_but_for_the_long_steps_of_the_seed_paper() -> None:
    for name in shipped_scenarios():
        warnings = Scenario.load(name).warnings
        if name in {"seed_fig6", "seed_fig7"}:
            assert len(warnings) == 1 and warnings[0].startswith("integration.step: 1 ms")
        else:
            assert warnings == ()
