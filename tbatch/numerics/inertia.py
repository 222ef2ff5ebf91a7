"""The mass matrix as accelerations at a given state need it."""

import numpy as np
from scipy.sparse import csc_array

from tbatch.physics.line import Line, TrackMatrix
from tbatch.physics.sparse import SparseSymmetric

SLIGHT = 1e-9
"""Share of its own diagonal added to an imported mass: a motion of several dofs may have none, such as that of a point
mass on a rigid arm."""


def inertia(track: Line) -> tuple[TrackMatrix, np.ndarray]:
    """Return M in a form that can be solved for accelerations, and true for the dofs that take no part, (node, dof).

    The two-step scheme never solves with M. Dofs without mass follow the others; theirs is no acceleration of a state.
    """
    mass = track.mass
    if not isinstance(mass, SparseSymmetric):
        return mass, track.pinned
    entries = csc_array(mass.entries.copy())
    diagonal = entries.diagonal()
    entries.setdiag((1.0 + SLIGHT) * diagonal)
    return SparseSymmetric(entries), track.pinned | (diagonal == 0.0)[:, None]
