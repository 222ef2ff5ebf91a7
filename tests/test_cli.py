"""Every command does what it says, leaves with the exit code it should, and shows no traceback."""

import contextlib
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import psutil
import pytest

import tbatch.scenario as tbatch_scenario
from tbatch.campaign.campaign import Campaign
from tbatch.campaign.lock import FolderLock
from tbatch.cli import main

SHORT = ["--set", "run.distance=6 m", "--set", "run.evaluate_from=1 m"]


def tbatch(*arguments):
    """Runs a command in this process, as the console script does."""
    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", ["tbatch", *map(str, arguments)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as end,
    ):
        main()
    assert "Traceback" not in out.getvalue() + err.getvalue()
    return SimpleNamespace(returncode=end.value.code or 0, stdout=out.getvalue(), stderr=err.getvalue())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The quick campaign, shortened, run by the command; it holds two recordings."""
    path = tmp_path_factory.mktemp("campaigns") / "quick"
    command = [sys.executable, "-m", "tbatch", "run", "quick", *SHORT, "--out", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert "wheelset" in done.stdout
    assert "Runs: 8 of 8; diverged: 0." in done.stdout
    assert "recordings of the kept runs: 2 of 2" in done.stderr
    return path


def copy_of(folder, tmp_path):
    return Path(shutil.copytree(folder, tmp_path / "copy"))


def test_run_fills_the_campaign_folder(folder):
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["campaign.toml", "events", "manifest.json", "resolved.json", "rrd", "runs", "wheels"]
    assert len(list((folder / "rrd").glob("c0[01]-s*.rrd"))) == 2
    assert 'model = "seed-multiwheel"' in (folder / "campaign.toml").read_text()
    assert {"tbatch", "taichi", "numpy", "scipy", "python"} <= json.loads((folder / "manifest.json").read_text())[
        "sessions"
    ][0]["versions"].keys()


def test_running_again_does_nothing_and_says_so(folder):
    done = tbatch("run", "quick", *SHORT, "--out", folder)
    assert done.returncode == 0
    assert "complete already" in done.stderr


def test_resume_extends_nothing_and_redoes_what_is_missing(folder, tmp_path):
    copy = copy_of(folder, tmp_path)
    for path in (copy / "runs").glob("c01*"):
        path.unlink()
    done = tbatch("resume", copy)
    assert done.returncode == 0
    assert "its runs are redone" in done.stderr
    for kind in ("runs", "wheels", "events"):
        names = [path.name for path in sorted((folder / kind).iterdir())]
        assert names == [path.name for path in sorted((copy / kind).iterdir())]
        assert all((folder / kind / name).read_bytes() == (copy / kind / name).read_bytes() for name in names)


def test_stats_prints_the_same_numbers_as_table_and_as_json(folder):
    table, document = tbatch("stats", folder), json.loads(tbatch("stats", folder, "--json").stdout)
    assert table.returncode == 0
    assert [row["wheel"] for row in document["wheelsets"]] == [1, 2, 3, 4] * 2
    assert len(document["any_wheelset"]) == 2
    first = table.stdout.splitlines()[2].split()
    assert first[:4] == ["200", "1", "4", str(document["wheelsets"][0]["separated_runs"])]


def test_status_tells_a_sound_folder_from_a_damaged_one(folder, tmp_path):
    assert tbatch("status", folder).returncode == 0
    copy = copy_of(folder, tmp_path)
    damaged = next((copy / "wheels").iterdir())
    damaged.write_bytes(damaged.read_bytes()[:-1])
    for command in ("status", "stats", "resume"):
        done = tbatch(command, copy)
        assert done.returncode == 4
        assert damaged.name in done.stdout + done.stderr


def test_check_leaves_with_1_and_tells_ci_where_a_limit_is_exceeded(folder, tmp_path, monkeypatch):
    for name in ("GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY"):
        monkeypatch.delenv(name, raising=False)
    done = tbatch("check", folder)
    assert done.returncode == 0
    assert "::" not in done.stdout
    summary = tmp_path / "summary.md"
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    junit = tmp_path / "reports" / "junit.xml"
    done = tbatch("check", folder, "--junit", junit, "--set", 'limits."contact_force.max".max="1 kN"')
    assert done.returncode == 1
    assert done.stdout.count("::error title=quick%3A contact_force.max") == 8
    assert 'failures="8"' in junit.read_text(encoding="utf-8")
    assert "8 limits exceeded" in summary.read_text(encoding="utf-8")
    assert tbatch("check", folder, "--set", "limits.nonsense.max=1").returncode == 2


def test_report_writes_a_page_and_its_numbers(folder, tmp_path, monkeypatch):
    done = tbatch("report", folder, "--out", tmp_path, "--no-histories")
    assert done.returncode == 0
    assert (tmp_path / "index.html").stat().st_size > 100_000
    assert (tmp_path / "csv" / "separation_probability.csv").exists()
    monkeypatch.setattr("tbatch.cli.result_commands.find_spec", lambda name: None)
    done = tbatch("report", folder)
    assert done.returncode == 2
    assert "pip install 'tbatch[report]'" in done.stderr


def test_stats_all_gives_every_estimate_with_its_interval(folder):
    document = json.loads(tbatch("stats", folder, "--json", "--all").stdout)
    places = {(row["speed"], row["wheel"]) for row in document["estimates"]}
    assert len(places) == 1 + 2 * 5
    assert "load_ratio.max.p99.85" in tbatch("stats", folder, "--all").stdout


def test_replay_gives_the_stored_run_bit_for_bit_and_a_recording(folder, tmp_path):
    file = tmp_path / "run.rrd"
    done = tbatch("replay", folder, "--run", "c01-s000002", "--rrd", file)
    assert done.returncode == 0
    assert "bit for bit the stored run" in done.stdout
    assert file.stat().st_size > 10_000


def test_replay_of_several_runs_and_steps_writes_one_recording(folder, tmp_path):
    file = tmp_path / "compared.rrd"
    done = tbatch("replay", folder, "--run", "c00-s000001", "--run", "c01-s000001", "--rrd", file)
    assert done.returncode == 0
    assert done.stdout.count("bit for bit the stored run") == 2
    assert file.stat().st_size > 10_000
    done = tbatch("replay", folder, "--run", "c01-s000001", "--step", "0.05 ms")
    assert done.returncode == 0
    assert done.stdout.count("bit for bit the stored run") == 1
    assert "step 0.05 ms: NOT the stored run, which has a step of 0.1 ms" in done.stdout
    done = tbatch("view", folder, "--run", "c01-s000001", "--compare")
    assert done.returncode == 2
    assert "at least 2 are needed" in done.stderr


def test_without_rerun_every_command_but_view_works(folder, tmp_path):
    """The package blocked as if it were broken: runs are run and replayed, recordings are said to be missing."""
    blocked = (
        "import sys; sys.modules['rerun'] = sys.modules['rerun_bindings'] = None\nfrom tbatch.cli import main\nmain()"
    )

    def without(*arguments):
        command = [sys.executable, "-c", blocked, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)

    fresh = tmp_path / "fresh"
    done = without("run", "quick", *SHORT, "--runs", "1", "--out", fresh)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("no recordings of the kept runs: rerun cannot be loaded") == 1
    assert "Runs: 2 of 2; diverged: 0." in done.stdout
    done = without("replay", folder, "--run", "c00-s000001", "--rrd", tmp_path / "run.rrd")
    assert done.returncode == 2
    assert "bit for bit the stored run" in done.stdout
    assert "rerun cannot be loaded" in done.stderr
    for command in ("status", "stats", "verify", "check"):
        assert without(command, folder).returncode == 0, command


def test_a_folder_in_use_is_refused(folder):
    with FolderLock(folder):
        done = tbatch("run", "quick", *SHORT, "--out", folder)
    assert done.returncode == 7
    assert f"in use by pid {os.getpid()}" in done.stderr


def test_a_changed_key_is_refused_by_name(folder):
    done = tbatch("run", "quick", *SHORT, "--out", folder, "--seed", "5")
    assert done.returncode == 2
    assert "campaign.seed: stored 1, given 5" in done.stderr


@pytest.mark.parametrize("watched", [[], ["--live", "--serve"]])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_a_campaign_that_can_be_resumed(tmp_path, number, watched):
    folder = tmp_path / "folder"
    options = [*SHORT, "--out", folder, "--keep", "none", "--runs", "20000", *watched]
    command = [sys.executable, "-m", "tbatch", "run", "quick", *map(str, options)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    stored = folder / "runs"
    until = time.monotonic() + 120.0
    while not (stored.exists() and any(stored.iterdir())):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    helpers = psutil.Process(process.pid).children()
    assert len(helpers) == (3 if watched else 1)  # the watchdog; the server and the process that draws
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert not any(helper.is_running() for helper in helpers)
    assert f"resume with: tbatch resume {folder}" in said
    assert "Traceback" not in said
    status = tbatch("status", folder)
    assert status.returncode == 0
    assert "damaged: nothing" in status.stdout


def test_all_errors_of_a_scenario_are_said_at_once():
    done = tbatch("run", "quick", "--set", "run.start=abc", "--set", "track.lenght=3")
    assert done.returncode == 2
    assert "run.start" in done.stderr
    assert "lenght" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "quick", "--arch", "cuda"],
    ],
)
def test_what_comes_later_is_known_and_refused(arguments):
    done = tbatch(*arguments)
    assert done.returncode == 2
    assert "not served yet" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nonsense"], "nonsense"),
        (["run"], "Missing argument"),
        (["run", "no-such-scenario"], "no-such-scenario"),
        (["stats", "no-such-folder"], "no-such-folder"),
        (["list", "wheels"], "vehicles"),
        (["run", "quick", "--out", "/proc/nowhere"], "/proc/nowhere"),
        (["methods", "quick", "--steps", ""], "--steps: '' is no time"),
        (["methods", "quick", "--reference", "3 kg"], "--reference: '3 kg' is no time"),
    ],
)
def test_bad_usage_leaves_with_2_and_a_message(arguments, said):
    done = tbatch(*arguments)
    assert done.returncode == 2
    assert said in done.stderr


def test_methods_prints_saves_and_draws_a_comparison(tmp_path):
    short = ["--set", "track.length=60 m", "--set", "run.start=20 m", "--set", "run.distance=3 m",
             "--set", "run.evaluate_from=1 m"]  # fmt: skip
    done = tbatch(
        "methods", "smooth_track", *short, "--steps", "1 ms, 1e-4", "--out", tmp_path / "m", "--rrd", tmp_path / "m.rrd"
    )
    assert done.returncode == 0
    for method in ("two-step", "NML", "NMN", "APL"):
        assert method in done.stdout
    assert "half-period" in done.stdout
    names = {path.name for path in (tmp_path / "m").iterdir()}
    assert {"methods.json", "methods.csv", "work_precision.png", "responses_1000us.png"} <= names
    assert (tmp_path / "m.rrd").stat().st_size > 10_000
    for wrong in ("0.1 parsecs", "1", "soon"):
        assert tbatch("methods", "smooth_track", "--steps", wrong).returncode == 2


def test_list_and_schema_say_what_can_be_written():
    for what, one in [("vehicles", "seed-multiwheel"), ("tracks", "seed-slab"), ("spectra", "china-trunk-line")]:
        assert one in tbatch("list", what).stdout
    assert "quick" in tbatch("list", "scenarios").stdout
    assert "campaign" in json.loads(tbatch("schema").stdout)["properties"]


def test_help_imports_nothing_heavy():
    code = (
        "import sys\n"
        "from tbatch.cli import main\n"
        "sys.argv = ['tbatch', 'run', '--help']\n"
        "try:\n    main()\n"
        "except SystemExit as end:\n    assert not end.code\n"
        "heavy = {'taichi', 'rerun', 'pyarrow', 'scipy', 'numpy', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_a_reader_who_leaves_early_is_no_error(folder):
    command = f"{sys.executable} -m tbatch stats {folder} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 141)
    assert done.stderr == ""


def test_an_unexpected_error_is_one_line_and_a_log(tmp_path, monkeypatch):
    def fail(kind):
        raise RuntimeError("something new")

    monkeypatch.setattr(tbatch_scenario, "list_catalogue", fail)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    done = tbatch("list", "tracks")
    assert done.returncode == 70
    assert len(done.stderr.splitlines()) == 1
    assert "RuntimeError: something new" in done.stderr
    (log,) = tmp_path.glob("tbatch-error-*.log")
    assert "Traceback" in log.read_text()


def test_more_diverged_runs_than_allowed_leave_with_3(folder, monkeypatch):
    monkeypatch.setattr(Campaign, "diverged", property(lambda campaign: 1))
    done = tbatch("resume", folder)
    assert done.returncode == 3
    assert "1 runs diverged, limits.diverged allows 0" in done.stderr
