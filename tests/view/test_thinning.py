import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tbatch.view.thinning import curve_samples, extremes, spaced_samples, turning_points


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60),
    st.sets(st.integers(1, 59), max_size=12),
)
def test_extremes_keep_the_least_and_largest_of_every_block(values, cuts):
    series = np.column_stack((values, values[::-1]))
    starts = np.array([0, *sorted(cut for cut in cuts if cut < len(values))])
    at, rows = extremes(series, starts)
    assert np.all(np.diff(at) > 0)
    for a, b in zip(starts, [*starts[1:], len(values)], strict=True):
        kept = rows[(at >= a) & (at < b)]
        np.testing.assert_array_equal(kept.min(axis=0), series[a:b].min(axis=0))
        np.testing.assert_array_equal(kept.max(axis=0), series[a:b].max(axis=0))


def test_extremes_come_in_the_order_they_happened():
    up, down = np.arange(10.0), np.arange(10.0)[::-1]
    _, rows = extremes(np.column_stack((up, down)), np.array([0]))
    np.testing.assert_array_equal(rows, [[0.0, 9.0], [9.0, 0.0]])


def test_spacing_is_kept_in_time_and_in_travel():
    time = np.arange(1001) * 1e-3
    fast = spaced_samples(time, 50.0 * time, interval=5e-3, travel=0.1)
    slow = spaced_samples(time, 5.0 * time, interval=5e-3, travel=0.1)
    assert set(np.diff(fast)) == {5}  # 5 ms are 0.25 m: the interval governs
    assert set(np.diff(slow)) == {20}  # 0.1 m are 20 ms: the travel governs
    assert fast[0] == slow[0] == 0
    assert fast[-1] == slow[-1] == 1000


def test_a_vehicle_at_rest_gives_its_first_and_last_sample():
    time = np.arange(11) * 0.1
    np.testing.assert_array_equal(spaced_samples(time, np.full(11, 3.0), interval=0.1, travel=0.1), [0, 10])


def test_turning_points_are_the_tops_and_bottoms_of_large_swings():
    series = np.array([0.0, 1.0, 0.9, 3.0, 2.0, 2.1, -1.0, -1.0, -0.9, 5.0, 4.9])
    np.testing.assert_array_equal(np.unique(turning_points(series, 0.5)), [0, 3, 7, 9])
    assert {0, 1, 2, 3, 4, 5, 7, 9} <= set(turning_points(series, 0.05).tolist())


@given(
    st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=80),
    st.floats(1e-3, 5.0),
    st.sets(st.integers(0, 79), max_size=5),
)
def test_lines_between_picked_samples_miss_no_sample_and_no_peak(values, tolerance, asked):
    series = np.column_stack((values, np.sin(values), values[::-1]))
    time = 0.1 * np.arange(len(series))
    kept = np.array(sorted(k for k in asked if k < len(series)), np.intp)
    picked, held = curve_samples(time, series, kept, tolerance=tolerance, most=len(series))
    assert held == tolerance
    assert {0, len(series) - 1, *kept} <= set(picked.tolist())
    for column in series.T:
        line = np.interp(time, time[picked], column[picked])
        assert np.abs(line - column).max() <= tolerance * (1 + 1e-12)
        assert (column[picked].min(), column[picked].max()) == (column.min(), column.max())
        # A top that stands out on both sides by more than the tolerance is there itself.
        for k in range(1, len(column) - 1):
            if min(column[k] - column[k - 1], column[k] - column[k + 1]) > tolerance:
                assert k in picked


def test_too_many_samples_double_the_tolerance_and_leave_the_largest_value_exact():
    time = np.arange(5000) * 1e-4
    values = np.random.default_rng(1).normal(size=(5000, 2))
    picked, held = curve_samples(time, values, np.array([17]), tolerance=1e-3, most=500)
    assert held > 1e-3
    assert len(picked) <= 500 + 7
    for column in values.T:
        assert np.abs(np.interp(time, time[picked], column[picked]) - column).max() <= held
        assert {17, column.argmax(), column.argmin()} <= set(picked.tolist())
