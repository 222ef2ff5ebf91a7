"""What each command's exit code means, and which error gives which."""

import errno
import os
import tempfile
import traceback
from pathlib import Path

from tbatch.campaign import faults

LIMIT_EXCEEDED = 1
BAD_USAGE = 2
TOO_MANY_DIVERGED = 3
DAMAGED_STORE = 4
OUT_OF_SPACE = 6
FOLDER_IN_USE = 7
INTERNAL_ERROR = 70
BROKEN_PIPE = 141

_OF_FAULT: dict[type[faults.CampaignFault], int] = {
    faults.FolderInUse: FOLDER_IN_USE,
    faults.FolderUnusable: BAD_USAGE,
    faults.ClusterUnusable: BAD_USAGE,
    faults.ScenarioChanged: BAD_USAGE,
    faults.StoreDamaged: DAMAGED_STORE,
    faults.OutOfSpace: OUT_OF_SPACE,
}


def explain(error: BaseException) -> tuple[int, str]:
    """The exit code of an error and what to tell the user; an unexpected one is written to a log file."""
    if isinstance(error, faults.Interrupted):
        return 128 + error.signal_number, str(error)
    if isinstance(error, KeyboardInterrupt):
        return 128 + getattr(error, "signal_number", 2), str(error) or "interrupted"
    for kind, code in _OF_FAULT.items():
        if isinstance(error, kind):
            return code, str(error)
    if isinstance(error, BrokenPipeError):
        return BROKEN_PIPE, ""
    if isinstance(error, MemoryError):
        return OUT_OF_SPACE, "out of memory; what is stored stays. Free memory or use fewer threads, and resume."
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return OUT_OF_SPACE, f"{_place(error)}{error.strerror}. What is stored stays: make room and resume."
    if isinstance(error, OSError) and error.filename is not None:
        return BAD_USAGE, f"{_place(error)}{error.strerror}"
    if isinstance(error, ValueError) and _raised_by_us(error):
        return BAD_USAGE, str(error)
    return INTERNAL_ERROR, f"internal error: {type(error).__name__}: {_one_line(error)}{_log(error)}"


def _raised_by_us(error: BaseException) -> bool:
    """Whether tbatch itself raised it, with a message for the user, and not a library inside which something failed."""
    frames = list(traceback.walk_tb(error.__traceback__))
    return bool(frames) and Path(frames[-1][0].f_code.co_filename).is_relative_to(Path(__file__).parent.parent)


def _place(error: OSError) -> str:
    return f"{error.filename}: " if error.filename is not None else ""


def _one_line(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if len(text) <= 200 else text[:200] + " ..."


def _log(error: BaseException) -> str:
    """Writes the traceback where the user can find it, and says where."""
    path = Path(tempfile.gettempdir()) / f"tbatch-error-{os.getpid()}.log"
    try:
        path.write_text("".join(traceback.format_exception(error)))
    except OSError:
        return " (traceback: run again with tbatch --debug ...)"
    return f" (traceback in {path}; please report it)"
