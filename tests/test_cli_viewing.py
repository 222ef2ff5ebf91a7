"""The commands that show, as they are typed where there is no display: view, and run while somebody watches."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SHORT = ["--set", "run.distance=6 m", "--set", "run.evaluate_from=1 m"]


def tbatch(*words):
    settings = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "tbatch", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, env=settings)
    assert "Traceback" not in done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The quick campaign, shortened, with the worst run of each of its two speeds; somebody could have watched it."""
    path = tmp_path_factory.mktemp("campaigns") / "quick"
    done = tbatch("run", "quick", *SHORT, "--out", path, "--live")
    assert done.returncode == 0, done.stderr
    assert "rerun --connect rerun+http://127.0.0.1:" in done.stderr
    assert "ssh -L" in done.stderr
    return path


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_view_prints_the_table_of_recorded_runs_and_makes_what_is_missing(folder):
    done = tbatch("view", folder, "--sort", "speed")
    assert done.returncode == 2
    assert [line.split()[1] for line in done.stdout.splitlines()[2:]] == ["350", "200"]
    assert "no display" in done.stderr
    assert "--write" in done.stderr
    assert not (folder / "views").exists()
    done = tbatch("view", folder, "--write")
    assert done.returncode == 0
    paths = [Path(line) for line in done.stdout.splitlines()]
    assert [path.parent.name for path in paths] == ["rrd", "rrd", "views", "views"]
    assert all(path.stat().st_size > 10_000 for path in paths)
    done = tbatch("view", folder, "--run", "c00-s000009")
    assert done.returncode == 2
    assert "c00-s000000 to c01-s000003" in done.stderr


def test_nobody_can_watch_a_dry_run(tmp_path):
    done = tbatch("run", "quick", "--dry-run", "--live", "--out", tmp_path)
    assert done.returncode == 2
    assert "--dry-run runs nothing" in done.stderr


def test_a_part_can_be_watched_in_a_browser(tmp_path):
    done = tbatch("run", "quick", *SHORT, "--out", tmp_path, "--shard", "0/2", "--serve")
    assert done.returncode == 0
    assert "in a browser: http://127.0.0.1:" in done.stderr
