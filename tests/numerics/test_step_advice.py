"""Advice on steps: what must be resolved, and by how much."""

import numpy as np
import pytest

import tbatch as tb
from tbatch.numerics.contact_solve import solve_contact
from tbatch.numerics.step_advice import advice_table, contact_half_period, resolutions
from tbatch.physics.static import rest_on_rigid_rail
from tbatch.scenario import Scenario

COACH = tb.Vehicle.coach("seed-multiwheel")
REST = rest_on_rigid_rail(COACH, tb.Contact.hertz(wheel_radius=0.4575), 2)


def test_the_seeds_wheel_has_a_half_period_of_2_6_ms() -> None:
    assert contact_half_period(COACH, REST) == pytest.approx(2.62e-3, abs=5e-6)
    # The linear law has the same tangent, the affine one too.
    for contact in (tb.Contact.linear(wheel_radius=0.4575), tb.Contact.affine(wheel_radius=0.4575)):
        other = rest_on_rigid_rail(COACH, contact, 2)
        assert contact_half_period(COACH, other) == pytest.approx(contact_half_period(COACH, REST), rel=1e-9)


def test_the_half_period_is_that_of_a_wheel_on_its_spring() -> None:
    # A free wheel on a linear spring, hit with 0.1 m/s, integrated finely: it is in contact for a half-period.
    mass, stiffness, step = 350.0, 1.2e9, 1e-6
    wheel = tb.Vehicle([[mass]], [[0.0]], [[0.0]], [0], [0.0], [40e3])
    rest = rest_on_rigid_rail(wheel, tb.Contact.linear(stiffness), 1)
    q, v, t = 0.0, 0.1, 0.0
    while True:
        # Trapezoidal rule: q₁ = q + h v + h²/4 (a + a₁).
        force = stiffness * q
        free = q + step * v - step**2 / 4.0 * force / mass
        new, overlap, _ = solve_contact(
            np.array([free]), np.array([[step**2 / 4.0 / mass]]), rest.constants, np.zeros(1)
        )
        v -= 0.5 * step * (force + new[0]) / mass
        q, t = float(overlap[0]), t + step
        if q <= 0.0:
            break
    assert t == pytest.approx(contact_half_period(wheel, rest), rel=2e-3)  # one step in 1700


def test_what_is_most_demanding_comes_first_and_the_table_marks_it() -> None:
    found = resolutions(COACH, REST, 100.0, flats=(0.15, 0.04), waves=(0.3, 1.0))
    assert [one.needed for one in found] == [20, 10, 10]
    assert found[0].longest_step == pytest.approx(0.04 / 100.0 / 20.0)
    table = advice_table(1e-4, found).splitlines()
    assert "!" in table[1]
    assert "!" not in table[2] + table[3]


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("seed_fig6", "integration.step=1 ms", "half-period of the wheel on its contact spring (1.68 ms)"),
        ("wheel_flat", "integration.step=0.3 ms", "flat of 150 mm (4.62 ms), 20 are needed: 0.23 ms"),
        ("slab_irregular", "integration.step=0.3 ms", "2.62 ms), 10 are needed: 0.26 ms"),
    ],
)
def test_a_scenario_warns_and_names_the_step_it_would_take(name: str, change: str, said: str) -> None:
    changes = [change, "keep.every=0.3 ms"] if "0.3" in change else [change]
    assert any(said in warning for warning in Scenario.load(name, overrides=changes).warnings)


def test_scenarios_with_a_step_that_resolves_all_do_not_warn() -> None:
    for name in ("wheel_flat", "separation_vs_speed", "slab_irregular", "seed_fig8_rough"):
        assert not [warning for warning in Scenario.load(name).warnings if "integration.step" in warning]
