"""Irregularity: the vertical running surface r(x), positive where it is lower (a dip)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tbatch.physics.defects import Flat
from tbatch.physics.endless_waves import EndlessWaves
from tbatch.physics.level import Level, read_level
from tbatch.physics.partition import Piece, extend, overlay
from tbatch.physics.profile import Profile
from tbatch.physics.spectra import Density
from tbatch.physics.terms import Function, FunctionTerm, TaperedTerm, Term, sum_on_grid, sum_terms
from tbatch.physics.waves import Waves

FloatArray = NDArray[np.float64]

_KEPT_PROFILES = 8


@dataclass(frozen=True, eq=False)
class Irregularity:
    """A running surface r(x), a sum of terms; it never changes, and two are equal only if they are one.

    Made by its constructors and by ``+``; a callable r(x) of an array may be a summand.
    """

    terms: tuple[Term, ...] = ()
    """the summands"""
    _profiles: dict[tuple[float, float], Profile] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def zero(cls) -> "Irregularity":
        """A smooth rail."""
        return cls()

    @classmethod
    def spectrum(
        cls,
        name: str,
        *,
        wavelengths: tuple[float, float],
        seed: int = 0,
        sample: int = 0,
        tail: float | None = None,
        tail_from: float | None = None,
        scale: float = 1.0,
        period: float = 1000.0,
        amplitudes: str = "fixed",
    ) -> "Irregularity":
        """A realisation of a published spectrum: r(x) = Σ a_k cos(2π f_k x + φ_k).

        The band is cut into bins of equal width, at most 1/period; f_k is a bin's centre, a_k = √(2 ∫ S df) over the
        bin, so that the variance of the sum is the integral of S, and φ_k is uniform.

        Args:
            name: a spectrum of the catalogue.
            wavelengths: the band, shortest first [m].
            seed: key of the random numbers, with `sample`.
            sample: number of the realisation.
            tail: n for S ∝ f⁻ⁿ from `tail_from` on; None for the formula alone.
            tail_from: where the tail takes over [cycle/m]; None for the spectrum's own.
            scale: multiplies r (the amplitude; the density grows with its square).
            period: the span that all wheels visit must be shorter [m]; inf for a line without end, on which independent
                realisations are blended (`tbatch.physics.endless_waves`).
            amplitudes: "fixed" gives every sample the same variance; "rayleigh" draws a_k from a Rayleigh distribution
                with the same mean square, which makes r Gaussian.
        """
        density = Density(name, tail, tail_from)
        if period == math.inf:
            return cls((EndlessWaves.drawn(density, wavelengths, seed, sample, scale, amplitudes),))
        waves = Waves.drawn(
            density, wavelengths, seed=seed, sample=sample, scale=scale, period=period, amplitudes=amplitudes
        )
        return cls((waves,))

    @classmethod
    def cosines(cls, wavenumber: ArrayLike, amplitude: ArrayLike, phase: ArrayLike = 0.0) -> "Irregularity":
        """Given waves: r(x) = Σ a cos(2π f x + φ).

        Args:
            wavenumber: f [cycle/m], scalar or shape (wave,).
            amplitude: a [m], likewise.
            phase: φ [rad], likewise.
        """
        return cls((Waves.given(wavenumber, amplitude, phase),))

    @classmethod
    def flat(cls, depth: float, length: float, at: float) -> "Irregularity":
        """A rounded wheel flat or dip: r = ½ d (1 - cos 2πs/l) for 0 ≤ s = x - at ≤ l.

        Args:
            depth: d, positive for a dip [m].
            length: l [m].
            at: x where it begins [m].
        """
        return cls((Flat(depth, length, at),))

    @classmethod
    def measured(cls, x: ArrayLike, r: ArrayLike) -> "Irregularity":
        """A measured level: the C² cubic spline through its points, which need not be equidistant.

        It has no value beyond its points.

        Args:
            x: chainage, strictly increasing [m], shape (point,).
            r: level, positive where the rail is lower [m], shape (point,).
        """
        return cls((Level(np.asarray(x, dtype=np.float64), np.asarray(r, dtype=np.float64)),))

    @classmethod
    def measured_file(cls, path: str | Path, *, unit: str = "mm", up: bool = False) -> "Irregularity":
        """A measured level from a text file of two columns, chainage in m and level.

        Args:
            path: the file.
            unit: unit of the level: m, cm, mm, um.
            up: whether the file counts the level positive upwards.
        """
        return cls.measured(*read_level(path, unit=unit, up=up))

    @classmethod
    def of(cls, function: "Irregularity | Function", *, breaks: Sequence[float] = ()) -> "Irregularity":
        """An irregularity from a callable r(x) of an array; one that already is an irregularity is returned as it is.

        Args:
            function: r(x) [m], continuous.
            breaks: where it has kinks or is narrower than 10 mm [m], as far as known.
        """
        if isinstance(function, Irregularity):
            return function
        if not callable(function):
            raise ValueError(f"irregularity = {function!r}: accepted is an Irregularity or a callable r(x) of an array")
        return cls((FunctionTerm(function, tuple(sorted(float(b) for b in breaks))),))

    @staticmethod
    def density(name: str, f: ArrayLike, tail: float | None = None, tail_from: float | None = None) -> FloatArray:
        """The one-sided density S(f) [m²/(cycle/m)] of a spectrum at wavenumbers f [cycle/m], same shape.

        Args:
            name: a spectrum of the catalogue.
            f: wavenumbers above 0 [cycle/m].
            tail: n for S ∝ f⁻ⁿ from `tail_from` on; None for the formula alone.
            tail_from: where the tail takes over [cycle/m]; None for the spectrum's own.
        """
        return Density(name, tail, tail_from)(f)

    def taper(self, start: float, length: float) -> "Irregularity":
        """The same surface faded in: zero up to `start`, C¹ rise (3s² - 2s³) to all of it over `length` [m]."""
        return Irregularity((TaperedTerm(self.terms, start, length),))

    def __add__(self, other: "Irregularity | Function") -> "Irregularity":
        """The sum of two surfaces; the other may be a callable."""
        if not callable(other):
            return NotImplemented
        return Irregularity(self.terms + Irregularity.of(other).terms)

    def __radd__(self, other: "Function | int") -> "Irregularity":
        """A callable plus this surface, and the zero that ``sum`` starts from."""
        if callable(other):
            return Irregularity(Irregularity.of(other).terms + self.terms)
        return self if isinstance(other, int) and other == 0 else NotImplemented

    @property
    def period(self) -> float:
        """The span visited by all wheels must not exceed it [m]; inf where nothing repeats itself."""
        return min((term.period for term in self.terms), default=math.inf)

    @property
    def shortest_wavelength(self) -> float:
        """The shortest wavelength of waves and measured levels [m]; inf where there are none."""
        return min((term.shortest_wavelength for term in self.terms), default=math.inf)

    def __call__(self, x: ArrayLike) -> FloatArray:
        """The exact value r(x) [m], same shape as x."""
        x = np.asarray(x, dtype=np.float64)
        return sum_terms(self.terms, x)[()]

    def profile(self, x_low: float, x_high: float) -> Profile:
        """The piecewise-uniform cubic spline that the engine evaluates between two places [m].

        Its error is at most 1e-9 m for cosines and flats, 1e-8 m for callables and measured levels; waves of a
        spectrum have at least 20 knots each. The last few profiles are kept.
        """
        low, high = float(x_low), float(x_high)
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ValueError(f"x_low, x_high = {x_low!r}, {x_high!r}: accepted are two places in rising order [m]")
        profile = self._profiles.get((low, high))
        if profile is None:
            profile = self.spline(low, high)
            while len(self._profiles) >= _KEPT_PROFILES:
                self._profiles.pop(next(iter(self._profiles)), None)
            self._profiles[low, high] = profile
        return profile

    def spline(self, low: float, high: float) -> Profile:
        """As `profile`, between two places in rising order, and not kept."""
        if not self.terms:
            return Profile.zero()
        if high - low > self.period:
            raise ValueError(
                f"a span of {high - low:.6g} m was asked of an irregularity that repeats itself after"
                f" period = {self.period:g} m: give Irregularity.spectrum a longer period"
            )
        return Profile.from_pieces(self._partition(low, high), partial(sum_on_grid, self.terms))

    def coefficient_count(self, low: float, high: float) -> int:
        """Number of coefficients that the spline between two places has; its values are not computed."""
        return sum(piece.intervals + 3 for piece in self._partition(low, high)) if self.terms else 4

    def _partition(self, low: float, high: float) -> list[Piece]:
        pieces = overlay([term.pieces(low, high) for term in self.terms], low, high)
        return extend(pieces) if all(term.everywhere for term in self.terms) else pieces

    def __reduce__(self) -> tuple[type, tuple[tuple[Term, ...]]]:
        """Pickle the terms, not the kept profiles."""
        return Irregularity, (self.terms,)

    @classmethod
    def chord_flat(cls, *args: object, **options: object) -> NoReturn:
        """A fresh chord flat: not yet."""
        raise _not_yet("chord_flat")

    @classmethod
    def joint(cls, *args: object, **options: object) -> NoReturn:
        """A dipped joint: not yet."""
        raise _not_yet("joint")

    @classmethod
    def weld(cls, *args: object, **options: object) -> NoReturn:
        """A weld: not yet."""
        raise _not_yet("weld")

    @classmethod
    def settlement(cls, *args: object, **options: object) -> NoReturn:
        """A settlement: not yet."""
        raise _not_yet("settlement")

    @classmethod
    def corrugation(cls, *args: object, **options: object) -> NoReturn:
        """Corrugation: not yet."""
        raise _not_yet("corrugation")


def _not_yet(name: str) -> ValueError:
    return ValueError(f"Irregularity.{name} is not yet available: use flat, cosines, measured or a callable r(x)")
