"""A believable kept run without the engine: a coach over stiff rail springs, integrated in plain NumPy.

Only the looks and the orders of magnitude matter here: the wheels run over random irregularity and one flat spot,
lose contact now and then, and the rail bends under them like a beam on an elastic bed.
"""

from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from tbatch.view.record import RunRecord

GRAVITY = 9.81


@dataclass(frozen=True)
class SideBody:
    """What a vehicle tells a side view about one of its bodies."""

    kind: str
    vertical_dof: int
    pitch_dof: int | None
    offset: float
    length: float


COACH = (
    SideBody("carbody", 0, 1, 10.0, 24.5),
    SideBody("bogie", 2, 3, 1.25, 3.4),
    SideBody("bogie", 4, 5, 18.75, 3.4),
    SideBody("wheelset", 6, None, 0.0, 0.92),
    SideBody("wheelset", 7, None, 2.5, 0.92),
    SideBody("wheelset", 8, None, 17.5, 0.92),
    SideBody("wheelset", 9, None, 20.0, 0.92),
)


def irregularity(seed: int, scale: float = 1.0):
    """A random line r(x) between 0.3 m and 50 m (the trunk-line spectrum), faded in from 30 m on, and a dip at 62 m."""
    rng = np.random.default_rng(seed)
    edge = np.geomspace(1 / 50, 1 / 0.3, 301)
    f = np.sqrt(edge[1:] * edge[:-1])
    g = np.minimum(f, 0.8)
    numerator = 1.1029 * (g**2 - 1.4709 * g + 0.5941)
    density = numerator / (g**4 + 0.8480 * g**3 + 3.8016 * g**2 - 0.25 * g + 0.0112) * (g / f) ** 3
    amplitude = scale * 1e-3 * np.sqrt(2 * density * np.diff(edge))
    phase = rng.uniform(0, 2 * np.pi, f.size)

    def r(x):
        x = np.asarray(x, float)
        rise = np.clip((x - 30.0) / 5.0, 0, 1)
        value = np.sum(amplitude * np.cos(2 * np.pi * f * x[..., None] + phase), axis=-1) * (3 * rise**2 - 2 * rise**3)
        s = np.clip(x - 62.0, 0, 0.25)
        return value + 0.5 * scale * 0.4e-3 * (1 - np.cos(2 * np.pi * s / 0.25))

    return r


def coach_matrices():
    """Mass, damping and stiffness of a ten-dof coach (whole), carbody to wheelsets."""
    mass = np.diag([40e3, 1.5e6, 3e3, 8e3, 3e3, 8e3, 2e3, 2e3, 2e3, 2e3])

    def assemble(primary, secondary):
        matrix = np.zeros((10, 10))
        pairs = [(primary, [(2 + 2 * b, 1), (3 + 2 * b, arm), (6 + 2 * b + i, -1)]) for b in (0, 1)
                 for i, arm in ((0, 1.25), (1, -1.25))]  # fmt: skip
        pairs += [(secondary, [(0, 1), (1, arm), (2 + 2 * b, -1)]) for b, arm in ((0, 8.75), (1, -8.75))]
        for value, terms in pairs:
            row = np.zeros(10)
            for dof, weight in terms:
                row[dof] = weight
            matrix += value * np.outer(row, row)
        return matrix

    return mass, assemble(40e3, 60e3), assemble(1.6e6, 0.4e6)


def synthetic_record(*, seed: int = 3, speed: float = 300 / 3.6, step: float = 1e-4, length: float = 100.0,
                     scale: float = 1.0) -> RunRecord:  # fmt: skip
    """Make the record of one run from 30 m to 15 m before the end of the line."""
    mass, damping, stiffness = coach_matrices()
    offsets = np.array([0.0, 2.5, 17.5, 20.0])
    load = np.full(4, (40e3 / 4 + 3e3 / 2 + 2e3) * GRAVITY)
    hertz = 2.3044e11
    rest = (load / hertz) ** (2 / 3)
    track_mass, track_stiffness, track_damping = 300.0, 1.4e8, 1.5e5
    r = irregularity(seed, scale)

    steps = round((length - 15.0 - 30.0) / speed / step)
    time = np.arange(steps + 1) * step
    position = 30.0 + speed * time
    level = r(position[:, None] - offsets)
    vehicle, force, track = np.zeros((steps + 1, 10)), np.zeros((steps + 1, 4)), np.zeros((steps + 1, 4))
    acceleration = np.zeros_like(vehicle)
    z, dz, u, du = np.zeros(10), np.zeros(10), load / track_stiffness, np.zeros(4)
    z[6:] += u
    z[[0, 2, 4]] += u[0]
    inverse = 1 / np.diag(mass)
    part = 2  # sub-steps: symplectic Euler needs them for the contact resonance
    for n in range(steps + 1):
        for _ in range(part):
            f = hertz * np.maximum(z[6:] + rest - u - level[n], 0) ** 1.5
            pull = -(damping @ dz + stiffness @ z)
            pull[6:] -= f - load
            dz = dz + step / part * inverse * pull
            z = z + step / part * dz
            du = du + step / part * (f - track_stiffness * u - track_damping * du) / track_mass
            u = u + step / part * du
        vehicle[n], force[n], track[n], acceleration[n] = z, f, u, inverse * pull

    line = np.arange(0.0, length + 0.325, 0.325)
    beta = 0.9  # 1/m, bending length of a rail on fasteners

    def bowl(beta: float) -> np.ndarray:
        """The line's deflection under four wheels, shape (n, point)."""
        d = beta * np.abs(line - (position[:, None] - offsets)[:, :, None])
        return np.einsum("nw,nwp->np", track, np.exp(-d) * (np.cos(d) + np.sin(d)))

    rail, slab = bowl(beta), 0.25 * bowl(0.4 * beta)
    x = np.arange(0.0, length + 0.005, 0.01)
    return RunRecord(
        name="c03-s000127", campaign="synthetic", title="Coach at 300 km/h on slab track, one dip at 62 m",
        time=time, position=position, wheel_offsets=offsets, static_load=load, contact_force=force,
        vehicle=vehicle, vehicle_acceleration=acceleration, bodies=COACH, wheel_radius=0.46, lift_off=rest,
        rail_under_wheel=track, slab_under_wheel=0.3 * track, rail=rail, rail_at=line, slab=slab, base=0.4 * slab,
        irregularity=level, line=(x, r(x)), bay=0.65,
        separations=separations(time, position[:, None] - offsets, force, vehicle[:, 6:], track + level, rest),
        properties={"speed_kmh": speed * 3.6, "seed": seed, "status": "ok",
                    "force_max_kN": float(force.max() / 1e3)},
    )  # fmt: skip


def separations(time, position, force, wheel, surface, rest) -> pa.Table:
    """The separation events of the histories, with the columns of Result.separations."""
    rows = []
    for j in range(force.shape[1]):
        off = np.concatenate(([False], force[:, j] == 0, [False]))
        edge = np.flatnonzero(np.diff(off.astype(np.int8)))
        for a, b in zip(edge[::2], edge[1::2], strict=True):
            end = min(b, len(time) - 1)
            landing = force[end : end + 50, j].max() if b < len(time) else 0.0
            gap = float((surface[a:b, j] - wheel[a:b, j] - rest[j]).max())
            rows.append((0, j + 1, time[a], time[end], position[a, j], max(gap, 0.0), landing, b >= len(time)))
    names = ("run", "wheel", "start", "end", "position", "gap", "landing_force", "censored")
    kinds = (pa.int32(), pa.int32(), *[pa.float64()] * 5, pa.bool_())
    return pa.table({n: pa.array([row[k] for row in rows], kinds[k]) for k, n in enumerate(names)})
