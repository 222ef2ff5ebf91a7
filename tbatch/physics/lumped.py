"""Lumped bodies: rigid masses joined by springs and dampers."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tbatch.physics.quantities import FloatArray

GRAVITY = 9.81
"""g [m/s2]"""


@dataclass(frozen=True)
class Body:
    """A rigid body of a vehicle, as a side view draws it."""

    kind: str
    """'carbody', 'bogie' or 'wheelset'"""
    vertical_dof: int
    pitch_dof: int | None
    offset: float
    """centre, behind wheel 1 [m]"""
    length: float
    """length along the track [m]; of a wheelset its diameter. For drawing alone: no physics depends on it"""


@dataclass(frozen=True)
class Link:
    """A spring and damper in parallel; their stretch is Σ coefficient * displacement over some dofs."""

    stretch: dict[int, float]
    """coefficient of each dof [1 or m]"""
    stiffness: float
    """[N/m]"""
    damping: float
    """[N s/m]"""


def assemble(masses: Iterable[float], links: Iterable[Link]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (M, C, K), each of shape (dof, dof): a diagonal M, and for each link its stretch vector a in k a aᵀ."""
    mass = np.diag(np.fromiter(masses, dtype=np.float64))
    damping, stiffness = np.zeros_like(mass), np.zeros_like(mass)
    for link in links:
        a = np.zeros(mass.shape[0])
        for dof, coefficient in link.stretch.items():
            a[dof] = coefficient
        stiffness += link.stiffness * np.outer(a, a)
        damping += link.damping * np.outer(a, a)
    return mass, damping, stiffness
