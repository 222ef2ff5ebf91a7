"""Where lane vectors do not work, or another compiler takes Taichi's place: the same bits, and a word about it."""

import importlib.util
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from bits import digests, simulated

from tbatch.engine import runtime


@pytest.mark.skipif(importlib.util.find_spec("quadrants") is None, reason="needs the package quadrants")
def test_the_kernels_give_the_same_bits_on_the_fork_quadrants(tmp_path):
    path = os.pathsep.join(entry for entry in sys.path if entry)
    child = subprocess.run(
        [sys.executable, str(Path(__file__).parent / "on_quadrants.py"), "20"],
        env={**os.environ, "PYTHONPATH": path, "TBATCH_LANE_VECTORS": "1", "TBATCH_CACHE": str(tmp_path)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.returncode == 0, child.stderr[-2000:]
    assert child.stdout.split()[-20:] == digests(simulated(range(20)))


def test_a_machine_without_lane_vectors_is_told_so_once(tmp_path, monkeypatch):
    monkeypatch.delenv("TBATCH_LANE_VECTORS", raising=False)
    failed = subprocess.CompletedProcess([], -6)
    monkeypatch.setattr(runtime.subprocess, "run", lambda *words, **options: failed)
    with pytest.warns(UserWarning, match=r"lane vectors do not work .* same results, about 3\.5 times slower"):
        assert not runtime._lane_vectors_work(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not runtime._lane_vectors_work(tmp_path)
