"""Where in its distributions each sample lies: pseudo-random, Latin hypercube or scrambled Sobol.

Every number is a share between 0 and 1, which its distribution turns into a value.

- ``random``: the share of a number depends on (seed, sample, the number's key) alone.
- ``latin-hypercube``: samples come in plans of ``campaign.plan`` (64 by default): within each, every number has exactly
  one sample in each of that many equal parts. The share depends on (seed, sample, key) and on the size of the plan,
  which the scenario fixes; more runs add plans and change none. A campaign of whole plans is balanced best.
- ``sobol``: one scrambled Sobol sequence over all varied numbers, sorted by key: the share depends on (seed, sample)
  and on which numbers vary, not on how many runs there are. Powers of two are balanced best.

All speeds meet the same samples, so the same numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.streams import stream
from tbatch.scenario.distribution import value_at

METHODS = ("random", "latin-hypercube", "sobol")
PLAN = 64
"""samples of a Latin hypercube, unless the scenario says otherwise"""
MOST_SOBOL = 21201
"""numbers that scipy's Sobol sequence has directions for"""
_BLOCK = 64


@dataclass(frozen=True)
class Sampling:
    """The varied numbers of a scenario and how they are drawn."""

    seed: int
    method: str = "random"
    plan: int = PLAN
    """Samples of a Latin hypercube."""
    distributions: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """Distribution of each number by its dotted key; ``speed`` for the speed."""

    def numbers(self, sample: int) -> dict[str, float]:
        """The value of each varied number in a sample, in SI."""
        names = sorted(self.distributions)
        return {
            name: value_at(self.distributions[name], self._share(sample, place, names))
            for place, name in enumerate(names)
        }

    def _share(self, sample: int, place: int, names: list[str]) -> float:
        if self.method == "sobol":
            return float(_sobol(self.seed, sample // _BLOCK, len(names))[sample % _BLOCK, place])
        if self.method == "latin-hypercube":
            return float(_latin(self.seed, sample // self.plan, self.plan, names[place])[sample % self.plan])
        return float(stream(self.seed, sample, f"vary/{names[place]}").random())


@lru_cache(maxsize=64)
def _latin(seed: int, block: int, plan: int, name: str) -> NDArray[np.float64]:
    """Shares of one number in one Latin hypercube, shape (sample,)."""
    random = stream(seed, block, f"vary/latin-hypercube/{name}")
    return np.asarray((random.permutation(plan) + random.random(plan)) / plan, float)


@lru_cache(maxsize=64)
def _sobol(seed: int, block: int, count: int) -> NDArray[np.float64]:
    """Some points of the sequence, shape (sample, number)."""
    from scipy.stats import qmc

    # scipy 1.17 asks a Generator for a seed sequence, which one with a key has not: it gets a whole number instead.
    scramble = int(stream(seed, 0, "vary/sobol").integers(2**63))
    sequence = qmc.Sobol(count, scramble=True, seed=scramble)
    if block:  # scipy 1.17 fails to go forward by nothing
        sequence.fast_forward(block * _BLOCK)
    return np.asarray(sequence.random(_BLOCK), float)
