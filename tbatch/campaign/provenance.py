"""What made the numbers: versions and processor, as the manifest keeps them."""

import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_PACKAGES = ("tbatch", "taichi", "numpy", "scipy", "pyarrow", "rerun-sdk")


def versions() -> dict[str, str]:
    """Versions of tbatch, of Python and of the packages that the results depend on. Imports none of them."""
    found = {"python": platform.python_version(), "system": f"{sys.platform}-{platform.machine()}"}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed as a package"
    return found


def processor() -> str:
    """The processor's name, as far as the system says it."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def decisive(found: dict[str, str]) -> dict[str, str]:
    """Those versions on which the last bits of a run may depend."""
    return {name: found.get(name, "unknown") for name in ("tbatch", "taichi", "numpy", "scipy", "system")}
