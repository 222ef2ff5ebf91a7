"""Each (imported track, step) factorised once, in the layout the kernels read.

Nothing is known of an imported track's pattern when the kernels are compiled: every row carries a list of entries, of
which `starts` says where it begins. One compiled kernel serves all imported tracks.

    forward    t_i = b_i - Σ_j<i L_ij t_j              backward   x_i = D_i⁻¹ t_i - Σ_k>i L_ki x_k

The products of the next substep's load are one list too, with two coefficients an entry: those of the vectors that
stand in the velocity's and in the displacement's place after substep 1 (p and w) and after substep 2 (v₂ and u₂).
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array

from tbatch.numerics.near_rail import NearRail
from tbatch.numerics.sparse_factor import SparseFactor
from tbatch.numerics.two_step import TwoStep, effective
from tbatch.physics.imported.rail import RailNodes
from tbatch.physics.line import Line
from tbatch.physics.sparse import SparseSymmetric

FORWARD, BACKWARD, PRODUCTS = 0, 1, 2
"""The lists of a row, in the order of `starts`."""


@dataclass(frozen=True)
class SparsePattern:
    """What the kernels must know of an imported track when they are compiled."""

    linear: bool
    """Straight shapes between the rail nodes."""
    dofs: int = 1
    """Degrees of freedom of a node: each row is one."""
    sparse: bool = True


@dataclass(frozen=True, eq=False)
class FactorisedSparse:
    """Everything constant that a step of an imported track needs; the leading axis `rate` as in `FactorisedTrack`."""

    pattern: SparsePattern
    rail: RailNodes
    starts: np.ndarray
    """Where each row's entries begin in each list, int32, shape (list, row + 1)."""
    partner: np.ndarray
    """The row that an entry multiplies, int32, shape (entry,)."""
    rows: np.ndarray
    """Coefficients of the sweeps, shape (rate, 1, entry); those of the products are zero here."""
    product: np.ndarray
    """Coefficients of the products by half of the step and vector, shape (half, 2, entry)."""
    near: NearRail
    """K̂⁻¹ near the rail."""
    factors: tuple[SparseFactor, ...] = field(repr=False)

    @property
    def node_dofs(self) -> int:
        """One: each row is a node."""
        return 1


def factorise_sparse(track: Line, scheme: TwoStep) -> FactorisedSparse:
    """Factorise an imported track for one step length.

    Raises:
        ValueError: If an effective matrix is not positive definite.
    """
    imported = track.imported
    assert imported is not None
    M, C, K = imported.mass, imported.damping, imported.stiffness
    factors = tuple(SparseFactor.of(effective(K, C, M, rate), imported.pinned) for rate in scheme.rates)
    starts, partner, rows, product = _lists(M, C, factors, scheme)
    near = NearRail.of(imported.rail, factors)
    pattern = SparsePattern(imported.rail.linear)
    return FactorisedSparse(pattern, imported.rail, starts, partner, rows, product, near, factors)


def _lists(
    M: SparseSymmetric, C: SparseSymmetric, factors: tuple[SparseFactor, ...], scheme: TwoStep
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The three lists of every row, one after the other."""
    size, free = M.node_count, np.where(factors[0].pinned, 0.0, 1.0)
    # The factors of two rates have one pattern, but for entries that vanish by chance.
    lower = csr_array(abs(factors[0].lower) + abs(factors[-1].lower))
    lower.sort_indices()
    upper = csr_array(lower.T)
    upper.sort_indices()
    masses, dampings = (csr_array(part.entries) for part in (M, C))
    used = (masses.data != 0.0) | (dampings.data != 0.0)
    row_of = np.repeat(np.arange(size), np.diff(masses.indptr))
    place = {"forward": (np.repeat(np.arange(size), np.diff(lower.indptr)), lower.indices),
             "backward": (np.repeat(np.arange(size), np.diff(upper.indptr)), upper.indices)}  # fmt: skip
    forward = [-_at(factor.lower, *place["forward"]) for factor in factors]
    behind_row, behind = place["backward"]
    # Of the rows behind, the nearest was found last: its product comes last.
    turned = np.lexsort((-behind, behind_row))
    behind_row, behind = behind_row[turned], behind[turned]
    backward_row = np.concatenate([np.arange(size), behind_row])
    order = np.argsort(backward_row, kind="stable")
    backward = [
        np.concatenate([free / factor.pivot, -_at(factor.lower, behind, behind_row) * free[behind_row]])[order]
        for factor in factors
    ]
    pairs = [
        place["forward"],
        (backward_row[order], np.concatenate([np.arange(size), behind])[order]),
        (row_of[used], masses.indices[used]),
    ]
    starts = np.zeros((3, size + 1), np.int32)
    first = 0
    for number, (row, _) in enumerate(pairs):
        starts[number] = first + np.searchsorted(row, np.arange(size + 1))
        first += len(row)
    partner = np.concatenate([column for _, column in pairs]).astype(np.int32)
    rows = np.zeros((len(factors), 1, first))
    for rate in range(len(factors)):
        rows[rate, 0, : starts[PRODUCTS, 0]] = np.concatenate([forward[rate], backward[rate]])
    product = np.zeros((2, 2, first))
    m, c = masses.data[used], dampings.data[used]
    two_h, four_h = 2.0 / scheme.first, 4.0 / scheme.first
    product[0, :, starts[PRODUCTS, 0] :] = m, -c
    product[1, :, starts[PRODUCTS, 0] :] = four_h * m, four_h * (two_h * m + c)
    return starts, partner, rows, product


def _at(matrix: csr_array, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Entries of a sparse matrix at given places, zero where none is stored."""
    size = matrix.shape[1]
    keys = np.repeat(np.arange(matrix.shape[0], dtype=np.int64), np.diff(matrix.indptr)) * size + matrix.indices
    wanted = row.astype(np.int64) * size + column
    found = np.minimum(np.searchsorted(keys, wanted), max(len(keys) - 1, 0))
    if not len(keys):
        return np.zeros(len(wanted))
    return np.where(keys[found] == wanted, matrix.data[found], 0.0)
