"""A run's bits do not depend on what it is batched with, nor on lanes, chunks, memory, threads, or the process."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bits import case, coaches, digests, simulated
from engine_cases import corrugation, model

from tbatch.engine.footprint import bytes_per_run
from tbatch.engine.rows import LANES
from tbatch.engine.runs import Runs, SaveAt
from tbatch.engine.simulate import simulate

COUNT = 2 * LANES + 1
"""Two full blocks and one run more."""


@pytest.fixture(scope="module")
def together():
    """Digests of all runs from one batch in their order."""
    return digests(simulated(range(COUNT)))


def in_a_fresh_process(threads: int, count: int = COUNT, *which: str, **variables: str) -> list[str]:
    """Digests from a process of their own."""
    here = Path(__file__).parent
    path = os.pathsep.join(entry for entry in sys.path if entry)
    child = subprocess.run(
        [sys.executable, str(here / "bits.py"), str(threads), str(count), *which],
        env={**os.environ, "PYTHONPATH": path, **variables},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.returncode == 0, child.stderr
    return child.stdout.split()[-count:]


def test_runs_differ_from_each_other(together):
    # The comparisons below could not fail if all runs were one.
    assert len(set(together)) == COUNT
    result = simulated(range(COUNT))
    assert len(set(result.steps.tolist())) == 9
    assert result.separations.num_rows > COUNT


@pytest.mark.parametrize("number", [0, 4, 5, 9, COUNT - 1])
def test_alone_a_run_has_the_same_bits(together, number):
    assert digests(simulated([number])) == [together[number]]


@pytest.mark.parametrize("size", [7, 8, 9, LANES - 1, LANES, LANES + 1])
def test_batches_of_any_size_have_the_same_bits(together, size):
    for first in range(0, COUNT, size):
        numbers = range(first, min(first + size, COUNT))
        assert digests(simulated(numbers)) == together[first : first + size]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_order_and_lane_do_not_matter(together, seed):
    order = np.random.default_rng(seed).permutation(COUNT).tolist()
    assert digests(simulated(order)) == [together[number] for number in order]


def test_a_run_may_share_its_block_with_copies_of_itself(together):
    # One course in every lane: they are served at once.
    assert digests(simulated([3] * (LANES + 1))) == [together[3]] * (LANES + 1)


@pytest.mark.parametrize("stranger", [4, 11])
def test_one_stranger_among_copies_changes_nothing(together, stranger):
    # Its course, or its length alone, keeps the lanes from being served at once.
    numbers = [3, 3, stranger, *[3] * LANES]
    assert digests(simulated(numbers)) == [together[number] for number in numbers]


@pytest.mark.parametrize("chunk", [1, 3, 17, 10_000])
def test_the_length_of_a_launch_does_not_matter(together, chunk):
    assert digests(simulated(range(COUNT), chunk=chunk)) == together


@pytest.mark.parametrize(("runs_held", "batches"), [(0, {-(-COUNT // LANES)}), (16, {2, 3}), (1000, {1})])
def test_limited_memory_makes_more_batches_of_the_same_bits(together, runs_held, batches):
    launches = []
    result = simulated(
        range(COUNT),
        memory=runs_held * bytes_per_run(case()),
        chunk=10_000,
        progress=lambda progress: launches.append(progress.run_steps_done),
    )
    assert digests(result) == together
    # One launch a batch; a batch holds whole blocks, however little memory there is.
    assert len(launches) in batches
    assert launches[-1] == result.steps.sum()


def test_a_fresh_process_gives_the_same_bits_with_one_and_with_two_threads(together):
    assert in_a_fresh_process(1) == together
    # From sixteen blocks on the second thread has work.
    many = digests(simulated(range(16 * LANES + 1)))
    assert many[:COUNT] == together
    assert in_a_fresh_process(2, 16 * LANES + 1) == many


def test_threads_may_change_within_a_process(together):
    assert digests(simulated(range(COUNT), threads=2)) == together
    assert digests(simulated(range(COUNT), threads=1)) == together


@pytest.mark.parametrize("blas_threads", ["1", "2", "4"])
def test_the_threads_of_the_linear_algebra_library_do_not_show(blas_threads):
    """Such as on a Dask worker, whose nanny allows one: the host's inverses had other bits with two."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    fresh = in_a_fresh_process(1, 6, "coach", **dict.fromkeys(names, blas_threads))
    assert fresh == digests(coaches(range(6), threads=1))
    assert len(set(fresh)) == 6


def test_the_scalar_fallback_gives_the_same_bits(together):
    assert in_a_fresh_process(1, TBATCH_LANE_VECTORS="0") == together


def test_coaches_of_different_speed_and_length_do_not_disturb_each_other():
    of = model("coach", "slab")
    save = SaveAt(of.step, ("contact_force", "vehicle", "rail", "slab", "base"), (7.0, 25.3))
    speed, start = np.linspace(40.0, 80.0, 9), 24.0 + 0.1 * np.arange(9)
    rough = [corrugation(0.5e-3, phase) for phase in range(9)]
    steps = 20 + 5 * (np.arange(9) % 4)
    # From 25 m before the start on all four wheels count at once.
    result = simulate(of, Runs(speed, rough, start, evaluate_from=-25.0), steps * of.step, save=save, threads=1)
    for run in (0, 4, 8):
        runs = Runs(speed[run : run + 1], rough[run : run + 1], start[run : run + 1], evaluate_from=-25.0)
        alone = simulate(of, runs, steps[run] * of.step, save=save, threads=1, chunk=7)
        assert alone.summary.drop_columns("run").equals(result.summary.slice(4 * run, 4).drop_columns("run"))
        for name, history in alone.channels.items():
            np.testing.assert_array_equal(history[0], result.channels[name][run, : steps[run] + 1])
