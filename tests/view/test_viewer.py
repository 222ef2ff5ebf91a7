import os
import sys

import pytest

from tbatch.view import viewer
from tbatch.view.viewer import ViewerUnavailable, open_viewer, recordings


def program(folder, text: str):
    """A stand-in for the viewer's program."""
    path = folder / "rerun"
    path.write_text(f"#!{sys.executable}\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def campaign(tmp_path):
    folder = tmp_path / "campaign" / "recordings"
    folder.mkdir(parents=True)
    for name in ("c01-s000002.rrd", "c00-s000007.rrd", ".c00-s000008.rrd.partial"):
        (folder / name).touch()
    return tmp_path / "campaign"


def test_recordings_of_a_folder_a_run_and_a_file(campaign):
    assert [file.stem for file in recordings(campaign)] == ["c00-s000007", "c01-s000002"]
    assert [file.stem for file in recordings(campaign, run="c01-s000002")] == ["c01-s000002"]
    (file,) = recordings(campaign, run="c00-s000007")
    assert recordings(file) == [file]


def test_nothing_to_view_says_how_to_get_it(campaign, tmp_path):
    with pytest.raises(ValueError, match=r"c09-s000000 .*kept: c00-s000007, c01-s000002.*tbatch replay"):
        recordings(campaign, run="c09-s000000")
    with pytest.raises(ValueError, match="no such file or folder"):
        recordings(tmp_path / "missing")
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(ValueError, match="keep some with"):
        recordings(empty)


def test_without_a_display_one_line_says_what_to_do_instead(monkeypatch, campaign):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    files = recordings(campaign)
    with pytest.raises(ViewerUnavailable) as caught:
        open_viewer(files)
    text = str(caught.value)
    assert "\n" not in text
    assert "no display" in text
    assert "--bind 127.0.0.1" in text
    assert all(str(file) in text for file in files)
    assert isinstance(caught.value, ValueError)  # what commands turn into exit code 2


@pytest.mark.parametrize(
    ("output", "reason"),
    [
        ("Error: winit EventLoopError: os error at mod.rs:788: Failed to open connection to X server",
         "Failed to open connection to X server"),
        ("thread 'main' panicked at 'Failed to get render context'\\n  0: core", "Failed to get render context"),
        ("", "exit code 3"),
    ],
)  # fmt: skip
def test_a_viewer_that_does_not_start_is_explained(monkeypatch, tmp_path, campaign, output, reason):
    binary = program(tmp_path, f'import sys; print("{output}", file=sys.stderr); sys.exit(3)')
    monkeypatch.setattr(viewer, "find_binary", lambda: binary)
    monkeypatch.setenv("DISPLAY", ":0")
    with pytest.raises(ViewerUnavailable, match=reason):
        open_viewer(recordings(campaign), started=20.0)


def test_a_viewer_that_starts_is_left_running_and_listens_on_loopback(monkeypatch, tmp_path, campaign):
    told = tmp_path / "told"
    text = f"import os, sys, time; file = open({str(told)!r}, 'w')\n"
    text += "file.write(' '.join([str(os.getpid()), *sys.argv[1:]])); file.close(); time.sleep(30)"
    monkeypatch.setattr(viewer, "find_binary", lambda: program(tmp_path, text))
    monkeypatch.setenv("DISPLAY", ":0")
    (file,) = recordings(campaign, run="c00-s000007")
    open_viewer([file], started=1.0)
    pid, arguments = told.read_text().split(" ", 1)
    assert arguments == f"--bind 127.0.0.1 {file}"
    os.kill(int(pid), 0)  # still there
    os.kill(int(pid), 9)


def test_the_viewers_program_is_found_without_importing_rerun():
    binary = viewer.find_binary()
    assert binary is not None
    assert os.access(binary, os.X_OK)
