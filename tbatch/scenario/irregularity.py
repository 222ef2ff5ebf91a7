"""The [irregularity] table: what a user may write, completed."""

import warnings
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from tbatch.physics.catalogue.spectra import SPECTRA
from tbatch.physics.spectra import Density, warn_outside_band
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Quantity, Word, refuse
from tbatch.scenario.measured import Measured
from tbatch.scenario.section import Section

_WAVELENGTH = Quantity("m", 1e-3, 1e4)
_AMPLITUDE = Quantity("m", -0.1, 0.1)
_WITH_SPECTRUM = ("wavelengths", "tail", "tail_from", "scale", "amplitudes")


def _rising(wavelengths: tuple[float, ...] | None) -> tuple[float, ...] | None:
    if wavelengths is not None and not wavelengths[0] < wavelengths[1]:
        refuse("does not rise", "the shortest wavelength, then the longest")
    return wavelengths


class Cosine(Section):
    """One wave a cos(2π f x + φ), by its wavenumber or its wavelength."""

    wavenumber: Annotated[float | None, Quantity("1/m", 0.0, 1e3)] = None
    """f [cycle/m]."""
    wavelength: Annotated[float | None, _WAVELENGTH] = None
    """1/f [m]."""
    amplitude: Annotated[float, _AMPLITUDE]
    """a [m]."""
    phase: Annotated[float, Quantity("rad", -1e3, 1e3)] = 0.0
    """φ [rad]."""


class Defect(Section):
    """A local defect of the running surface."""

    kind: Annotated[str, Word(("flat",))]
    """The rounded flat or dip, r = ½ d (1 - cos 2πs/l)."""
    at: Annotated[float, Quantity("m", 0.0, 20e3)]
    """x where it begins [m]."""
    depth: Annotated[float, _AMPLITUDE]
    """d, positive for a dip [m]."""
    length: Annotated[float, Quantity("m", 1e-3, 1e3)]
    """l [m]."""


class IrregularitySection(Section):
    """The running surface: a sum of what is given; smooth if nothing is."""

    spectrum: Annotated[str | None, Word(tuple(SPECTRA))] = None
    """A spectrum of the catalogue; each sample is a realisation of it."""
    wavelengths: Annotated[
        tuple[Annotated[float, _WAVELENGTH], ...] | None, Field(min_length=2, max_length=2), AfterValidator(_rising)
    ] = None
    """Band of the spectrum, shortest and longest wavelength [m]."""
    tail: Annotated[float | None, Quantity("", 0.0, 20.0)] = None
    """n: the spectrum continues as S ~ f^-n to short waves; the formula alone by default."""
    tail_from: Annotated[float | None, Quantity("1/m", 1e-4, 1e3)] = None
    """Where the tail takes over [cycle/m]; the spectrum's own place by default."""
    scale: Annotated[float | None, Quantity("", 0.0, 1e3)] = None
    """Factor of the amplitudes, 1 by default."""
    amplitudes: Annotated[str | None, Word(("fixed", "rayleigh"))] = None
    """Whether all samples have the same variance, "fixed" (default), or Rayleigh-distributed amplitudes."""
    measured: Measured | None = None
    """A measured level."""
    cosines: Annotated[tuple[Cosine, ...], Field(max_length=10_000)] = ()
    """Single waves, the same in every sample."""
    defect: Annotated[tuple[Defect, ...], Field(max_length=10_000)] = ()
    """Local defects, the same in every sample."""

    @property
    def density(self) -> Density | None:
        """Density of the spectrum, None without one."""
        return None if self.spectrum is None else Density(self.spectrum, self.tail, self.tail_from)

    @property
    def is_random(self) -> bool:
        """Whether samples differ."""
        return self.spectrum is not None or (self.measured is not None and self.measured.window == "random")


def complete_irregularity(section: IrregularitySection, findings: Findings) -> IrregularitySection:
    """Return the table with all numbers of its spectrum and its waves.

    Args:
        section: The table as read.
        findings: Takes keys that are missing or contradict one another.
    """
    waves = []
    for index, wave in enumerate(section.cosines):
        path = ("irregularity", "cosines", index)
        if (wave.wavenumber is None) == (wave.wavelength is None):
            message = "has neither wavenumber nor wavelength" if wave.wavenumber is None else "has both"
            findings.refuse(path, message, accepted="either wavenumber [cycle/m] or wavelength [m]")
        elif wave.wavelength is not None:
            wave = wave.model_copy(update={"wavenumber": 1.0 / wave.wavelength, "wavelength": None})
        waves.append(wave)
    section = section.model_copy(update={"cosines": tuple(waves)})
    if section.spectrum is None:
        for name in _WITH_SPECTRUM:
            if getattr(section, name) is not None:
                names = ", ".join(SPECTRA)
                findings.refuse(("irregularity", name), "has no effect without irregularity.spectrum", accepted=names)
        return section
    if section.tail_from is not None and section.tail is None:
        findings.refuse(
            ("irregularity", "tail_from"),
            "has no effect without irregularity.tail",
            value=section.tail_from,
            accepted="beside tail, such as tail = 3",
        )
        return section
    density = section.density
    assert density is not None
    if section.wavelengths is None:
        low, high = density.entry.band
        accepted = f'two lengths, such as ["{low:g} m", "{high:g} m"], the band the spectrum is published for'
        findings.refuse(("irregularity", "wavelengths"), "is missing", accepted=accepted)
        return section
    _check_band(density, section.wavelengths, findings)
    update: dict[str, Any] = {
        "tail_from": density.tail_from,
        "scale": 1.0 if section.scale is None else section.scale,
        "amplitudes": section.amplitudes or "fixed",
    }
    return section.model_copy(update=update)


def _check_band(density: Density, wavelengths: tuple[float, ...], findings: Findings) -> None:
    band = (wavelengths[0], wavelengths[1])
    try:
        variance = density.variance(band)
    except ValueError as error:
        low, high = density.entry.band
        message = f'leaves the band of "{density.name}", which has no value there ({error})'
        findings.refuse(("irregularity", "wavelengths"), message, accepted=f"{low:g} to {high:g} m")
        return
    if not 0.0 < variance < 1.0:
        message = f"gives a spectrum of {variance:.3g} m2 variance"
        findings.refuse(("irregularity", "wavelengths"), message, accepted="a band with a variance below 1 m2")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_outside_band(density, band)
    for warning in caught:
        findings.warn(f"irregularity: {warning.message}")
    if density.entry.note and "high speed" in density.entry.note:
        findings.warn(f"irregularity.spectrum: {density.name}: {density.entry.note}")
