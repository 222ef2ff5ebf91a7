"""How much memory this process may still take: what the machine has left, and what a container or a job is allowed."""

from collections.abc import Iterator
from pathlib import Path

_ROOT = Path("/sys/fs/cgroup")
_FILES = (("memory.max", "memory.current"), ("memory.limit_in_bytes", "memory.usage_in_bytes"))


def available_memory() -> float:
    """Memory that can be taken before something is killed [bytes]."""
    import psutil

    return min([float(psutil.virtual_memory().available), *_left_in_groups()])


def _left_in_groups() -> Iterator[float]:
    """What each control group above this process leaves it; psutil 7 sees the machine alone."""
    for folder in _groups():
        for limit, used in _FILES:
            try:
                allowed = (folder / limit).read_text().strip()
                if allowed != "max":
                    yield max(0.0, float(allowed) - float((folder / used).read_text()))
            except (OSError, ValueError):
                continue


def _groups() -> Iterator[Path]:
    try:
        lines = Path("/proc/self/cgroup").read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if controllers and "memory" not in controllers.split(","):
            continue
        root = _ROOT / "memory" if controllers else _ROOT
        folder = root / path.lstrip("/")
        yield from [folder, *folder.parents][: len(folder.parts) - len(root.parts) + 1]
