"""One process at a time, and a dead one's lock is no obstacle."""

import json
import os
import subprocess
import sys
import time

import pytest

from tbatch.campaign.faults import FolderInUse
from tbatch.campaign.lock import LOCK_NAME, FolderLock, folder_owner

HOLD = """
import sys, time
from pathlib import Path
from tbatch.campaign.lock import FolderLock
with FolderLock(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the folder."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()


def test_a_folder_held_by_a_living_process_is_refused_naming_it(tmp_path, holder):
    with pytest.raises(FolderInUse, match=rf"in use by pid {holder.pid} on host"), FolderLock(tmp_path):
        pass
    assert folder_owner(tmp_path)["pid"] == holder.pid


def test_the_lock_of_a_killed_process_is_taken_over_and_said(tmp_path, holder):
    holder.kill()
    holder.wait()
    said = []
    with FolderLock(tmp_path, message=said.append):
        assert json.loads((tmp_path / LOCK_NAME).read_text())["pid"] == os.getpid()
    assert f"pid {holder.pid}" in said[0]
    assert not (tmp_path / LOCK_NAME).exists()
    assert folder_owner(tmp_path) is None


def test_the_lock_of_a_process_before_a_reboot_is_taken_over(tmp_path):
    with FolderLock(tmp_path):
        text = (tmp_path / LOCK_NAME).read_text()
    (tmp_path / LOCK_NAME).write_text(json.dumps({**json.loads(text), "boot_id": "another"}))
    with FolderLock(tmp_path):
        pass


def test_the_lock_of_another_machine_is_refused_with_a_way_out(tmp_path):
    (tmp_path / LOCK_NAME).write_text(json.dumps({"pid": 1, "host": "elsewhere", "boot_id": "another"}))
    with pytest.raises(FolderInUse, match=r"pid 1 on host elsewhere.*delete .*lock"), FolderLock(tmp_path):
        pass


def test_a_lock_cut_short_by_a_kill_is_taken_over(tmp_path):
    (tmp_path / LOCK_NAME).write_text("")
    with FolderLock(tmp_path):
        pass


def test_a_lock_is_given_back_when_its_holder_fails(tmp_path):
    with pytest.raises(RuntimeError), FolderLock(tmp_path):
        raise RuntimeError
    with FolderLock(tmp_path):
        pass


def test_looking_who_holds_a_folder_does_not_keep_others_out(tmp_path):
    until = time.monotonic() + 0.5
    while time.monotonic() < until:
        with FolderLock(tmp_path):
            assert folder_owner(tmp_path)["pid"] == os.getpid()
