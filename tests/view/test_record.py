from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from tbatch.view.record import RunRecord


def small(**parts) -> RunRecord:
    """Two wheels 2 m apart at 10 m/s, six samples 0.1 s apart; the second wheel is off at samples 2 and 3."""
    force = np.full((6, 2), 100.0)
    force[2:4, 1] = 0.0
    start = {
        "name": "c00-s000000",
        "time": 0.1 * np.arange(6),
        "position": 5.0 + np.arange(6.0),
        "wheel_offsets": np.array([0.0, 2.0]),
        "static_load": np.array([100.0, 50.0]),
        "contact_force": force,
    }
    return RunRecord(**{**start, **parts})


def table(*rows: tuple[int, float, float]) -> pa.Table:
    """A separation table from (wheel, start, end)."""
    rest = {"position": 5.0, "gap": 1e-4, "landing_force": 3e5, "censored": False}
    return pa.Table.from_pylist([{"wheel": wheel, "start": start, "end": end, **rest} for wheel, start, end in rows])


def test_separations_are_read_off_the_force_where_no_table_is_given():
    (event,) = small().events
    assert (event.wheel, event.censored) == (1, False)
    # start is the first sample without force, end the first with force again, position that of the wheel
    assert (event.start, event.end, event.position) == pytest.approx((0.2, 0.4, 5.0))


def test_the_table_wins_where_it_tells_of_the_same_separation():
    (event,) = small(separations=table((2, 0.17, 0.39))).events
    assert (event.start, event.end, event.gap, event.landing_force) == (0.17, 0.39, 1e-4, 3e5)


def test_a_separation_that_the_table_does_not_know_is_added():
    wheels = [event.wheel for event in small(separations=table((1, 0.31, 0.33))).events]
    assert wheels == [1, 0]


def test_a_separation_open_at_the_end_is_cut_off():
    force = np.full((6, 2), 100.0)
    force[4:, 0] = 0.0
    (event,) = small(contact_force=force).events
    assert event.censored
    assert event.end == pytest.approx(0.5)


def test_samples_after_the_end_of_a_run_are_not_shown():
    force = np.full((6, 2), 100.0)
    force[4:] = np.nan
    record = small(contact_force=force)
    assert record.samples == 4
    assert record.events == ()


def test_force_ratio_is_of_each_wheels_own_load():
    assert small().force_ratio[0] == pytest.approx([1.0, 2.0])


def test_arrays_that_do_not_fit_are_refused_by_name():
    with pytest.raises(ValueError, match=r"irregularity has shape \(5, 2\), expected \(6, 2\)"):
        small(irregularity=np.zeros((5, 2)))
    with pytest.raises(ValueError, match="rail_at is None"):
        small(rail=np.zeros((6, 3)))
    with pytest.raises(ValueError, match="time has 1 samples"):
        replace(small(), time=np.zeros(1))
