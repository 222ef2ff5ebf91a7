"""A loaded scenario has every number, in SI, and is the same scenario when its numbers are loaded again."""

import json
from pathlib import Path
from typing import Any

import pytest

from tbatch.scenario import Scenario, list_catalogue, parse_run_name, run_name, shipped_scenarios
from tbatch.scenario.vehicle import vehicle_models

BASE = """\
[campaign]
name = "base"
[vehicle]
model = "seed-multiwheel"
[track]
model = "seed-slab"
length = "100 m"
[speed]
values = ["300 km/h"]
"""


def load(*overrides: str) -> Scenario:
    return Scenario.from_text(BASE, overrides=overrides)


@pytest.mark.parametrize("name", sorted(shipped_scenarios()))
def test_a_resolved_scenario_loads_as_itself(name: str) -> None:
    scenario = Scenario.load(name)
    through_json = json.loads(json.dumps(scenario.resolved(), allow_nan=False))
    again = Scenario.from_tables(through_json)
    assert again.resolved() == scenario.resolved() == through_json
    assert again.hash == scenario.hash


def test_units_and_defaults_do_not_change_what_a_scenario_is() -> None:
    plain = load(
        "run.start=30.0", "integration.step=1e-4", "contact.law=hertz", "run.distance=auto", "track.length=100"
    )
    assert plain.resolved() == load().resolved()


def test_more_runs_and_what_is_done_with_them_are_the_same_scenario_and_everything_else_is_not() -> None:
    base = load().hash
    assert load("campaign.runs=1000").hash == base
    assert load('keep.timelines="none"', "limits.diverged.max=3").hash == base
    for change in (
        "campaign.seed=1",
        "vehicle.carbody_mass=41 t",
        "track.mortar.damping=84 kN*s/m",
        "contact.local_compliance=false",
        "irregularity.cosines=[{wavelength=3, amplitude=1e-4}]",
        "run.taper=4",
        "integration.step=0.05 ms",
        "integration.splitting=0.5",
    ):
        assert load(change).hash != base


def test_defaults_are_those_of_the_interface() -> None:
    tables = load().resolved()
    # 154 bays of 0.65 m are 100.1 m: wheel 1 stops 15 m before their end.
    assert tables["run"] == {"start": 30.0, "distance": pytest.approx(55.1), "taper": 5.0, "evaluate_from": 10.0}
    assert tables["integration"] == {"scheme": "two-step", "step": 1e-4, "splitting": 0.5857864376269049}
    assert tables["contact"]["law"] == "hertz"
    assert (tables["contact"]["profile"], tables["contact"]["wheel_radius"]) == ("worn", 0.4575)
    assert (tables["track"]["per"], tables["track"]["elements_per_bay"]) == ("fastener", 1)
    assert tables["keep"]["timelines"] == "worst:3"
    assert tables["limits"] == {"diverged": {"max": 0}}
    assert load(
        "irregularity.spectrum=china-trunk-line", "irregularity.wavelengths=[1, 50]", "irregularity.tail=3"
    ).resolved()["irregularity"]["tail_from"] == pytest.approx(0.8)


def test_each_wheel_has_its_own_evaluated_length() -> None:
    scenario = load()
    lengths = [scenario.evaluated_length(0, wheel) for wheel in (1, 2, 3, 4)]
    assert lengths == pytest.approx([45.1, 42.6, 27.6, 25.1])
    assert scenario.evaluated_length(0) == lengths[0]


def test_one_number_of_a_catalogue_vehicle_can_be_changed() -> None:
    changed = load("vehicle.primary.damping=50 kN*s/m", "vehicle.wheelset_mass=1.8 t").resolved()["vehicle"]
    assert changed["primary"] == {"stiffness": 1.6e6, "damping": 50e3}
    assert (changed["wheelset_mass"], changed["bogie_mass"]) == (1800.0, 3000.0)


@pytest.mark.parametrize("model", [name for name in vehicle_models() if name not in ("coach", "column")])
def test_every_vehicle_of_the_catalogue_can_be_written(model: str) -> None:
    track = "koh-winkler" if "column" in model else "seed-slab"
    numbers: dict[str, Any] = load(f"vehicle.model={model}", f"track.model={track}").resolved()["vehicle"]
    by_hand = Scenario.from_tables(
        {
            "campaign": {"name": "hand"},
            "vehicle": {key: value for key, value in numbers.items() if key != "model"},
            "track": {"model": track, "length": 100},
            "speed": {"values": [50]},
        }
    )
    assert by_hand.resolved()["vehicle"] == {**numbers, "model": "column" if "column" in model else "coach"}


@pytest.mark.parametrize(
    ("tables", "elements"),
    [
        ({"model": "koh-winkler", "length": 50, "elements": 77}, 77),
        ({"model": "winkler", "length": 100, "EI": 6.12e6, "mass": 60, "stiffness": 1e7, "damping": 4.9e3}, 400),
        ({"model": "beam", "length": 60, "elements": 40, "EI": "6.6 MN*m^2", "mass": "60 kg/m"}, 40),
        ({"model": "rigid", "length": 80}, None),
    ],
)
def test_every_kind_of_track_can_be_written(tables: dict[str, Any], elements: int | None) -> None:
    scenario = Scenario.from_tables(
        {"vehicle": {"model": "koh-column"}, "track": tables, "speed": {"values": [30]}, "run": {"start": 20}}
    )
    assert scenario.resolved()["track"].get("elements") == elements


def test_what_may_not_be_meant_is_a_warning() -> None:
    def warned(*overrides: str) -> str:
        return "\n".join(load(*overrides).warnings)

    rough = ("irregularity.spectrum=china-trunk-line", "irregularity.wavelengths=[0.3, 50]")
    assert warned() == ""
    assert "behind the last wheel" in warned("run.start=25")
    assert "in front of wheel 1" in warned("run.distance=60")
    assert "wheel 3, 4 to count" in warned("run.distance=25", "run.evaluate_from=10")
    assert "leave the valid band" in warned(*rough)
    assert "leave the valid band" not in warned(*rough, "irregularity.tail=3")
    assert "faded in" in warned(*rough, "irregularity.tail=3", "run.taper=12")
    assert "no wheel meets it" in warned("irregularity.defect=[{kind='flat', at=95, depth=1e-3, length=0.1}]")
    assert "all samples of a speed are the same run" in warned("campaign.runs=2")


def test_run_names_are_read_back() -> None:
    assert run_name(3, 127) == "c03-s000127"
    for pair in ((0, 0), (3, 127), (99, 999_999), (123, 12_345_678)):
        assert parse_run_name(run_name(*pair)) == pair
    for text in ("", "c3-s127", "c03-s0000127", "c03-s000127 ", "c٠٣-s000127"):
        with pytest.raises(ValueError, match="is not the name of a run"):
            parse_run_name(text)


def test_kept_runs_are_told_apart() -> None:
    assert (load("keep.timelines=worst:2").keep.worst, load("keep.timelines=none").keep.worst) == (2, 0)
    named = load('keep.timelines=["c00-s000003"]', "campaign.runs=4").keep
    assert (named.worst, named.runs) == (0, ((0, 3),))


def test_the_schema_holds_every_key_with_its_range_and_no_null() -> None:
    schema = Scenario.json_schema()
    text = json.dumps(schema)
    assert "null" not in text
    step = schema["$defs"]["Integration"]["properties"]["step"]
    assert {"type": "string", "description": "time with a unit", "examples": ["0.1 ms"]} in step["anyOf"]
    assert schema["required"] == ["vehicle", "track", "speed"]
    assert schema["additionalProperties"] is False


def test_lists_name_each_entry_with_its_source() -> None:
    assert dict(list_catalogue("vehicles"))["manchester"].startswith("coach, 10 dofs, carbody 32 t: Iwnicki 1998")
    assert "seed-slab" in dict(list_catalogue("tracks"))
    assert "2 to 200 m" in dict(list_catalogue("spectra"))["china-ballastless"]
    scenarios = dict(list_catalogue("scenarios"))
    assert {"separation_vs_speed", "wheel_flat", "smooth_track", "slab_irregular", "quick"} <= set(scenarios)
    assert all(len(line) > 20 for line in scenarios.values())
    with pytest.raises(ValueError, match='did you mean "tracks"'):
        list_catalogue("track")


def test_the_measured_file_is_known_by_its_content_not_by_its_place(tmp_path: Path) -> None:
    text = BASE + "[irregularity]\nmeasured = { file = 'level.csv' }\n"
    level = "".join(f"{0.25 * i},{(i % 7) / 7}\n" for i in range(1000))
    hashes = []
    for folder, content in ((tmp_path / "a", level), (tmp_path / "b b", level), (tmp_path / "c", level + "250 1\n")):
        folder.mkdir()
        (folder / "level.csv").write_text(content)
        (folder / "s.toml").write_text(text)
        scenario = Scenario.load(folder / "s.toml")
        assert Scenario.from_tables(scenario.resolved()).hash == scenario.hash
        hashes.append(scenario.hash)
    assert hashes[0] == hashes[1] != hashes[2]
