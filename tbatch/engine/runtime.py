"""The only place that starts Taichi: once a process, with settings that keep results and processes whole."""

import contextlib
import io
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

from tbatch.cache import cache_folder

_STALE_LOCK_AGE = 300.0
_SMOKE = """
import sys
from tbatch.engine import runtime
runtime._init(1, vectors=True, cache=sys.argv[1])
from tbatch.engine.kernels.smoke import smoke
sys.exit(0 if smoke() else 1)
"""


class Runtime:
    """The running Taichi: its threads and whether lane vectors are on."""

    def __init__(self, threads: int, vectors: bool) -> None:
        self.threads, self.vectors = threads, vectors


_running: Runtime | None = None


def start(threads: int | None = None) -> Runtime:
    """Start Taichi, or return what is running if the number of threads is the same.

    Args:
        threads: Worker threads; None for all processors this process may use.

    Raises:
        ValueError: If `threads` is not positive.
    """
    global _running
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    wanted = available if threads is None else threads
    if wanted < 1:
        raise ValueError(f"threads = {threads}: at least 1 is required")
    if _running is None or _running.threads != wanted:
        cache = _cache_folder()
        vectors = _lane_vectors_work(cache)
        _init(wanted, vectors=vectors, cache=str(cache))
        _running = Runtime(wanted, vectors)
    return _running


def _init(threads: int, *, vectors: bool, cache: str) -> None:
    import tbatch.engine.kernels  # noqa: F401  (silences Taichi before its import, and hastens its front end)
    import taichi as ti  # isort: skip

    # ti.init prints to stdout whatever log_level says (taichi 1.7.4).
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(
            arch=ti.cpu,
            default_fp=ti.f64,
            default_ip=ti.i32,
            fast_math=False,  # results must not depend on how sums are regrouped
            real_matrix_scalarize=not vectors,
            make_cpu_multithreading_loop=False,
            cpu_max_num_threads=threads,
            offline_cache=True,
            offline_cache_file_path=cache,
            log_level=ti.ERROR,
            advanced_optimization=False,  # LLVM does the same: 4 s in place of 13 s to compile, steps 2 to 4 % longer
        )


def _cache_folder() -> Path:
    """Where compiled kernels are kept: an unwritable folder crashes Taichi 1.7.4 at exit."""
    folder = cache_folder("taichi-1.7.4") or Path(tempfile.mkdtemp(prefix="tbatch-cache-"))
    # A lock left by a killed process disables the cache for ever, silently.
    for lock in folder.rglob("*.lock"):
        with contextlib.suppress(OSError):
            if time.time() - lock.stat().st_mtime > _STALE_LOCK_AGE:
                lock.unlink()
    return folder


def _lane_vectors_work(cache: Path) -> bool:
    """Whether kernels with lane vectors run here; tried once a machine in a process of its own, as failure aborts."""
    if os.environ.get("TBATCH_LANE_VECTORS") in {"0", "1"}:
        return os.environ["TBATCH_LANE_VECTORS"] == "1"
    verdict = cache / f"lane-vectors-{_machine_key()}"
    with contextlib.suppress(OSError):
        return verdict.read_text() == "1"
    child = subprocess.run(
        [sys.executable, "-c", _SMOKE, str(cache)], stdin=subprocess.DEVNULL, capture_output=True, check=False
    )
    works = child.returncode == 0
    if not works:
        warnings.warn(
            "lane vectors do not work on this machine: the kernels run in scalar form, with the same results, "
            "about 3.5 times slower",
            stacklevel=3,
        )
    with contextlib.suppress(OSError):
        verdict.write_text("1" if works else "0")
    return works


def _machine_key() -> str:
    """A short name of the processor type."""
    import hashlib
    import platform

    text = f"{platform.machine()} {platform.python_version()}"
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith(("model name", "flags")):
                text += line
            if not line:
                break
    return hashlib.sha256(text.encode()).hexdigest()[:16]
