"""Ctrl-C and SIGTERM end a command soon, whatever it is at, and say how to go on."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tbatch.campaign.lock import folder_owner

HELD = """
import collections, itertools, time
from tbatch.cli.interruption import Interruption
with Interruption("go on with: tbatch resume DIR") as interruption:
    interruption.stepping = {stepping}
    print("ready", flush=True)
    {call}
    print("went on", flush=True)
"""
LOCKED = "collections.deque(itertools.repeat(0{times}), maxlen=0)"
"""One call in C that keeps Python's lock, as a compiler may: no Python runs meanwhile. Without a number, for ever."""


def started(call, *, stepping=False):
    words = [sys.executable, "-c", HELD.format(call=call, stepping=stepping)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)  # until the call has begun
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_process_that_no_python_runs_in_is_ended_and_says_how_to_go_on(number):
    process = started(LOCKED.format(times=""))
    process.send_signal(number)
    _, said = process.communicate(timeout=10)  # what the commands promise
    assert process.returncode == -number  # a shell calls it 128 + number
    assert said == "\ntbatch: interrupted; what is stored stays, go on with: tbatch resume DIR\n"


def test_a_second_signal_does_not_wait():
    process = started(LOCKED.format(times=""))
    process.send_signal(signal.SIGINT)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=3)  # before the watchdog's five seconds
    assert process.returncode == -signal.SIGINT


def test_a_call_that_ends_in_time_stops_in_python():
    process = started(LOCKED.format(times=", 3 * 10**8"))  # a second or two
    process.send_signal(signal.SIGINT)
    out, said = process.communicate(timeout=10)
    assert "Stop: interrupted" in said  # raised: the commands turn it into a message and 130
    assert "went on" not in out
    assert process.returncode != -signal.SIGKILL


def test_a_signal_that_python_hears_leaves_the_watchdog_quiet():
    """The first is noted while runs are stepped; six seconds later the process still lives."""
    process = started("[time.sleep(0.1) for _ in range(60)]", stepping=True)
    process.send_signal(signal.SIGINT)
    out, said = process.communicate(timeout=20)
    assert process.returncode == 0
    assert "went on" in out
    assert "stopping after this chunk" in said


@pytest.mark.slow
@pytest.mark.parametrize("moment", [1.0, 4.0, 7.0])
def test_the_first_compilation_stops_within_ten_seconds_and_nothing_is_lost(tmp_path, moment):
    folder = tmp_path / "folder"
    words = [sys.executable, "-m", "tbatch", "run", "quick", "--keep", "none", "--out", str(folder)]
    # In scalar form the kernels take a quarter of a minute to compile: the signal comes while they do.
    cold = {**os.environ, "TBATCH_CACHE": str(tmp_path / "cache"), "TBATCH_LANE_VECTORS": "0"}
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=cold)
    while not (folder / "manifest.json").exists():
        time.sleep(0.02)
    time.sleep(moment)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=10)
    assert process.returncode in (130, -signal.SIGINT)
    assert f"resume with: tbatch resume {folder}" in said
    assert folder_owner(folder) is None
    done = subprocess.run([*words[:3], "resume", str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
