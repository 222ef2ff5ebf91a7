"""The running surface of each sample: the [irregularity] table along the passage of the wheels."""

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tbatch.physics.streams import stream
from tbatch.scenario.errors import Findings, Path
from tbatch.scenario.irregularity import IrregularitySection
from tbatch.scenario.measured import Measured, MeasuredLevel
from tbatch.scenario.passage import Passage

if TYPE_CHECKING:
    from tbatch.physics.irregularity import Irregularity

STEPS_PER_WAVE = 10
"""steps that the shortest wave of a spectrum must take at the highest speed"""

_MOST_KNOTS = 4_000_000
_LAST_STEP = 2.0
"""what no last step exceeds [m]; used instead of it where samples must not depend on step and speed"""
_WINDOW_MARGIN = 24  # points of a measured file beyond a window, so that its ends do not bend the spline within


@dataclass(frozen=True, eq=False)
class Surface:
    """What the samples of a scenario run on."""

    section: IrregularitySection
    passage: Passage
    seed: int
    level: MeasuredLevel | None = None
    endless: bool = False
    """Whether the track is; its surface does not depend on how far a run goes."""

    @property
    def begin(self) -> float:
        """Smallest x where the surface is needed [m]: nothing lies before a taper."""
        return self.passage.start if self.passage.taper > 0.0 else self.passage.low

    @property
    def period(self) -> float:
        """Length after which a realisation of the spectrum may repeat itself [m]; inf on an endless track."""
        if self.endless:
            return math.inf
        span = self.passage.start + self.passage.distance - self.passage.low
        return 10.0 * math.ceil((1.02 * span + _LAST_STEP) / 10.0)

    @property
    def random_length(self) -> float:
        """Length of a stretch of a measured file that is drawn at random [m]."""
        return self.passage.start + self.passage.distance + _LAST_STEP - self.begin

    def sample(self, sample: int) -> "Irregularity":
        """Return the running surface of a sample, which depends on the seed and the sample alone.

        Args:
            sample: Index of the sample, from 0.
        """
        from tbatch.physics.irregularity import Irregularity

        section, parts = self.section, Irregularity.zero()
        if section.spectrum is not None and section.wavelengths is not None:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # said once, when the scenario was read
                parts += Irregularity.spectrum(
                    section.spectrum,
                    wavelengths=(section.wavelengths[0], section.wavelengths[1]),
                    seed=self.seed,
                    sample=sample,
                    tail=section.tail,
                    tail_from=section.tail_from,
                    scale=1.0 if section.scale is None else section.scale,
                    period=self.period,
                    amplitudes=section.amplitudes or "fixed",
                )
        if section.measured is not None and self.level is not None:
            parts += self._window(section.measured, self.level, sample)
        if section.cosines:
            numbers = [(wave.wavenumber or 0.0, wave.amplitude, wave.phase) for wave in section.cosines]
            parts += Irregularity.cosines(*np.array(numbers).T)
        for defect in section.defect:
            parts += Irregularity.flat(defect.depth, defect.length, defect.at)
        if self.passage.taper > 0.0 and parts.terms:
            return parts.taper(self.passage.start, self.passage.taper)
        return parts

    def _window(self, measured: Measured, level: MeasuredLevel, sample: int) -> "Irregularity":
        """Return a stretch of the measured level, shifted to where the wheels run."""
        from tbatch.physics.irregularity import Irregularity

        if measured.window == "random":
            share = stream(self.seed, sample, "irregularity/measured/window").random()
            shift = level.x[0] + share * (level.x[-1] - level.x[0] - self.random_length) - self.begin
        else:
            shift = measured.window - self.passage.start
        low, high = np.searchsorted(level.x, (self.begin + shift, self.passage.high + shift))
        inside = slice(max(0, int(low) - _WINDOW_MARGIN), int(high) + _WINDOW_MARGIN)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a level that is rough between its points was reported when it was read
            return Irregularity.measured(level.x[inside] - shift, level.r[inside])


def check_surface(surface: Surface, fastest: float, step: float, findings: Findings) -> None:
    """Check that steps and memory can follow the surface and that a measured file is long enough.

    Args:
        surface: The running surface.
        fastest: Highest speed [m/s].
        step: Time step [s].
        findings: Takes what does not fit.
    """
    section, passage = surface.section, surface.passage
    shortest = STEPS_PER_WAVE * fastest * step
    for path, wavelength in _waves(section):
        if wavelength < shortest * (1.0 - 1e-9):
            longest_step = wavelength / fastest / STEPS_PER_WAVE
            findings.refuse(
                path,
                f"is a wave that {3.6 * fastest:g} km/h runs over in less than {STEPS_PER_WAVE} steps",
                value=wavelength,
                accepted=f"{shortest:.4g} m and longer, or integration.step up to {longest_step:.3g} s",
            )
    span = passage.high - passage.low
    # The surface of an endless track is made piece by piece.
    held = 0.0 if surface.endless else span
    if section.wavelengths is not None and (knots := 20.0 * held / section.wavelengths[0]) > _MOST_KNOTS:
        findings.refuse(
            ("irregularity", "wavelengths", 0),
            f"needs {knots:.3g} points along the line",
            value=section.wavelengths[0],
            accepted=f"{20.0 * span / _MOST_KNOTS:.3g} m and longer on this line",
        )
    for index, defect in enumerate(section.defect):
        if not surface.begin - defect.length <= defect.at <= passage.high:
            where = f"x = {surface.begin:g} to {passage.high:g} m"
            findings.warn(f"irregularity.defect[{index}].at: no wheel meets it; they run on {where}")
    if surface.level is not None and section.measured is not None:
        _check_window(surface, section.measured, surface.level, findings)
    if section != IrregularitySection() and passage.taper > passage.evaluate_from:
        findings.warn("run.evaluate_from: statistics begin before the irregularity has faded in over run.taper")


def _waves(section: IrregularitySection) -> list[tuple[Path, float]]:
    """Return each place in the table that sets a wavelength, with the shortest wavelength [m]."""
    waves: list[tuple[Path, float]] = []
    if section.wavelengths is not None:
        waves.append((("irregularity", "wavelengths", 0), section.wavelengths[0]))
    for index, wave in enumerate(section.cosines):
        if wave.wavenumber:
            waves.append((("irregularity", "cosines", index), 1.0 / wave.wavenumber))
    return waves


def _check_window(surface: Surface, measured: Measured, level: MeasuredLevel, findings: Findings) -> None:
    passage, begin = surface.passage, surface.begin
    first, last = float(level.x[0]), float(level.x[-1])
    random = measured.window == "random"
    length = surface.random_length if random else passage.high - begin
    if last - first < length:
        findings.refuse(
            ("irregularity", "measured", "file"),
            f"reaches over {last - first:.6g} m only",
            value=measured.file,
            accepted=f"a file over at least {length:.6g} m, or a shorter run.distance",
        )
        return
    low, high = first + passage.start - begin, last + passage.start - passage.high
    if not random and not low <= measured.window <= high:
        findings.refuse(
            ("irregularity", "measured", "window"),
            f"leaves the file, which reaches from {first:.6g} to {last:.6g} m",
            value=measured.window,
            accepted=f'{low:.6g} to {high:.6g} m, or "random"',
        )
