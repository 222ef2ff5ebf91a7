"""Strings with units become exact SI numbers, or a plain refusal."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbatch.scenario import units
from tbatch.scenario.units import DIMENSIONS, UnitError, to_si


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("0.1 ms", "s", 1e-4),
        ("300 km/h", "m/s", 300 / 3.6),
        ("300km/h", "m/s", 300 / 3.6),
        ("60 MN/m", "N/m", 60e6),
        ("47.7 kN*s/m", "N*s/m", 47700.0),
        ("47.7 kN·s/m", "N*s/m", 47700.0),
        ("20 kN s/m", "N*s/m", 20e3),
        ("1500 t*m^2", "kg*m^2", 1.5e6),
        ("1500 t·m²", "kg*m^2", 1.5e6),
        ("3 µm", "m", 3e-6),
        ("1.15e11 N/m^1.5", "N/m^1.5", 1.15e11),
        ("90 deg", "rad", 1.5707963267948966),
        ("0.3 N/mm", "N/m", 300.0),
        ("-2.5e-3 m", "m", -2.5e-3),
    ],
)
def test_a_string_with_a_unit_is_the_same_number_as_its_si_value(text: str, unit: str, number: float) -> None:
    # Exact: the conversion is rational, so that "0.1 ms" and 1e-4 give the same scenario, bit for bit.
    assert to_si(text, unit) == number


def test_a_cycle_is_a_count_not_an_angle() -> None:
    assert to_si("2 cycle/m", "1/m") == to_si("2 1/m", "1/m") == to_si("2 /m", "1/m") == 2.0
    with pytest.raises(UnitError):  # 2 rad/m would be 0.32 cycle/m: never taken for one or the other
        to_si("2 rad/m", "1/m")


@pytest.mark.parametrize("unit", DIMENSIONS)
def test_the_example_of_each_unit_is_accepted(unit: str) -> None:
    assert to_si(DIMENSIONS[unit][1], unit) > 0.0


@pytest.mark.parametrize(
    ("text", "unit", "says"),
    [
        ("70 kg", "N/m", "measures mass, not stiffness"),
        ("60 MN/m^2", "N/m", "measures stiffness per metre of track, not stiffness"),
        ("70", "m", "no unit"),
        ("seventy m", "m", "not a number"),
        ("nan m", "m", "not a number"),
        ("1.2.3 m", "m", "not a number"),
        ("3 kmh", "m/s", "unknown unit: 'kmh'"),
        ("5 %", "m", "does not measure length"),
        ("1e999 m", "m", "too large"),
    ],
)
def test_a_string_of_another_kind_is_refused_in_words(text: str, unit: str, says: str) -> None:
    with pytest.raises(UnitError, match=says.replace("(", r"\(")):
        to_si(text, unit)


@pytest.mark.parametrize(
    "text", ["9**9**9**9 m", "1 m^9^9^9^9", "1 m**9**9**9", "1 ((((m^9)^9)^9)^9)^9", "1 m*(2", "1 __import__('os')"]
)
def test_arithmetic_in_a_unit_is_refused_and_not_evaluated(text: str) -> None:
    with pytest.raises(UnitError):
        to_si(text, "m")


@settings(max_examples=150, deadline=None)
@given(st.text(max_size=30) | st.from_regex(r"-?[0-9]{1,3}(\.[0-9])? ?[a-zA-Z*/^() 0-9²·]{0,12}", fullmatch=True))
def test_any_text_gives_a_number_or_a_unit_error(text: str) -> None:
    for unit in ("m", "N*s/m", "1/m", "rad"):
        try:
            assert isinstance(to_si(text, unit), float)
        except UnitError as error:
            assert str(error)


def fresh_factor():
    """Metres per second in a km/h, from units read anew."""
    units._registry.cache_clear()
    units._factor.cache_clear()
    return to_si("300 km/h", "m/s")


def test_parsed_units_are_kept_between_starts_and_a_damaged_file_of_them_harms_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("TBATCH_CACHE", str(tmp_path))
    for damage in (b"", b"\x80\x05junk", b"\x80\x05K\x01."):  # nothing, no pickle, a pickle of something else
        assert fresh_factor() == 300 / 3.6
        kept = list(tmp_path.rglob("*.pickle"))
        assert kept
        for path in kept:
            path.write_bytes(damage)
    assert fresh_factor() == 300 / 3.6
    units._registry.cache_clear()
