"""Spectrum of the histories of one run: where the energy of the force and of the irregularity lies."""

from __future__ import annotations

import numpy as np

from tbatch.view.record import Array

PER_OCTAVE = 6  # bands that lines are averaged in, where they lie closer together
TOP = 2000.0  # highest frequency shown, or a quarter of the sampling rate [Hz]


def power_density(values: Array, interval: float) -> tuple[Array, Array]:
    """One-sided power density of series about their mean: Welch's method, Hann windows of half the run's length.

    Args:
        values: Series in equal intervals, shape (n, series).
        interval: Time between two samples [s].

    Returns:
        Frequency [Hz], shape (line,), without zero; and density [unit of the values squared per Hz], shape
        (line, series).
    """
    from scipy.signal import welch

    length = max(len(values) // 2, min(len(values), 8))
    frequency, density = welch(values, 1.0 / interval, "hann", nperseg=length, detrend="constant", axis=0)
    return frequency[1:], density[1:]


def in_bands(frequency: Array, density: Array, *, top: float | None = None) -> tuple[Array, Array]:
    """Average the lines of a density within sixths of an octave; where lines are wider apart, they stay.

    Args:
        frequency: Equally spaced [Hz], shape (line,).
        density: Shape (line, series).
        top: Highest frequency wanted [Hz].

    Returns:
        Mean frequency of each band, shape (band,), and mean density, shape (band, series).
    """
    if top is not None:
        kept = frequency <= top
        frequency, density = frequency[kept], density[kept]
    band = np.floor(PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9)
    first = np.flatnonzero(np.diff(band, prepend=-1.0) > 0)
    count = np.diff(np.append(first, len(frequency)))
    means = np.add.reduceat(density, first, axis=0) / count[:, None]
    return np.add.reduceat(frequency, first) / count, means


def spectrum(values: Array, interval: float) -> tuple[Array, Array]:
    """Power density in bands, up to what the sampling resolves or `TOP`; as `power_density`, shape (band, ...)."""
    frequency, density = power_density(values, interval)
    return in_bands(frequency, density, top=max(min(TOP, 0.25 / interval), 2.0 * float(frequency[0])))
