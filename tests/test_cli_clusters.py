"""The commands for more than one machine, as they are typed: parts, merge, verify, estimate, completion."""

import os
import subprocess
import sys

import pytest

SHORT = ["--set", "run.distance=6 m", "--set", "run.evaluate_from=1 m", "--keep", "none", "--runs", "100"]


def tbatch(*words, **settings):
    command = [sys.executable, "-m", "tbatch", *map(str, words)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, env={**os.environ, **settings}
    )
    assert "Traceback" not in done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """Two parts of the quick campaign in folders of their own."""
    folders = [tmp_path_factory.mktemp("parts") / str(index) for index in range(2)]
    for index, folder in enumerate(folders):
        done = tbatch("run", "quick", *SHORT, "--out", folder, "--shard", f"{index}/2")
        assert done.returncode == 0, done.stderr
        assert f"part {index}/2 is stored" in done.stdout
    return folders


def test_parts_are_joined_verified_and_complete(parts, tmp_path):
    joined = tmp_path / "joined"
    done = tbatch("merge", *parts, "--out", joined)
    assert done.returncode == 0, done.stderr
    assert "200 of 200 runs stored, complete" in done.stdout
    assert tbatch("verify", joined).returncode == 0
    again = tbatch("run", "quick", *SHORT, "--out", joined)
    assert again.returncode == 0
    assert "complete already" in again.stderr
    damaged = next((joined / "events").iterdir())
    damaged.write_bytes(damaged.read_bytes()[:-1])
    found = tbatch("verify", joined)
    assert found.returncode == 4
    assert damaged.name in found.stdout
    assert tbatch("merge", parts[0], joined).returncode == 4


def test_a_dry_run_estimates_what_is_missing_and_writes_nothing(parts, tmp_path):
    done = tbatch("run", "quick", *SHORT, "--out", tmp_path / "new", "--dry-run")
    assert done.returncode == 0, done.stderr
    assert "200 of 200 runs to do, in 4 shards" in done.stdout
    assert all(word in done.stdout for word in ("time", "run-steps/s", "memory", "disk"))
    assert not (tmp_path / "new").exists()
    assert "100 of 200 runs to do" in tbatch("run", "quick", *SHORT, "--out", parts[0], "--dry-run").stdout
    changed = tbatch("run", "quick", *SHORT, "--seed", 9, "--out", parts[0], "--dry-run")
    assert changed.returncode == 2
    assert "campaign.seed: stored 1, given 9" in changed.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--shard", "2/2"], "i from 0 to n - 1"),
        (["--executor", "ray"], "dask://HOST:PORT"),
        (["--set", "speed.values.7=1"], "is not a table with such an entry"),
    ],
)
def test_bad_options_leave_with_2_and_what_is_accepted(options, said, tmp_path):
    done = tbatch("run", "quick", "--out", tmp_path / "x", *options)
    assert done.returncode == 2
    assert said in done.stderr
    assert not (tmp_path / "x").exists()


def test_an_entry_of_a_list_can_be_set_by_its_number(tmp_path):
    done = tbatch("run", "wheel_flat", "--set", "irregularity.defect.0.depth=abc", "--out", tmp_path / "x")
    assert done.returncode == 2
    assert "irregularity.defect[0].depth" in done.stderr


def test_the_shell_completes_commands_and_scenarios():
    def completed(words):
        return tbatch(
            _TBATCH_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=str(words.count(" "))
        ).stdout.split()

    assert completed("tbatch mer") == ["merge"]
    assert completed("tbatch run separation_vs") == ["separation_vs_speed"]
    assert "--shard" in completed("tbatch run quick --sh")
