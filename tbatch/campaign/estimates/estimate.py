"""One estimate of a campaign: its number, its interval, what it rests on."""

import math
from dataclasses import asdict, dataclass
from typing import Any

RAW, FILTERED = "raw", "20 Hz"

_SHOWN = {"N": (1e-3, "kN"), "s": (1e3, "ms"), "1/km": (1.0, "/km")}


@dataclass(frozen=True)
class Estimate:
    """A number estimated from the runs of a speed and wheelset."""

    name: str
    """Dotted name, such as ``separation.probability``; limits are set on it."""
    unit: str
    """SI unit; empty for a plain number."""
    value: float
    """The estimate; NaN where nothing was evaluated."""
    low: float
    """Lower end of the 95 % interval; -inf where these runs bound it by nothing."""
    high: float
    """Upper end; inf where these runs bound it by nothing."""
    method: str
    """How the interval was made."""
    runs: int
    """Runs that count."""
    count: int | None = None
    """Events, or runs with one, that it rests on."""
    runs_needed: int = 0
    """Runs below which an end of the interval is missing, 0 if there is always one."""
    family: str = RAW
    """``"raw"`` contact force, or ``"20 Hz"``: low-passed as EN 14363 does, which hides separations."""

    @property
    def flag(self) -> str:
        """A remark where the runs are too few for the interval; empty otherwise."""
        if self.runs < self.runs_needed:
            return f"{self.runs} runs, {self.runs_needed} needed for an interval"
        return ""

    def row(self) -> dict[str, Any]:
        """As plain data, with None where there is no number."""
        row = {**asdict(self), "flag": self.flag}
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in row.items()
        }


def shown(value: float, unit: str) -> str:
    """A number with the unit that people read it in; ``open`` where these runs do not bound it."""
    if not math.isfinite(value):
        return "open"
    factor, written = _SHOWN.get(unit, (1.0, unit))
    return f"{factor * value:.4g} {written}".rstrip()
