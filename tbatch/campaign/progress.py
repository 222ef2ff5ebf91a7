"""How far a campaign is."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """How far a campaign is; runs and run-steps count from the start of this process's work."""

    phase: str
    """What is being done: ``building``, ``running`` or ``recording``."""
    runs_done: int
    """Runs stored, or recorded while recording."""
    runs_total: int
    """Runs to be stored, or recorded while recording."""
    run_steps_done: int
    """Time steps of all runs, done."""
    run_steps_total: int
    """Time steps of all runs to be done."""
    separations: int
    """Separations found so far."""


Report = Callable[[Progress], None]
"""Takes the progress; may raise to stop the campaign."""
