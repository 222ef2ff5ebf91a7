"""Published tracks and rails."""

from tbatch.physics.slab import SlabParameters
from tbatch.physics.winkler import WinklerParameters

CHN60 = (2.059e11 * 3.217e-5, 60.64)
"""one CHN60 rail: (EI [N m2], mass [kg/m])"""
UIC60 = (2.1e11 * 3.055e-5, 7850.0 * 7.69e-3)
"""one UIC60 rail: (EI [N m2], mass [kg/m])"""


def _slab_section(E: float, width: float, height: float, density: float) -> tuple[float, float]:
    """Return (EI, mass per metre) of a rectangular section."""
    return E * width * height**3 / 12.0, density * width * height


SLAB_TRACKS: dict[str, SlabParameters] = {
    "seed-slab": SlabParameters(
        bay=0.65,
        rail=(2.0 * CHN60[0], 2.0 * CHN60[1]),
        fastener=(2.0 * 60e6, 2.0 * 47.7e3),
        slab=_slab_section(39e9, 2.55, 0.20, 2500.0),
        mortar=(900e6, 83e3),
        base=_slab_section(30e9, 2.95, 0.30, 2500.0),
        subgrade=(60e6, 90e3),
        per="fastener",
        source="Shock and Vibration 2019, 1212069, Table 2, fastener doubled; rail, not in the table, two CHN60",
    ),
}
"""three-layer slab tracks by name"""

WINKLER_TRACKS: dict[str, WinklerParameters] = {
    "koh-winkler": WinklerParameters(
        EI=2.0e11 * 3.06e-5,
        mass=60.0,
        stiffness=1.0e7,
        damping=4.9e3,
        source="Koh et al. 2003, moving element method, one rail",
    ),
}
"""beams on a continuous bed by name"""
