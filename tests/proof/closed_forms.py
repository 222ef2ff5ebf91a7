"""Closed forms of vehicle-track dynamics, written from the textbooks and from nothing in tbatch.

Forces in N, lengths in m, times in s; displacements positive downwards.
"""

from dataclasses import dataclass

import numpy as np

GRAVITY = 9.81


@dataclass(frozen=True)
class WinklerBeam:
    """An infinite Euler-Bernoulli beam on a viscoelastic bed: EI w'''' + m w.. + c w. + k w = P δ(x - vt)."""

    EI: float
    mass: float
    stiffness: float
    damping: float = 0.0

    @property
    def critical_speed(self) -> float:
        """(4 k EI / m²)^¼ [m/s]."""
        return (4.0 * self.stiffness * self.EI / self.mass**2) ** 0.25

    @property
    def wavenumber(self) -> float:
        """λ = (k / 4EI)^¼ [1/m]."""
        return (self.stiffness / (4.0 * self.EI)) ** 0.25

    def undamped(self, force: float, speed: float, s: np.ndarray) -> np.ndarray:
        """Steady deflection at the distance s before a force moving slower than the critical speed, without damping.

        Frýba, *Vibration of solids and structures under moving loads*, ch. 13.
        """
        lam, a = self.wavenumber, speed / self.critical_speed
        b, c = lam * np.sqrt(1.0 - a**2), lam * np.sqrt(1.0 + a**2)
        w0 = force * lam / (2.0 * self.stiffness)
        r = np.abs(s)
        shape = np.cos(c * r) + np.sqrt((1.0 - a**2) / (1.0 + a**2)) * np.sin(c * r)
        return w0 / np.sqrt(1.0 - a**2) * np.exp(-b * r) * shape

    def steady(self, force: float, speed: float, s: np.ndarray) -> np.ndarray:
        """Steady deflection at the distance s before a moving force, damping included, any speed.

        With w(x, t) = w(s), s = x - vt, the equation is p(d/ds) w = P δ(s), p(r) = EI r⁴ + m v² r² - c v r + k: a sum
        of residues over the roots that decay on either side.
        """
        p = np.array([self.EI, 0.0, self.mass * speed**2, -self.damping * speed, self.stiffness])
        roots, slope = np.roots(p), np.polyder(p)
        w = np.zeros(np.shape(s), complex)
        for root in roots:
            side = s >= 0.0 if root.real < 0.0 else s < 0.0
            sign = 1.0 if root.real < 0.0 else -1.0
            w += np.where(side, sign * force / np.polyval(slope, root) * np.exp(np.where(side, root * s, 0.0)), 0.0)
        return w.real


def beam_under_moving_force(
    x: np.ndarray, t: np.ndarray, *, span: float, EI: float, mass: float, force: float, speed: float, terms: int = 400
) -> np.ndarray:
    """Deflection of a simply supported beam while a force crosses it, by Frýba's series; shape (time, point)."""
    j = np.arange(1, terms + 1)
    natural = (j * np.pi / span) ** 2 * np.sqrt(EI / mass)
    driven = j * np.pi * speed / span
    t = np.asarray(t)[:, None]
    amplitude = 2.0 * force / (mass * span) / (natural**2 - driven**2)
    modes = amplitude * (np.sin(driven * t) - driven / natural * np.sin(natural * t))
    return modes @ np.sin(np.outer(j, np.pi * np.asarray(x) / span))


def bounce_on_spring(mass: float, stiffness: float, height: float) -> tuple[float, float]:
    """Largest force and contact time of a mass dropped from a height onto a unilateral spring."""
    weight, omega = mass * GRAVITY, np.sqrt(stiffness / mass)
    landing_speed = np.sqrt(2.0 * GRAVITY * height)
    largest = weight + np.sqrt(weight**2 + 2.0 * stiffness * weight * height)
    return largest, 2.0 / omega * (np.pi - np.arctan(landing_speed * omega / GRAVITY))


def hertz_impact(mass: float, constant: float, speed: float) -> tuple[float, float]:
    """Largest approach and contact time of a mass that meets F = K δ^1.5 without gravity (Hertz 1882)."""
    approach = (5.0 * mass * speed**2 / (4.0 * constant)) ** 0.4
    return approach, 2.943275 * approach / speed


def haversine_flat(depth: float, length: float, at: float):  # type: ignore[no-untyped-def]
    """A rounded wheel flat r(x) = ½ d (1 - cos 2πs/l) for 0 ≤ s = x - at ≤ l."""

    def level(x: np.ndarray) -> np.ndarray:
        s = (np.asarray(x) - at) / length
        return np.where((s >= 0.0) & (s <= 1.0), 0.5 * depth * (1.0 - np.cos(2.0 * np.pi * s)), 0.0)

    return level


def waves(wavelength: np.ndarray, amplitude: np.ndarray, phase: np.ndarray, start: float, taper: float):  # type: ignore[no-untyped-def]
    """Cosines that fade in from `start` over `taper` with the C¹ rise 3s² - 2s³."""

    def level(x: np.ndarray) -> np.ndarray:
        x = np.asarray(x, float)
        s = np.clip((x - start) / taper, 0.0, 1.0)
        return s * s * (3.0 - 2.0 * s) * (amplitude * np.cos(2.0 * np.pi * x[..., None] / wavelength + phase)).sum(-1)

    return level
