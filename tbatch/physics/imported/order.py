"""The order in which the rows of an imported track stand and are eliminated.

A track is long and narrow, and eliminated from one end to the other it fills a band (reverse Cuthill-McKee). Modal
coordinates of a reduced model meet every rail node; minimum degree leaves them for last. Whichever order leaves fewer
entries in the factor is taken.
"""

from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import splu


def reached(pattern: csc_array, rows: np.ndarray) -> np.ndarray:
    """Return true for the rows that a chain of couplings joins to one of `rows`.

    Args:
        pattern: non-zero where two rows meet, shape (row, row).
        rows: where to start.
    """
    _, part = connected_components(pattern, directed=False)
    return np.isin(part, part[rows])


def elimination_order(pattern: csc_array, group: np.ndarray) -> np.ndarray:
    """Return an order of the groups of rows that keeps the factor small.

    Args:
        pattern: non-zero where two rows meet, shape (row, row).
        group: the group of each row, from 0, shape (row,); rows of a group stay together.

    Returns:
        groups in the order of elimination, shape (group,).
    """
    count = int(group.max()) + 1
    entries = pattern.tocoo()
    pairs = group[entries.coords[0]], group[entries.coords[1]]
    graph = csc_array((np.ones(len(pairs[0])), pairs), shape=(count, count))
    graph.data[:] = 1.0
    # A matrix of this pattern that is safely definite: only its elimination matters.
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    degree: np.ndarray = np.asarray(graph.sum(axis=1)).ravel()
    model = csc_array(diags_array(degree + 1.0) - graph)
    along = np.asarray(reverse_cuthill_mckee(csc_array(model).tocsr(), symmetric_mode=True))
    candidates = []
    choices: tuple[tuple[np.ndarray, Any], ...] = ((along, "NATURAL"), (np.arange(count), "MMD_AT_PLUS_A"))
    for start, spec in choices:
        ordered = csc_array(model[start][:, start])
        factor = splu(ordered, permc_spec=spec, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        place = np.empty(count, int)
        place[factor.perm_c] = np.arange(count)
        candidates.append((factor.L.nnz, start[place]))
    # Of equal factors the band is taken: what stands close together is read together.
    return min(candidates, key=lambda one: one[0])[1]
