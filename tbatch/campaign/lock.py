"""One process at a time works in a campaign folder.

The lock is a file with the owner's pid, host and boot id, and an operating system lock on it. The system lock is what
decides, since it goes with its process whatever kills it; the text says who, and decides where the file system has no
locks or belongs to several machines.
"""

import contextlib
import json
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any

import psutil

from tbatch.campaign.durable import write_fault
from tbatch.campaign.faults import FolderInUse

fcntl: ModuleType | None
try:
    import fcntl
except ImportError:  # Windows: the text decides
    fcntl = None

LOCK_NAME = "lock"
_TRIES = 5


class FolderLock:
    """Holds a folder for this process, as a context manager. FolderInUse if another process does."""

    def __init__(
        self,
        folder: Path,
        name: str = LOCK_NAME,
        *,
        take_over_elsewhere: bool = False,
        message: Callable[[str], None] | None = None,
    ) -> None:
        """Takes the folder, which must exist.

        Args:
            folder: The campaign folder.
            name: The lock's file in it.
            take_over_elsewhere: Believe the system lock about a process of another machine, as a job that a scheduler
                starts again on another node must; for work that may be done twice without harm.
            message: Where to say that a dead process's lock was taken over.
        """
        self.path = Path(folder) / name
        self._folder = Path(folder)
        self._elsewhere = take_over_elsewhere
        self._message = message or (lambda text: None)
        self._descriptor: int | None = None

    def __enter__(self) -> "FolderLock":
        """Takes the lock."""
        while self._descriptor is None:
            try:
                descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise write_fault(error, self.path) from error
            try:
                decided = self._lock(descriptor)
                # The former owner may have removed the file between the two lines above: then this lock guards nothing.
                if _is_at(descriptor, self.path):
                    self._judge(descriptor, decided)
                    self._sign(descriptor)
                    self._descriptor = descriptor
            finally:
                if self._descriptor is None:
                    os.close(descriptor)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Gives the folder back."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is None:
            return
        with contextlib.suppress(OSError):
            self.path.unlink()
        os.close(descriptor)

    def _lock(self, descriptor: int) -> bool:
        """Takes the system lock; False where there is none to take."""
        if fcntl is None:
            return False
        for patience in range(_TRIES, -1, -1):
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:  # an owner, or somebody who looks whether there is one
                if not patience:
                    raise FolderInUse(self._in_use(_owner(descriptor))) from error
                time.sleep(0.02)
            except OSError:  # a network file system without locks
                return False
            else:
                break
        return True

    def _judge(self, descriptor: int, decided: bool) -> None:
        owner = _owner(descriptor)
        if owner is None:
            return
        here = owner.get("boot_id") == _boot_id() or owner.get("host") == socket.gethostname()
        if not here and not (decided and self._elsewhere):  # whether it lives cannot be seen from here
            raise FolderInUse(f"{self._in_use(owner)} If that process is gone, delete {self.path}.")
        if not decided and _lives(owner):
            raise FolderInUse(self._in_use(owner))
        self._message(f"took over the lock of pid {owner.get('pid')} on host {owner.get('host')}, which is gone")

    def _in_use(self, owner: dict[str, Any] | None) -> str:
        who = f"pid {owner.get('pid')} on host {owner.get('host')}" if owner else "another process"
        return f"folder {self._folder} is in use by {who}."

    def _sign(self, descriptor: int) -> None:
        pid = os.getpid()
        text = json.dumps({"pid": pid, "host": socket.gethostname(), "boot_id": _boot_id(), "born": _born(pid)})
        try:
            os.ftruncate(descriptor, 0)
            os.lseek(descriptor, 0, os.SEEK_SET)
            os.write(descriptor, text.encode())
            os.fsync(descriptor)
        except OSError as error:
            raise write_fault(error, self.path, len(text)) from error


def folder_owner(folder: Path, name: str = LOCK_NAME) -> dict[str, Any] | None:
    """Who works in the folder: pid and host; None if nobody does. Only looks."""
    path = Path(folder) / name
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return None
    try:
        owner = _owner(descriptor) or {}
        if fcntl is not None:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return owner
            except OSError:
                pass
            else:
                return None
        return owner if _lives(owner) else None
    finally:
        os.close(descriptor)


def _owner(descriptor: int) -> dict[str, Any] | None:
    try:
        os.lseek(descriptor, 0, os.SEEK_SET)
        owner = json.loads(os.read(descriptor, 4096))
    except (OSError, ValueError):  # empty: the owner was killed between making and signing it
        return None
    return owner if isinstance(owner, dict) else None


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except OSError:
        return False


def _lives(owner: dict[str, Any]) -> bool:
    """Whether the owner's process lives on this machine: same boot, same pid, born at the same time."""
    pid = owner.get("pid")
    return isinstance(pid, int) and owner.get("boot_id") == _boot_id() and owner.get("born") == _born(pid)


def _born(pid: int) -> float | None:
    try:
        return round(psutil.Process(pid).create_time(), 2)
    except psutil.Error:
        return None


def _boot_id() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return f"booted {psutil.boot_time():.0f}"
