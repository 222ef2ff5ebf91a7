"""Small tracks as finite element software would export them: matrices in any row order and a node map."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array

from tbatch import Track
from tbatch.physics.elements import beam_stiffness, consistent_bed


@dataclass(frozen=True)
class Export:
    """Matrices and node map, the arguments of `Track.from_matrices`."""

    mass: csc_array
    damping: csc_array
    stiffness: csc_array
    x: np.ndarray
    w: np.ndarray
    theta: np.ndarray | None
    EI: float | None = None

    @property
    def matrices(self) -> tuple[csc_array, csc_array, csc_array]:
        """M, C, K."""
        return self.mass, self.damping, self.stiffness

    def track(self, **options) -> Track:
        """The track."""
        return Track.from_matrices(
            *self.matrices, rail_x=self.x, rail_w=self.w, rail_theta=self.theta, rail_EI=self.EI, **options
        )

    def mapped(self, make) -> "Export":
        """With another matrix for each."""
        mass, damping, stiffness = (csc_array(make(part)) for part in self.matrices)
        return replace(self, mass=mass, damping=damping, stiffness=stiffness)

    def kept(self, rows: np.ndarray) -> "Export":
        """Only some rows, in this order; the others are held and leave the matrices."""
        place = np.full(self.mass.shape[0] + 1, -1)
        place[rows] = np.arange(len(rows))
        theta = None if self.theta is None else place[self.theta]
        return replace(self.mapped(lambda part: part[rows][:, rows]), w=place[self.w], theta=theta)

    def shuffled(self, seed: int) -> "Export":
        """The rows and the lines of the node map in a random order."""
        random = np.random.default_rng(seed)
        export = self.kept(random.permutation(self.mass.shape[0]))
        line = random.permutation(len(self.x))
        theta = None if export.theta is None else export.theta[line]
        return replace(export, x=export.x[line], w=export.w[line], theta=theta)


def exported(track: Track) -> Export:
    """A built-in track as its free dofs only."""
    rows = track.layer_rows(np.arange(track.element_count))
    w, theta = np.append(rows[:, 0], rows[-1, 2]), np.append(rows[:, 1], rows[-1, 3])
    M, C, K = (csc_array(part.to_csc()) for part in (track.mass, track.damping, track.stiffness))
    x = np.arange(track.element_count + 1) * track.element_length
    return Export(M, C, K, x, w, theta, track.rail_EI).kept(np.flatnonzero(track.free.ravel()))


def sleeper_track(x: np.ndarray, *, EI: float = 6.4e6, mass: float = 60.0) -> Export:
    """A rail of beams between nodes at x, at each node a pad, a sleeper and ballast: rail rows, then sleepers."""
    nodes = len(x)
    w = 2 * np.arange(nodes)
    M, C, K = _on_sleepers(w, 2 * nodes)
    for first, length in enumerate(np.diff(x)):
        rows = np.ix_(*(2 * [np.arange(2 * first, 2 * first + 4)]))
        K[rows] += beam_stiffness(length, EI)
        M[rows] += consistent_bed(length, mass)
    return Export(csc_array(M), csc_array(C), csc_array(K), x, w, w + 1)


def solid_rail(x: np.ndarray) -> Export:
    """The same without rotations, as a rail of solid elements: second differences of w bend, masses are lumped."""
    nodes, h = len(x), float(np.diff(x).mean())
    w = np.arange(nodes)
    M, C, K = _on_sleepers(w, nodes)
    bend = (np.eye(nodes, k=-1) - 2.0 * np.eye(nodes) + np.eye(nodes, k=1))[1:-1]
    K[:nodes, :nodes] += 6.4e6 / h**3 * bend.T @ bend
    M[w, w] += 60.0 * h
    return Export(csc_array(M), csc_array(C), csc_array(K), x, w, None)


def _on_sleepers(w: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K of pads under the rows w, sleepers from row `first` on, and ballast."""
    M, C, K = (np.zeros((first + len(w), first + len(w))) for _ in range(3))
    for sleeper, rail in enumerate(w, start=first):
        pair = np.ix_([rail, sleeper], [rail, sleeper])
        for matrix, pad, ballast in ((K, 8e7, 5e7), (C, 5e4, 6e4)):
            matrix[pair] += pad * np.array([[1.0, -1.0], [-1.0, 1.0]])
            matrix[sleeper, sleeper] += ballast
        M[sleeper, sleeper] += 150.0
    return M, C, K


def reduced(export: Export, modes: int) -> Export:
    """Craig-Bampton: the rail's rows are retained, the others become constraint modes and `modes` fixed modes."""
    M, K = export.mass.toarray(), export.stiffness.toarray()
    assert export.theta is not None
    rail = np.concatenate([export.w[export.w >= 0], export.theta[export.theta >= 0]])
    inner = np.setdiff1d(np.arange(len(M)), rail)
    _, shapes = eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])
    T = np.zeros((len(M), len(rail) + modes))
    T[rail, np.arange(len(rail))] = 1.0
    T[inner, : len(rail)] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, rail)])
    T[inner, len(rail) :] = shapes[:, :modes]
    place = np.full(len(M) + 1, -1)
    place[rail] = np.arange(len(rail))
    small = export.mapped(lambda part: T.T @ part.toarray() @ T)
    return replace(small, w=place[export.w], theta=place[export.theta])
