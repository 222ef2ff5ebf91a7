import warnings

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tbatch.physics.irregularity import Irregularity
from tbatch.physics.level import read_level


def sinus(x):
    return 4e-3 * np.sin(2.0 * np.pi * x / 12.0) + 1e-3 * np.cos(2.0 * np.pi * x / 5.0)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_a_measured_sinus_is_reproduced(jitter):
    x = np.arange(0.0, 100.01, 0.25)
    x[1:-1] += 0.25 * jitter * np.random.default_rng(1).uniform(-1.0, 1.0, x.size - 2)
    rough = Irregularity.measured(x, sinus(x))
    inside = np.linspace(0.0, 100.0, 20_001)
    # A cubic spline errs by 5/384 h⁴ r'''': 1e-3 (2π/5)⁴ on gaps of at most 0.4 m is 0.8 µm inside (0.13 µm on even
    # ones), more in the outermost intervals, where it ends not-a-knot.
    bound = 1e-6 if jitter else 1.5e-7
    assert np.abs(rough(inside) - sinus(inside))[200:-200].max() < bound
    # The profile follows the spline through the points, whatever their distances.
    assert np.abs(rough.profile(0.0, 100.0)(inside) - CubicSpline(x, sinus(x))(inside)).max() < 2e-8
    assert np.abs(rough.profile(20.07, 71.3)(x) - rough(x))[85:280].max() < 2e-8


def test_a_rough_level_stays_smooth_between_its_points():
    x = np.arange(0.0, 30.01, 0.25)
    r = 1e-4 * np.random.default_rng(2).normal(size=x.size)
    rough = Irregularity.measured(x, r)
    fine = np.linspace(0.0, 30.0, 9001)
    profile = rough.profile(0.0, 30.0)
    assert np.abs(profile(fine) - rough(fine)).max() < 2e-8
    # No kinks: with linear interpolation the slope would jump by about 1e-3 at a point.
    slope = np.gradient(profile(fine), fine)
    assert np.abs(np.diff(slope)).max() < 2e-4


def test_a_span_that_leaves_the_points_is_refused():
    rough = Irregularity.measured(np.arange(10.0, 50.0), np.zeros(40))
    with pytest.raises(ValueError, match=r"x = 5 \.\.\. 40 m, but its points reach from 10 to 49 m"):
        rough.profile(5.0, 40.0)
    with pytest.raises(ValueError, match="reach from 10 to 49 m"):
        rough(50.0)


def test_a_level_may_begin_where_its_taper_does():
    x = np.arange(30.0, 80.01, 0.25)
    rough = Irregularity.measured(x, sinus(x)).taper(30.0, 5.0)
    profile = rough.profile(0.0, 80.0)
    assert not profile(np.linspace(0.0, 29.999, 100)).any()
    assert profile(60.0) == pytest.approx(sinus(60.0), abs=1e-6)


def test_points_closer_than_usual_are_still_followed_or_told():
    x = np.sort(np.append(np.arange(0.0, 20.01, 0.25), 10.001))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Irregularity.measured(x, sinus(x)).profile(0.0, 20.0)
    step = np.where(x > 10.0005, 1e-3, 0.0)
    with pytest.warns(UserWarning, match="changes faster than its typical spacing"):
        Irregularity.measured(x, step).profile(0.0, 20.0)


@pytest.mark.parametrize(
    ("x", "r", "message"),
    [
        ([0.0, 1.0, 2.0], [0.0, 0.0, 0.0], "at least 4 points"),
        ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0], "shapes"),
        ([0.0, 1.0, 1.0, 3.0], [0.0] * 4, r"must increase: x\[2\] = 1 m follows 1 m"),
        ([0.0, 1.0, 2.0, np.nan], [0.0] * 4, "not finite"),
    ],
)
def test_bad_points_are_refused(x, r, message):
    with pytest.raises(ValueError, match=message):
        Irregularity.measured(x, r)


@pytest.mark.parametrize(
    "text",
    [
        "0 0.0\n1 1.5\n2 -1.0\n3 0.5\n",
        "# survey\nchainage, level\n0, 0.0\n1, 1.5  # joint\n\n2, -1.0\n3, 0.5\n",
        "\ufeffx;z\n0;0,0\n1;1,5\n2;-1,0\n3;0,5\n",
        "0\t0.0\r\n1\t1.5\r\n2\t-1.0\r\n3\t0.5\r\n",
    ],
)
def test_files_of_two_columns_are_read(tmp_path, text):
    path = tmp_path / "level.csv"
    path.write_text(text, encoding="utf-8", newline="")
    x, r = read_level(path)
    np.testing.assert_array_equal(x, [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(r, [0.0, 1.5e-3, -1e-3, 5e-4], rtol=1e-15)
    x, r = read_level(path, unit="um", up=True)
    np.testing.assert_allclose(r, [0.0, -1.5e-6, 1e-6, -5e-7], rtol=1e-15)
    assert Irregularity.measured_file(path)(1.0) == pytest.approx(1.5e-3, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 1\n1 2\nx y\n3 4\n", "line 3: 'x y' is not two numbers"),
        ("O 1\n1 2\n2 3\n3 4\n4 5\n", "line 1: 'O 1' is not two numbers"),
        ("x r\nx r\n1 2\n2 3\n", "line 2: 'x r' is not two numbers"),
        ("0 1\n1 2 3\n2 3\n3 4\n", "line 2: 3 columns"),
        ("0 1\n1 2\n2\n3 4\n", "line 3: 1 columns"),
        ("0 1\n1 2\n\n1 3\n3 4\n", "line 4: chainage 1 m does not lie beyond"),
        ("0 1\n1 nan\n2 3\n3 4\n", "line 2: .* not finite"),
        ("0 1\n1 2\n", "2 points, at least 4"),
        ("", "0 points"),
    ],
)
def test_bad_files_are_refused_by_line(tmp_path, text, message):
    path = tmp_path / "level.txt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_level(path)


def test_unknown_units_and_binary_files_are_refused(tmp_path):
    path = tmp_path / "level.bin"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ValueError, match="not a text file"):
        read_level(path)
    with pytest.raises(ValueError, match="unit = 'inch'"):
        read_level(path, unit="inch")
