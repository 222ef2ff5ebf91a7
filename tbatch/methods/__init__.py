"""Other methods for the same equations, one run at a time: what the batch engine is compared with.

    newmark_linear (NML)   Newmark, linear contact coupled directly; which wheels are in contact is taken from step n
    newmark_hertz (NMN)    Newmark, Hertz contact, iterated between vehicle and track
    hht_alpha (APL)        HHT-α, α = -0.1, contact as in NML
    two_step               the engine's scheme, contact exact or lagged

All run on the host with SciPy, on the same models, irregularities, positions and local rail compliance as the engine,
and give the same `Result` with `iterations` and `wall_time` beside it.
"""

from tbatch.methods.result import MethodResult
from tbatch.methods.solvers import hht_alpha, newmark_hertz, newmark_linear, two_step

__all__ = ["MethodResult", "hht_alpha", "newmark_hertz", "newmark_linear", "two_step"]
