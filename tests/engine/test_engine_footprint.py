"""The memory of a simulation is known before it starts: what is counted is what a process is seen to take."""

import os
import subprocess
import sys

import numpy as np
import pytest
from bits import case, simulated

from tbatch.engine import simulate as simulate_module
from tbatch.engine.footprint import footprint
from tbatch.engine.runs import Runs, SaveAt
from tbatch.engine.simulate import simulate

MEASURE = """
import ctypes, gc, sys
import tbatch as tb
from tbatch.engine.bench.cases import endless_runs, seed_model, seed_runs
from tbatch.engine.footprint import footprint
count, steps, every, endless, memory = (float(word) for word in sys.argv[1:])
model = seed_model("endless") if endless else seed_model()
runs_of = endless_runs if endless else seed_runs
channels = ("contact_force", "vehicle") if endless else ("contact_force", "vehicle", "rail")
save = tb.SaveAt(every, channels, () if endless else (45.0, 50.0)) if every else None
def resident(key):
    return 1024.0 * int(next(line for line in open("/proc/self/status") if line.startswith(key)).split()[1])
tb.simulate(model, runs_of(16), 2e-4, save=save, threads=1)
runs = runs_of(int(count))
needs = footprint(model, runs, steps * 1e-4, save=save, threads=1)
batch = min(int(count), int(memory / needs.stepped)) if memory else int(count)
needs = footprint(model, runs, steps * 1e-4, save=save, batch=batch, threads=1)
gc.collect()
ctypes.CDLL("libc.so.6").malloc_trim(0)
open("/proc/self/clear_refs", "w").write("5")  # the peak so far is forgotten
before = resident("VmRSS")
tb.simulate(model, runs, steps * 1e-4, save=save, memory=memory or None, threads=1)
print(needs.peak(int(count), batch), resident("VmHWM") - before)
"""


@pytest.mark.skipif(not os.access("/proc/self/clear_refs", os.W_OK), reason="the system does not tell a peak")
@pytest.mark.parametrize(
    ("count", "steps", "every", "endless", "memory"),
    [
        pytest.param(1024, 10, 0.0, 0, 0.0, id="many runs"),
        pytest.param(64, 1500, 1e-4, 0, 0.0, id="long histories"),
        pytest.param(1024, 1200, 0.0, 0, 0.0, id="long lines", marks=pytest.mark.slow),
        pytest.param(1024, 100, 2e-4, 0, 0.0, id="histories of many", marks=pytest.mark.slow),
        pytest.param(512, 12000, 0.0, 1, 0.0, id="endless", marks=pytest.mark.slow),
        pytest.param(128, 6000, 1e-4, 1, 0.0, id="endless with histories", marks=pytest.mark.slow),
        pytest.param(1024, 3, 0.0, 0, 10e6, id="batch after batch", marks=pytest.mark.slow),
    ],
)
def test_the_memory_counted_is_within_a_quarter_of_the_measured_peak(count, steps, every, endless, memory):
    words = [str(value) for value in (count, steps, every, endless, memory)]
    path = os.pathsep.join(entry for entry in sys.path if entry)
    child = subprocess.run(
        [sys.executable, "-c", MEASURE, *words],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.returncode == 0, child.stderr
    counted, measured = (float(word) for word in child.stdout.split())
    # What is left to a quarter is the allocator's: pages of 2 MB, freed blocks that it keeps.
    assert counted == pytest.approx(measured, rel=0.25)


def test_what_cannot_be_kept_is_refused_before_anything_is_stepped(monkeypatch):
    monkeypatch.setattr(simulate_module, "available_memory", lambda: 1e5)
    runs = Runs(np.full(8, 30.0), start=4.0)
    steps = []
    with pytest.raises(MemoryError, match=r"histories and results of 8 runs need 0.3 MB, 0.1 MB are free.*save\.every"):
        simulate(case(), runs, 0.5, save=SaveAt(case().step), progress=steps.append)
    assert steps == []


def test_a_footprint_counts_shared_surfaces_once_and_grows_with_what_is_saved():
    of = case()
    bare = footprint(of, Runs([30.0], start=4.0), 0.1)
    saved = footprint(of, Runs([30.0], start=4.0), 0.1, save=SaveAt(of.step, ("contact_force",)))
    assert saved.histories == 8.0 * of.vehicle.wheel_count * 1001
    assert bare.histories == 0.0
    assert saved.peak(10, 10) > bare.peak(10, 10) > 10 * bare.stepped


def test_an_error_of_the_start_names_the_run(monkeypatch):
    from tbatch.engine import prepare

    def none(inputs, ground):
        raise ValueError(f"no static equilibrium at start = {inputs.start:g} m")

    monkeypatch.setattr(prepare, "static_state", none)
    with pytest.raises(ValueError, match=r"run 1: no static equilibrium at start = 6 m"):
        simulate(case(), Runs([30.0, 40.0], start=[4.0, 6.0]), [0.01, 0.02])


def test_each_run_is_prepared_once_however_many_batches_there_are(monkeypatch):
    from tbatch.engine.prepare import Preparation

    prepared = []
    inputs = Preparation.inputs
    monkeypatch.setattr(Preparation, "inputs", lambda self, run: prepared.append(run) or inputs(self, run))
    simulated(range(40), memory=0.0)
    assert sorted(prepared) == list(range(40))
