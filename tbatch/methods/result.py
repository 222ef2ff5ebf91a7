"""What a method gives back: the engine's result for one run, and what the method took."""

from dataclasses import dataclass, field

import numpy as np

from tbatch.engine.result import Result


@dataclass(eq=False)
class MethodResult(Result):
    """One run by one method; all that `Result` says, with one run.

    A lagged method may report F < 0 for a step: the pull by which it holds a wheel that has left the rail. Statistics
    count such a step as separated.
    """

    iterations: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    """Solves of the contact a step: passes of NMN's iteration, 1 for NML and APL, 2 for two-step; shape (n,), a step
    each; the last one is that of the step that failed, if one did."""
    wall_time: float = float("nan")
    """Time of factorisation and stepping [s]."""
    cpu_time: float = float("nan")
    """Processor time of the same [s]; what else the machine does matters less to it."""
    converged: bool = True
    """False if the iteration for the contact forces failed at a step; the run then ends before it, diverged."""
