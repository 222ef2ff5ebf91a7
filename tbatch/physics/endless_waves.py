"""EndlessWaves: a realisation of a spectrum on a line without end, whose parts cost the same wherever they are.

Cosines alone cannot do this: a sum that does not repeat itself within a line needs more of them the longer the line
is. So independent realisations ρ₀, ρ₁, ... are blended. Within cell k, from kL to (k + 1)L,

    r(x) = cos θ ρ_k(x) + sin θ ρ_{k+1}(x),   θ = (π/2)(3s² - 2s³),   s = (x - kL)/L.

The squares of the weights add up to one, so the variance is that of the spectrum at every place, and the correlation
of two places a distance d apart is the spectrum's times the cosine of the difference of their θ, which differs from
one by 1.5 (d/L)² on the average. In wavenumbers that is a blur of 0.27/L (standard deviation). Each ρ is needed over
2L only, which is its period.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbatch.physics.partition import Piece, points
from tbatch.physics.spectra import Density
from tbatch.physics.waves import KNOTS_PER_WAVE, Waves, checked_band

FloatArray = NDArray[np.float64]

CELLS_PER_WAVE = 10.0
"""a cell holds at least as many of the longest waves; the blur then adds 0.5 % to a density that falls as f⁻³ there"""
CELL_UNIT = 256.0
"""cells are whole multiples of this [m]"""


@dataclass(frozen=True, eq=False)
class EndlessWaves:
    """Independent realisations of one spectrum, blended; a function of seed, sample and place alone."""

    density: Density
    """S(f)"""
    band: tuple[float, float]
    """shortest and longest wavelength [m]"""
    seed: int
    """key of the random numbers, with `sample`"""
    sample: int
    """number of the realisation"""
    scale: float
    """factor of the amplitude"""
    amplitudes: str
    """fixed or rayleigh"""
    period = math.inf
    everywhere = True

    @classmethod
    def drawn(
        cls,
        density: Density,
        wavelengths: tuple[float, float],
        seed: int,
        sample: int,
        scale: float,
        amplitudes: str,
    ) -> "EndlessWaves":
        """A realisation; the arguments are those of ``Irregularity.spectrum``."""
        band = checked_band(density, wavelengths, scale, amplitudes)
        return cls(density, band, seed, sample, scale, amplitudes)

    @property
    def cell(self) -> float:
        """Length L of a cell [m]."""
        return CELL_UNIT * math.ceil(CELLS_PER_WAVE * self.band[1] / CELL_UNIT)

    @property
    def shortest_wavelength(self) -> float:
        """The shortest wavelength [m]."""
        return self.band[0]

    def realisation(self, place: int) -> Waves:
        """ρ of a place; made when it is asked for, so that a line takes no more memory the longer it is."""
        return Waves.realised(
            self.density, self.band, f"irregularity/{self.density.name}/cell/{place}",
            seed=self.seed, sample=self.sample, scale=self.scale, period=2.0 * self.cell, amplitudes=self.amplitudes,
        )  # fmt: skip

    def __call__(self, x: FloatArray) -> FloatArray:
        """The value at any points [m]."""
        flat = x.ravel()
        value = np.empty_like(flat)
        cells = np.floor(flat / self.cell)
        for cell in np.unique(cells):
            inside = cells == cell
            near, far = (self.realisation(int(cell) + side)(flat[inside]) for side in (0, 1))
            value[inside] = self._blend(int(cell), flat[inside], near, far)
        return value.reshape(x.shape)

    def pieces(self, low: float, high: float) -> list[Piece]:
        """One piece: cosines are smooth, and so are their weights, which change over hundreds of metres."""
        return [Piece(low, high, self.band[0] / KNOTS_PER_WAVE)]

    def on_grid(self, low: float, width: float, count: int) -> FloatArray:
        """The value at ``low + width * j``, j = 0 ... count [m]."""
        x = points(low, width, count)
        cells = np.floor(x / self.cell)
        value = np.empty(count + 1)
        for cell in range(int(cells[0]), int(cells[-1]) + 1):
            first, last = np.searchsorted(cells, (cell, cell + 1))
            if first == last:
                continue
            part = slice(int(first), int(last))
            near, far = (
                self.realisation(cell + side).on_grid(float(x[first]), width, int(last - first) - 1) for side in (0, 1)
            )
            value[part] = self._blend(cell, x[part], near, far)
        return value

    def _blend(self, cell: int, x: FloatArray, near: FloatArray, far: FloatArray) -> FloatArray:
        s = x / self.cell - cell
        angle = (0.5 * np.pi) * (s * s * (3.0 - 2.0 * s))
        return np.cos(angle) * near + np.sin(angle) * far
