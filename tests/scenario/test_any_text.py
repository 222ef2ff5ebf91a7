"""Whatever stands in a file, loading it ends in a scenario or in a ScenarioError: never in anything else."""

import resource
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tbatch.scenario import Scenario, ScenarioError
from tbatch.scenario.document import Document
from tbatch.scenario.section import inner_section
from tbatch.scenario.source import shipped_scenarios

LINES = [
    line for path in shipped_scenarios().values() for line in path.read_text(encoding="utf-8").splitlines() if line
]

VALUES = st.sampled_from(
    """
    nan inf -inf 1e400 -1e-400 0 -0.0 1e308 99999999999999999999 true 1979-05-27 07:32:00 [] [1,2] [[1]] {} {x=1}
    {stiffness=1e6} "" "auto" "5\u00a0m" "5m" "5kg" "1e300km" "nan" "{0}" '{}' "worst:9" ["c00-s000000"] ["1m","2m"]
    "seed-slab" "seed-multiwheel" "koh-column" "rigid" "beam" "flat" "metre" "random" "/dev/zero" "linear" 1 2 0.5 40
    """.split()
)


def _keys(section: Any, prefix: str) -> list[str]:
    found = []
    for name, field in section.model_fields.items():
        inner = inner_section(field.annotation)
        found += [f"{prefix}{name}"] + ([] if inner is None else _keys(inner, f"{prefix}{name}."))
    return found


KEYS = st.sampled_from(
    [*_keys(Document, ""), "vary", "campaign.stop", "track.sections", "limits.'contact_force.max'", "a.b"]
)


def ends_well(text: str, overrides: list[str] | None = None) -> bool:
    try:
        scenario = Scenario.from_text(text, file="f.toml", overrides=overrides or [])
    except ScenarioError as error:
        assert error.problems
        assert "\n" not in str(error.problems[0])
        return False
    scenario.resolved()
    return True


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=200))
def test_any_text(text: str) -> None:
    ends_well(text)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.sampled_from(LINES), max_size=30).map("\n".join))
def test_lines_of_scenarios_in_any_order(text: str) -> None:
    ends_well(text)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(sorted(shipped_scenarios())), st.dictionaries(KEYS, VALUES, min_size=1, max_size=4))
def test_a_scenario_with_any_keys_set_to_anything(name: str, changes: dict[str, str]) -> None:
    text = shipped_scenarios()[name].read_text(encoding="utf-8")
    ends_well(text, [f"{key}={value}" for key, value in changes.items()])


@pytest.mark.slow
def test_ten_thousand_examples_end_well_in_little_time_and_memory() -> None:
    """Each within 2 s, which is hypothesis' deadline here, and all within 200 MB."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    @settings(max_examples=10_000, deadline=2000, suppress_health_check=list(HealthCheck))
    @given(st.sampled_from(sorted(shipped_scenarios())), st.dictionaries(KEYS, VALUES, min_size=1, max_size=4))
    def changed(name: str, changes: dict[str, str]) -> None:
        text = shipped_scenarios()[name].read_text(encoding="utf-8")
        ends_well(text, [f"{key}={value}" for key, value in changes.items()])

    @settings(max_examples=10_000, deadline=2000)
    @given(st.lists(st.sampled_from(LINES), max_size=30).map("\n".join))
    def mixed(text: str) -> None:
        ends_well(text)

    changed()
    mixed()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 * 1024


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=40))
def test_any_override(text: str) -> None:
    ends_well(shipped_scenarios()["quick"].read_text(encoding="utf-8"), [text])


@settings(max_examples=100, deadline=None)
@given(content=st.binary(max_size=200))
def test_any_bytes(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    file = tmp_path_factory.getbasetemp() / "any.toml"
    file.write_bytes(content)
    with pytest.raises(ScenarioError):
        Scenario.load(file)


def test_the_fuzz_reaches_sound_scenarios_too() -> None:
    assert ends_well(shipped_scenarios()["quick"].read_text(encoding="utf-8"), ["run.start=31"])
