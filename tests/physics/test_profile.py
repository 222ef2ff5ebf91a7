import math

import numpy as np
import pytest

from tbatch.physics.partition import Piece, overlay
from tbatch.physics.profile import Profile, spline_coefficients


def sampled(function, pieces):
    return Profile.from_pieces(pieces, lambda low, width, count: function(low + width * np.arange(count + 1)))


def by_hand(profile: Profile, x: float) -> float:
    """The evaluation rule, one point at a time, as a kernel does it."""
    segment = 0
    for k, start in enumerate(profile.start.tolist()):
        if start <= x:
            segment = k
    t = (x - float(profile.start[segment])) * float(profile.inverse_spacing[segment])
    i = min(max(math.floor(t), 0), int(profile.intervals[segment]) - 1)
    w = min(max(t - i, 0.0), 1.0)
    o = 1.0 - w
    b0 = o * o * o / 6.0
    b1 = (3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0
    b2 = (3.0 * o * o * o - 6.0 * o * o + 4.0) / 6.0
    b3 = w * w * w / 6.0
    c = profile.coefficient.tolist()
    k = int(profile.first[segment]) + i
    return c[k] * b0 + c[k + 1] * b1 + c[k + 2] * b2 + c[k + 3] * b3


def test_one_point_at_a_time_gives_the_same_bits_as_arrays():
    profile = sampled(np.sin, [Piece(-1.0, 0.3, 0.1), Piece(0.3, 0.7, 0.03), Piece(0.7, 4.0, 0.2)])
    x = np.concatenate([np.linspace(-1.5, 4.5, 501), profile.start, profile.knots])
    assert [by_hand(profile, v) for v in x.tolist()] == profile(x).tolist()


def test_cubics_are_reproduced_ends_included():
    def cubic(x):
        return 1.0 - 2.0 * x + 0.5 * x**2 + 0.3 * x**3

    profile = sampled(cubic, [Piece(0.0, 1.0, 0.2), Piece(1.0, 3.0, 0.1)])
    x = np.linspace(0.0, 3.0, 1001)
    # A spline contains every cubic: only round-off of values up to 8 is left.
    np.testing.assert_allclose(profile(x), cubic(x), rtol=0.0, atol=2e-14)


def test_values_converge_with_fourth_order_up_to_the_ends():
    x = np.linspace(0.0, 1.0, 4001)
    errors = [np.abs(sampled(np.exp, [Piece(0.0, 1.0, 1.0 / n)])(x) - np.exp(x)).max() for n in (16, 32, 64)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # Asymptotic order 4; the end slopes, of order 6, must not lower it.
    assert np.all(orders > 3.9)


def test_a_spline_passes_through_its_values_with_continuous_curvature():
    values = np.random.default_rng(3).normal(size=40)
    c = spline_coefficients(values)
    np.testing.assert_allclose((c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0, values, rtol=0.0, atol=1e-14)
    profile = Profile.from_pieces([Piece(0.0, 39.0, 1.0)], lambda low, width, count: values)
    step = 1e-4
    for knot in range(3, 36):
        left = profile(knot - step * np.arange(3)) @ [1.0, -2.0, 1.0] / step**2
        right = profile(knot + step * np.arange(3)) @ [1.0, -2.0, 1.0] / step**2
        # One-sided differences miss by step times the third derivative (up to about 100 here), and by round-off.
        assert left == pytest.approx(right, abs=3e-2)


def test_beyond_the_ends_the_end_values_hold():
    profile = sampled(np.cos, [Piece(1.0, 2.0, 0.05)])
    assert profile(0.0) == profile(1.0)
    assert profile(9.0) == profile(2.0)


def test_a_point_on_a_break_belongs_to_the_segment_that_starts_there():
    profile = sampled(lambda x: np.where(x < 0.999, 0.0, 1.0), [Piece(0.0, 0.9, 0.1), Piece(1.0, 2.0, 0.1)])
    assert profile(np.nextafter(1.0, 0.0)) == pytest.approx(0.0, abs=1e-15)
    assert profile(1.0) == pytest.approx(1.0, abs=1e-15)


def test_the_zero_profile_is_zero_everywhere():
    profile = Profile.zero()
    assert (profile.segment_count, profile.coefficient.size) == (1, 4)
    assert not profile(np.linspace(-100.0, 100.0, 11)).any()


def test_segments_own_three_coefficients_more_than_intervals():
    profile = sampled(np.sin, [Piece(0.0, 1.0, 0.1), Piece(1.0, 2.0, 0.05)])
    assert profile.intervals.tolist() == [10, 20]
    assert profile.first.tolist() == [0, 13]
    assert profile.coefficient.size == 13 + 23


def test_overlay_takes_all_breaks_and_the_smallest_spacing():
    smooth = [Piece(0.0, 10.0, 0.5)]
    local = [Piece(0.0, 4.0, np.inf), Piece(4.0, 5.0, 0.01), Piece(5.0, 10.0, np.inf)]
    nearly_there = [Piece(0.0, 4.0 + 1e-12, np.inf), Piece(4.0 + 1e-12, 10.0, 2.0)]
    assert overlay([smooth, local, nearly_there], 0.0, 10.0) == [
        Piece(0.0, 4.0, 0.5),
        Piece(4.0, 5.0, 0.01),
        Piece(5.0, 10.0, 0.5),
    ]


def test_too_few_values_are_refused():
    with pytest.raises(ValueError, match="at least 7"):
        spline_coefficients(np.zeros(6))
