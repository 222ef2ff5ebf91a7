"""The P2 resonance against closed forms."""

import math

import pytest

import tbatch as tb
from tbatch.numerics.initial import StaticTrack
from tbatch.numerics.resonance import p2_frequency

BED = {"EI": 6.6e6, "stiffness": 6e7, "damping": 1e3}


def column(wheel):
    return tb.Vehicle.column(
        carbody_mass=2e4, bogie_mass=2e3, wheel_mass=wheel, secondary=(1e6, 1e4), primary=(2e6, 1e4)
    )


def test_on_a_light_beam_it_is_the_wheel_on_the_static_stiffness():
    """A long beam on a bed gives way by 1/(8 EI β³), β⁴ = k/(4 EI)."""
    ground = StaticTrack(tb.Track.winkler(length=60.0, mass=0.06, **BED), None)
    stiffness = 8.0 * BED["EI"] * (BED["stiffness"] / (4.0 * BED["EI"])) ** 0.75
    for wheel in (300.0, 900.0, 2700.0):
        expected = math.sqrt(stiffness / wheel) / (2.0 * math.pi)
        assert p2_frequency(column(wheel), ground) == pytest.approx(
            expected, rel=2e-3
        )  # the ends 30 m away, and the chord between two frequencies


def test_a_heavy_beam_swings_with_the_wheel():
    """In the static shape m ∫ (w/w0)² dx = 3 m / (2 β) of the beam's mass swings with the wheel, if that is large."""
    mass, wheel = 60.0, 2700.0
    ground = StaticTrack(tb.Track.winkler(length=60.0, mass=mass, **BED), None)
    beta = (BED["stiffness"] / (4.0 * BED["EI"])) ** 0.25
    stiffness = 8.0 * BED["EI"] * beta**3
    expected = math.sqrt(stiffness / (wheel + 1.5 * mass / beta)) / (2.0 * math.pi)
    assert p2_frequency(column(wheel), ground) == pytest.approx(expected, rel=0.025)


def test_none_is_given_where_none_lies_in_the_band():
    ground = StaticTrack(tb.Track.winkler(length=60.0, EI=6.6e6, mass=0.06, stiffness=6e3, damping=10.0), None)
    assert p2_frequency(column(2700.0), ground) is None
