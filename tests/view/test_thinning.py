import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tbatch.view.thinning import extremes, spaced_samples


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
