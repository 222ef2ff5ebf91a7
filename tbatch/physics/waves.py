"""Waves: sums of cosines, r(x) = Σ a cos(2π f x + φ), given one by one or drawn from a spectrum."""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from tbatch.physics.defects import wave_spacing
from tbatch.physics.partition import Piece, points
from tbatch.physics.spectra import Density, warn_outside_band, wave_amplitudes
from tbatch.physics.streams import stream

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

KNOTS_PER_WAVE = 20  # of the shortest wave of a spectrum: its curvature is then 0.8 % off
_BLOCK = 1 << 20  # cosines evaluated at once, so that memory stays bounded
_FEW = 64  # as many cosines as are summed directly faster than by the transform


@dataclass(frozen=True, eq=False)
class Waves:
    """A sum of cosines."""

    wavenumber: FloatArray
    """f [cycle/m], shape (wave,)"""
    amplitude: FloatArray
    """a [m], shape (wave,)"""
    phase: FloatArray
    """φ [rad], shape (wave,)"""
    spacing: float
    """the largest distance between knots that resolves the sum [m]; inf for a constant"""
    period: float = math.inf
    """length after which a realisation of a spectrum repeats itself [m]"""
    everywhere = True
    _complex: ComplexArray = field(init=False, repr=False)
    _step: float | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Prepare the complex amplitudes a exp(iφ) and the common difference of the wavenumbers."""
        object.__setattr__(self, "_complex", self.amplitude * np.exp(1j * self.phase))
        object.__setattr__(self, "_step", _common_step(self.wavenumber))

    @classmethod
    def given(cls, wavenumber: ArrayLike, amplitude: ArrayLike, phase: ArrayLike) -> "Waves":
        """Waves given one by one: f [cycle/m], a [m] and φ [rad], scalars or vectors of one length."""
        given = [np.atleast_1d(np.asarray(value, dtype=np.float64)) for value in (wavenumber, amplitude, phase)]
        shapes = ", ".join(str(value.shape) for value in given)
        try:
            f, a, p = (value.copy() for value in np.broadcast_arrays(*given))
        except ValueError:
            raise ValueError(f"wavenumber, amplitude, phase have unequal shapes {shapes}") from None
        if f.ndim != 1:
            raise ValueError(f"wavenumber, amplitude, phase have shapes {shapes}: accepted are scalars and vectors")
        for name, value, unit in (("wavenumber", f, "cycle/m"), ("amplitude", a, "m"), ("phase", p, "rad")):
            if not np.isfinite(value).all():
                place = int(np.flatnonzero(~np.isfinite(value))[0])
                raise ValueError(f"{name}[{place}] = {value[place]}: accepted are finite numbers [{unit}]")
            value.flags.writeable = False
        if f.min(initial=0.0) < 0.0:
            raise ValueError(f"wavenumber = {f.min():g}: accepted are wavenumbers of 0 cycle/m and above")
        # Each wave's error grows with f⁴: together they are at most as wrong as one wave of f = 1 and Σ |a| f⁴.
        spacing = wave_spacing(1.0, float(np.sum(np.abs(a) * f**4)))
        highest = float(f.max(initial=0.0))
        return cls(f, a, p, min(spacing, 1.0 / (40.0 * highest)) if highest > 0.0 else math.inf)

    @classmethod
    def drawn(
        cls,
        density: Density,
        wavelengths: tuple[float, float],
        *,
        seed: int,
        sample: int,
        scale: float,
        period: float,
        amplitudes: str,
    ) -> "Waves":
        """A realisation of a density; the arguments are those of ``Irregularity.spectrum``."""
        short, long = checked_band(density, wavelengths, scale, amplitudes)
        if not (math.isfinite(period) and period > 0.0):
            raise ValueError(f"period = {period!r}: accepted is a length above 0 m, inf for a line without end")
        return cls.realised(
            density, (short, long), f"irregularity/{density.name}",
            seed=seed, sample=sample, scale=scale, period=float(period), amplitudes=amplitudes,
        )  # fmt: skip

    @classmethod
    def realised(
        cls,
        density: Density,
        band: tuple[float, float],
        name: str,
        *,
        seed: int,
        sample: int,
        scale: float,
        period: float,
        amplitudes: str,
    ) -> "Waves":
        """A realisation with the random numbers of a name; what is given has been checked.

        Args:
            density: S(f).
            band: shortest and longest wavelength [m].
            name: begins the names of the streams of random numbers.
            seed: key of the random numbers, with `sample`.
            sample: number of the realisation.
            scale: multiplies r.
            period: the bins are at most 1/period wide [m].
            amplitudes: "fixed" or "rayleigh".
        """
        wavenumber, amplitude = wave_amplitudes(density, band, period)
        amplitude = scale * amplitude
        phase = (2.0 * np.pi) * stream(seed, sample, f"{name}/phase").random(wavenumber.size)
        if amplitudes == "rayleigh":
            uniform = stream(seed, sample, f"{name}/amplitude").random(wavenumber.size)
            amplitude = amplitude * np.sqrt(-np.log1p(-uniform))
        for value in (amplitude, phase):
            value.flags.writeable = False
        return cls(wavenumber, amplitude, phase, spacing=band[0] / KNOTS_PER_WAVE, period=period)

    @property
    def shortest_wavelength(self) -> float:
        """The shortest wavelength [m], inf for a constant."""
        highest = float(np.max(self.wavenumber, initial=0.0))
        return 1.0 / highest if highest > 0.0 else math.inf

    def __call__(self, x: FloatArray) -> FloatArray:
        """The sum at any points [m], each cosine evaluated."""
        flat = x.ravel()
        value = np.empty_like(flat)
        rows = max(1, _BLOCK // max(1, self.wavenumber.size))
        for i in range(0, flat.size, rows):
            angle = np.multiply.outer(flat[i : i + rows], 2.0 * np.pi * self.wavenumber) + self.phase
            value[i : i + rows] = np.cos(angle, out=angle) @ self.amplitude
        return value.reshape(x.shape)

    def pieces(self, low: float, high: float) -> list[Piece]:
        """One piece: cosines are smooth."""
        return [Piece(low, high, self.spacing)]

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The sum at ``low + width * j``, j = 0 ... count [m].

        Equidistant wavenumbers go through Bluestein's chirp transform: it takes any first point, any spacing and any
        first wavenumber, so the grid need not be tied to the period.
        """
        step = self._step
        if step is None:
            return self(points(low, width, count))
        # r_j = Re Σ_k A_k e(f_k x_j), e(t) = exp(2πi t), x_j = low + j·width, f_k = f_0 + k·step; with
        # k·j = (k² + j² - (j - k)²)/2 the sum over k is a convolution with the chirp e(-step·width·m²/2).
        f_0 = float(self.wavenumber[0])
        waves, nodes = self.wavenumber.size, count + 1
        chirp = step * width
        k, j = np.arange(waves, dtype=np.float64), np.arange(nodes, dtype=np.float64)
        size, kernel = _chirp_kernel(waves, nodes, chirp)
        weighted = self._complex * _turn(k * (step * low) + 0.5 * chirp * (k * k))
        summed = scipy.fft.ifft(scipy.fft.fft(weighted, size) * kernel)[waves - 1 : waves - 1 + nodes]
        return (summed * _turn(f_0 * low + j * (f_0 * width) + 0.5 * chirp * (j * j))).real


def checked_band(
    density: Density, wavelengths: tuple[float, float], scale: float, amplitudes: str
) -> tuple[float, float]:
    """The band of a realisation as numbers, shortest wavelength first [m]; refuses what no realisation can have."""
    try:
        short, long = (float(value) for value in wavelengths)
    except (TypeError, ValueError):
        raise ValueError(f"wavelengths = {wavelengths!r}: accepted are two lengths [m], shortest first") from None
    if not 0.0 < short < long < math.inf:
        raise ValueError(f"wavelengths = {wavelengths!r}: accepted are two lengths above 0 m, shortest first")
    if not (math.isfinite(scale) and scale >= 0.0):
        raise ValueError(f"scale = {scale!r}: accepted is a factor of the amplitude, 0 or above")
    if amplitudes not in ("fixed", "rayleigh"):
        raise ValueError(f"amplitudes = {amplitudes!r}: accepted are 'fixed' and 'rayleigh'")
    warn_outside_band(density, (short, long))
    return short, long


def _common_step(wavenumber: FloatArray) -> float | None:
    """The common difference of the wavenumbers [cycle/m], None where they are few or not equidistant."""
    count = wavenumber.size
    if count < _FEW:
        return None
    step = float(wavenumber[-1] - wavenumber[0]) / (count - 1)
    miss = wavenumber - (wavenumber[0] + step * np.arange(count))
    # What rounding leaves, as from arange or linspace: at 10 km the phase is then wrong by 1e-11 of a turn at most.
    return step if step > 0.0 and np.max(np.abs(miss)) <= 4e-16 * np.abs(wavenumber).max() else None


def _turn(cycles: FloatArray) -> ComplexArray:
    """exp(2πi cycles)."""
    return np.exp((2j * np.pi) * (cycles - np.rint(cycles)))


@lru_cache(maxsize=16)
def _chirp_kernel(waves: int, nodes: int, chirp: float) -> tuple[int, ComplexArray]:
    """The transform of e(-chirp m²/2), m = 1 - waves ... nodes - 1, and its length."""
    size = scipy.fft.next_fast_len(waves + nodes - 1)  # what wraps around falls on points nobody reads
    m = np.arange(1 - waves, nodes, dtype=np.float64)
    return size, scipy.fft.fft(_turn(-0.5 * chirp * (m * m)), size)
