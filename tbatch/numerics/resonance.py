"""Where a wheelset and the track under it resonate together: the frequency of the P2 force."""

import numpy as np
from scipy.sparse.linalg import splu

from tbatch.numerics.initial import StaticTrack
from tbatch.physics.vehicle import Vehicle

BAND = (15.0, 250.0)
"""Frequencies searched [Hz]; P2 lies between 30 and 120 Hz on all usual tracks."""
POINTS = 120


def p2_frequency(vehicle: Vehicle, ground: StaticTrack) -> float | None:
    """Highest frequency at which the track at mid-track holds up against a wheelset's inertia [Hz]; None if none.

    There Re 1/α = m ω² with α the receptance of the track, from (K + iωC - ω²M)⁻¹, and m the leading wheel's mass; the
    suspension is far softer, the contact far stiffer (Jenkins and others, 1974). Slab tracks have a resonance of their
    own below it.

    Args:
        vehicle: The vehicle.
        ground: The track.
    """
    track = ground.track
    wheel = vehicle.wheel_dofs[0]
    middle = np.array([0.5 * (track.begin + track.end)])
    free = np.flatnonzero(track.free.ravel())
    K, C, M = (part.to_csc()[free][:, free] for part in (track.stiffness, track.damping, track.mass))
    place = ground.loads(middle).reshape(-1)[free]
    local = float(ground.compliance(middle)[0, 0])
    frequencies = np.geomspace(*BAND, POINTS)
    excess = np.empty(POINTS)
    for k, omega in enumerate(2.0 * np.pi * frequencies):
        receptance = place @ splu((K + 1j * omega * C - omega**2 * M).tocsc()).solve(place.astype(complex)) + local
        excess[k] = (1.0 / receptance).real - omega**2 * vehicle.mass[wheel, wheel]
    crossed = np.flatnonzero((excess[:-1] > 0.0) & (excess[1:] <= 0.0))
    if not crossed.size:
        return None
    k = crossed[-1]
    share = excess[k] / (excess[k] - excess[k + 1])
    return float(frequencies[k] + share * (frequencies[k + 1] - frequencies[k]))
