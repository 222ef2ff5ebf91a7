"""Spectra: one-sided densities S(f) of vertical irregularity, their tails and their exact integrals."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.physics.catalogue.spectra import SPECTRA, SpectrumEntry
from tbatch.physics.partition import points

FloatArray = NDArray[np.float64]
Form = Callable[[FloatArray, dict[str, Any]], FloatArray]

_CONTACT_PATCH = 0.012  # m

# Even on a bin that spans a ratio of four this rule integrates the forms here to round-off.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


@dataclass(frozen=True)
class Density:
    """The one-sided density S(f) [m²/(cycle/m)] of a named spectrum, f in cycle/m, with its tail if one is stated."""

    name: str
    """a name of the catalogue"""
    tail: float | None = None
    """n: S ∝ f⁻ⁿ above `tail_from`; None for the formula alone"""
    tail_from: float | None = None
    """where the tail takes over [cycle/m]; None for the spectrum's own"""

    def __post_init__(self) -> None:
        """Check the name and the tail."""
        entry = spectrum_entry(self.name)
        if self.tail is None:
            if self.tail_from is not None:
                raise ValueError(f"tail_from = {self.tail_from!r} is given without tail: give the exponent too, e.g. 3")
            return
        if not (math.isfinite(self.tail) and self.tail >= 0.0):
            raise ValueError(f"tail = {self.tail!r}: accepted is an exponent n >= 0, S ~ f^-n")
        start = entry.default_tail_from if self.tail_from is None else float(self.tail_from)
        if not (math.isfinite(start) and start > 0.0):
            raise ValueError(f"tail_from = {self.tail_from!r}: accepted is a wavenumber above 0 cycle/m")
        object.__setattr__(self, "tail_from", start)

    @property
    def entry(self) -> SpectrumEntry:
        """The spectrum's numbers and source."""
        return SPECTRA[self.name]

    @property
    def breaks(self) -> tuple[float, ...]:
        """Where the density is not smooth [cycle/m]."""
        own = _breaks(self.entry)
        if self.tail is None or self.tail_from is None:
            return own
        return (*(f for f in own if f < self.tail_from), self.tail_from)

    def __call__(self, wavenumber: ArrayLike) -> FloatArray:
        """S(f) [m²/(cycle/m)] at wavenumbers f > 0 [cycle/m], same shape."""
        f = np.asarray(wavenumber, dtype=np.float64)
        if not np.all((f > 0.0) & np.isfinite(f)):
            worst = f[~((f > 0.0) & np.isfinite(f))].flat[0]
            raise ValueError(f"wavenumber = {worst!r}: accepted are finite wavenumbers above 0 cycle/m")
        form, parameters = _FORMS[self.entry.form], self.entry.parameters
        if self.tail is None or self.tail_from is None:
            return form(f, parameters)
        # The formula is never asked beyond the tail's start, where it may mean nothing.
        return form(np.minimum(f, self.tail_from), parameters) * np.maximum(f / self.tail_from, 1.0) ** -self.tail

    def integral(self, edges: FloatArray) -> FloatArray:
        """The variance [m²] between consecutive wavenumbers [cycle/m], shape (edge - 1,), to round-off.

        Bins are split at the density's breaks, and each part takes a Gauss-Legendre rule.
        """
        edges = np.asarray(edges, dtype=np.float64)
        inner = np.array([b for b in self.breaks if edges[0] < b < edges[-1]])
        cuts = np.union1d(edges, inner)
        half = 0.5 * np.diff(cuts)
        f = (cuts[:-1] + half)[:, np.newaxis] + np.multiply.outer(half, _NODES)
        parts = half * (self(f) @ _WEIGHTS)
        return np.add.reduceat(parts, np.searchsorted(cuts, edges[:-1]))

    def variance(self, wavelengths: tuple[float, float]) -> float:
        """The variance [m²] between two wavelengths [m], shortest first."""
        low, high = 1.0 / wavelengths[1], 1.0 / wavelengths[0]
        return float(self.integral(np.geomspace(low, high, 2 + math.ceil(8.0 * math.log(high / low)))).sum())


@lru_cache(maxsize=64)
def wave_amplitudes(density: Density, wavelengths: tuple[float, float], period: float) -> tuple[FloatArray, FloatArray]:
    """Bins of equal width over a band and the amplitudes that carry their variance.

    Args:
        density: S(f).
        wavelengths: the band, shortest first [m].
        period: the bins are at most 1/period wide [m].

    Returns:
        The bins' centres [cycle/m] and a = √(2 ∫ S df) [m], both shape (bin,) and read-only.
    """
    low, high = 1.0 / wavelengths[1], 1.0 / wavelengths[0]
    count = max(1, math.ceil((high - low) * period * (1.0 - 1e-12)))
    width = (high - low) / count
    edges = points(low, width, count)
    centre = edges[:-1] + 0.5 * width
    amplitude = np.sqrt(2.0 * density.integral(edges))
    centre.flags.writeable = False
    amplitude.flags.writeable = False
    return centre, amplitude


def warn_outside_band(density: Density, wavelengths: tuple[float, float]) -> None:
    """Warn where wavelengths, shortest first [m], leave what the spectrum is published for."""
    short, long = wavelengths
    low, high = density.entry.band
    margin = 1.0 + 1e-9
    # With a tail that takes over within the band, short waves follow the stated rule instead of the formula.
    tailed = density.tail_from is not None and density.tail_from * low <= margin
    too_short = short * margin < low and not tailed
    if too_short or long > high * margin:
        hint = "; continue it by tail=n from within the band" if too_short else ""
        warnings.warn(
            f"wavelengths = ({short:g}, {long:g}) m leave the valid band of {density.name},"
            f" {low:g} to {high:g} m{hint}",
            stacklevel=5,
        )
    if short < _CONTACT_PATCH:
        warnings.warn(
            f"wavelengths from {short:g} m: roughness shorter than the contact patch (about {_CONTACT_PATCH:g} m)"
            " needs a contact filter",
            stacklevel=5,
        )


def spectrum_entry(name: str) -> SpectrumEntry:
    """The catalogue's entry of a spectrum, or an error that names those there are."""
    if name not in SPECTRA:
        near = get_close_matches(str(name), SPECTRA, n=1)
        hint = f", did you mean {near[0]!r}" if near else ""
        raise ValueError(f"spectrum = {name!r} is unknown{hint}; accepted are {', '.join(SPECTRA)}")
    return SPECTRA[name]


def _breaks(entry: SpectrumEntry) -> tuple[float, ...]:
    if entry.form == "power-law":
        return tuple(upper for _, _, upper in entry.parameters["parts"][:-1])
    if entry.form == "bands":
        return tuple(_band_table(tuple(entry.parameters["levels"].items()))[0].tolist())
    return ()


def _power_law(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    a, n, upper = np.array(p["parts"]).T
    part = np.searchsorted(upper, f, side="right")
    return 1e-6 * a[part] * f ** -n[part]


def _rational(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    above = f * f + p["B"] * f + p["C"]
    below = (((f + p["D"]) * f + p["E"]) * f + p["F"]) * f + p["G"]
    return 1e-6 * p["A"] * above / below


def _two_pole(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    omega2, c2, r2 = (2.0 * np.pi * f) ** 2, p["Omega_c"] ** 2, p["Omega_r"] ** 2
    return 2.0 * np.pi * p["A"] * c2 / ((omega2 + r2) * (omega2 + c2))


def _fra(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    omega2, c2 = (2.0 * np.pi * f) ** 2, p["Omega_c"] ** 2
    return 2.0 * np.pi * 1e-4 * p["k"] * p["A"] * c2 / (omega2 * (omega2 + c2))


def _fra_1980(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    square = f * f
    return p["A"] * p["f2"] ** 2 * (square + p["f1"] ** 2) / (square * square * (square + p["f2"] ** 2))


def _sncf(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    return p["A"] / (1.0 + f / p["f0"]) ** 3


def _bands(f: FloatArray, p: dict[str, Any]) -> FloatArray:
    edges, density = _band_table(tuple(p["levels"].items()))
    inside = (f >= edges[0] * (1.0 - 1e-12)) & (f <= edges[-1] * (1.0 + 1e-12))
    if not inside.all():
        raise ValueError(
            f"wavenumber = {f[~inside].flat[0]:.6g} cycle/m: the bands reach from {edges[0]:.6g}"
            f" to {edges[-1]:.6g} cycle/m"
        )
    return density[np.clip(np.searchsorted(edges, f, side="right") - 1, 0, density.size - 1)]


@lru_cache
def _band_table(levels: tuple[tuple[str, float], ...]) -> tuple[FloatArray, FloatArray]:
    """Edges [cycle/m] of adjacent third octaves and the density in each [m²/(cycle/m)]."""
    # Nominal wavelengths in cm stand for the exact centres 10^(n/10).
    tenths = np.array([round(10.0 * math.log10(1e-2 * float(centimetres))) for centimetres, _ in levels])
    edges = 10.0 ** (-(np.append(tenths, tenths[-1] - 1) + 0.5) / 10.0)
    variance = 1e-12 * 10.0 ** (np.array([level for _, level in levels]) / 10.0)
    return edges, variance / np.diff(edges)


_FORMS: dict[str, Form] = {
    "power-law": _power_law,
    "rational": _rational,
    "two-pole": _two_pole,
    "fra": _fra,
    "fra-1980": _fra_1980,
    "sncf": _sncf,
    "bands": _bands,
}
