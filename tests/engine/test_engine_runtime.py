"""The engine's manners: it is quiet, lives without its cache folder, and lays its memory out as the kernels need it."""

import os
import subprocess
import sys

import numpy as np
import pytest
from bits import COLUMNS, case

from tbatch.engine import runtime
from tbatch.engine.aligned import aligned, aligned_zeros
from tbatch.engine.batch import Batch, event_capacity
from tbatch.engine.prepare import Preparation, step_counts
from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs
from tbatch.engine.statistics import Statistics

CODE = """
import tbatch as tb
from tbatch.engine import runtime
wheel = tb.Vehicle([[350.0]], [[0.0]], [[0.0]], [0], [0.0], [40e3])
model = tb.Model.build(wheel, tb.Track.rigid(length=10.0), tb.Contact.hertz(wheel_radius=0.46), step=1e-4)
result = tb.simulate(model, tb.Runs([10.0], start=1.0), 0.001, threads=1)
assert result.status.tolist() == [0]
assert runtime.start(1).threads == 1
"""


def fresh(code: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a piece of code in a process of its own."""
    path = os.pathsep.join(entry for entry in sys.path if entry)
    environment = {**os.environ, "PYTHONPATH": path, **variables}
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)


def test_a_simulation_prints_nothing():
    child = fresh(CODE)
    assert child.returncode == 0, child.stderr
    assert child.stdout == ""
    assert child.stderr == ""


def test_an_unwritable_cache_folder_does_no_harm(tmp_path):
    # A file where the folder should be.
    (tmp_path / "tbatch").write_text("not a folder")
    child = fresh(CODE, TBATCH_CACHE=str(tmp_path))
    assert child.returncode == 0, child.stderr


@pytest.mark.parametrize("shape", [(1,), (3, 5, 8), (2, 7)])
def test_memory_is_aligned_for_lane_vectors(shape):
    for array in (aligned_zeros(shape), aligned(np.ones(shape)), aligned_zeros(shape, np.int32)):
        assert array.ctypes.data % 64 == 0
        assert array.shape == shape
        assert array.flags.c_contiguous


def test_the_runtime_is_started_once():
    assert runtime.start(1) is runtime.start(1)
    with pytest.raises(ValueError, match="threads = -1: at least 1"):
        runtime.start(-1)


def batch(runs: Runs, duration) -> Batch:
    """The lane memory of some runs."""
    of = case()
    preparation = Preparation(of, runs, step_counts(of, runs, duration), "rest")
    inputs = [preparation.inputs(run) for run in range(len(runs))]
    states = [preparation.start(run, one) for run, one in enumerate(inputs)]
    return Batch(of, inputs, states, Statistics(), spare_rows=0, chunk=10)


def test_a_block_is_in_lockstep_where_all_its_lanes_keep_one_course():
    count = 2 * LANES + 1
    speeds = np.full(count, 40.0)
    assert batch(Runs(speeds, start=5.0), 0.01).lockstep.tolist() == [1, 1, 1]
    assert batch(Runs(speeds, start=5.0, vehicle=(COLUMNS * count)[:count]), 0.01).lockstep.tolist() == [1, 1, 1]
    # Four runs of each of four courses share a block, be it the speed, the start or the length that differs.
    number = np.arange(LANES) // 4
    for speed, start, duration in ((40.0 + number, 5.0, 0.01), (speeds[:LANES], 5.0 + 1e-12 * number, 0.01),
                                   (speeds[:LANES], 5.0, 0.01 + 1e-4 * number)):  # fmt: skip
        assert batch(Runs(speed, start=start), duration).lockstep.tolist() == [0]


@pytest.mark.parametrize("chunk", range(1, 12))
def test_the_event_log_has_room_for_a_separation_every_second_step(chunk):
    # One written from before, one for each step in the air after a step in contact, one where the run ends.
    assert event_capacity(chunk) >= 1 + (chunk - 1) // 2 + 1
