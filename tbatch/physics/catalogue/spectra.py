"""Published spectra of vertical rail irregularity, data only: the formulas are in ``tbatch.physics.spectra``.

S is one-sided. A spectrum's parameters keep the units of its source; the unit is named with the form. `band` is the
range of wavelengths for which the spectrum holds [m]; `tail_from` is where a tail takes over unless told otherwise
[cycle/m].
"""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class SpectrumEntry:
    """One spectrum: which formula, its numbers, where it holds and who published it."""

    form: str
    parameters: dict[str, Any] = field(repr=False)
    band: tuple[float, float]
    source: str
    tail_from: float | None = None
    note: str = ""

    @property
    def default_tail_from(self) -> float:
        """Where a tail takes over unless told otherwise [cycle/m]: by default at the shortest valid wavelength."""
        return self.tail_from if self.tail_from is not None else 1.0 / self.band[0]


def _trunk_line(a: float, b: float, c: float, d: float, e: float, f: float, g: float, rail: str) -> SpectrumEntry:
    return SpectrumEntry(
        form="rational",  # A (f² + B f + C) / (f⁴ + D f³ + E f² + F f + G), mm²/(1/m)
        parameters={"A": a, "B": b, "C": c, "D": d, "E": e, "F": f, "G": g},
        band=(1.0, 50.0),
        tail_from=0.8,
        source=f"Chinese trunk lines, 200 km/h, vertical, {rail} rail; China Academy of Railway Sciences, 1999",
        note="the formula turns up above 0.83 cycle/m: continue it by a tail below 1.25 m",
    )


def _german(quality: str, a: float) -> SpectrumEntry:
    return SpectrumEntry(
        form="two-pole",  # A Ωc² / ((Ω² + Ωr²)(Ω² + Ωc²)), m²/(rad/m)
        parameters={"A": a, "Omega_c": 0.8246, "Omega_r": 0.0206},
        band=(1.0, 80.0),
        source=f"German railways, {quality} disturbance, vertical; Claus and Schiehlen, Veh. Syst. Dyn. 29 S1, 1998",
        note="no band is published with the formula: 1-80 m is what is commonly simulated with it",
    )


_ISO3095 = {  # wavelength in cm of the third-octave band: level in dB re 1 µm rms
    "40": 17.1, "31.5": 15.0, "25": 13.0, "20": 11.0, "16": 9.0, "12.5": 7.0, "10": 4.9, "8": 2.9, "6.3": 0.9,
    "5": -1.1, "4": -3.2, "3.15": -5.0, "2.5": -5.6, "2": -6.2, "1.6": -6.8, "1.25": -7.4, "1": -8.0, "0.8": -8.6,
    "0.63": -9.2, "0.5": -9.8, "0.4": -10.4, "0.315": -11.0,
}  # fmt: skip

_FRA_NOTE = "classes 1 to 5 belong to slow lines: at high speed their response is not physical"

SPECTRA: dict[str, SpectrumEntry] = {
    "china-ballastless": SpectrumEntry(
        form="power-law",  # A / fⁿ, mm²/(1/m): (A, n, up to f in cycle/m)
        parameters={
            "parts": (
                (1.0544e-5, 3.3891, 0.0187),
                (3.5588e-3, 1.9271, 0.0474),
                (1.9784e-2, 1.3643, 0.1533),
                (3.9488e-4, 3.4516, float("inf")),
            )
        },
        band=(2.0, 200.0),
        source="Chinese ballastless high-speed lines, vertical, mean; TB/T 3352-2014",
        note="the p-th percentile is the mean times -ln(1 - p)",
    ),
    "china-trunk-line": _trunk_line(1.1029, -1.4709, 0.5941, 0.8480, 3.8016, -0.2500, 0.0112, "left"),
    "china-trunk-line-right": _trunk_line(0.8581, -1.4607, 0.5848, 0.0407, 2.8428, -0.1989, 0.0094, "right"),
    "german-low": _german("low", 4.032e-7),
    "german-high": _german("high", 10.80e-7),
    **{
        f"fra-{grade}": SpectrumEntry(
            form="fra",  # k A Ωc² / (Ω² (Ω² + Ωc²)), cm²/(rad/m)
            parameters={"k": 0.25, "A": a, "Omega_c": 0.8245},
            band=(1.524, 304.8),
            source=f"Federal Railroad Administration (USA), line class {grade}, vertical",
            note=_FRA_NOTE if grade < 6 else "",
        )
        for grade, a in enumerate((1.2107, 1.0181, 0.6816, 0.5376, 0.2095, 0.0339), start=1)
    },
    **{
        f"fra-1980-{grade}": SpectrumEntry(
            form="fra-1980",  # A f2² (f² + f1²) / (f⁴ (f² + f2²)), m²/(cycle/m)
            parameters={"A": a * 1e-7, "f1": 0.0233, "f2": 0.1312},
            band=(1.524, 304.8),
            source=f"Federal Railroad Administration (USA), form of report FRA/ORD-80, line class {grade}, vertical",
            note="the band is that of the fra-1 ... fra-6 forms" + (f"; {_FRA_NOTE}" if grade < 6 else ""),
        )
        for grade, a in enumerate((16.7217, 9.5250, 5.2917, 2.9633, 1.6722, 0.9525), start=1)
    },
    **{
        f"sncf-{quality}": SpectrumEntry(
            form="sncf",  # A / (1 + f/f0)³, m²/(cycle/m)
            parameters={"A": 308e-6 * factor, "f0": 0.0489},
            band=(2.0, 40.0),
            source=f"French railways (SNCF), {quality} track, vertical",
        )
        for quality, factor in (("good", 0.509), ("poor", 1.790))
    },
    "iso3095": SpectrumEntry(
        form="bands",  # third-octave levels
        parameters={"levels": _ISO3095},
        band=(10 ** (-2.5 - 0.05), 10 ** (-0.4 + 0.05)),
        source="limit of the rail's acoustic roughness, ISO 3095:2013",
        note="below 12 mm of wavelength the contact patch filters roughness: a contact filter is needed",
    ),
}
