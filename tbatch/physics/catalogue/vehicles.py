"""Published vehicles. Numbers are whole-coach ones, both sides summed, k and c per axle and per bogie."""

from tbatch.physics.coach import CoachParameters
from tbatch.physics.column import ColumnParameters

_ZHAI = "Zhai, Vehicle-Track Coupled Dynamics, appendix"
_SEED = "Shock and Vibration 2019, 1212069, Table 2, both sides summed; wheel radius not in the table"


def _coach(
    masses: tuple[float, float, float, float, float],
    primary: tuple[float, float],
    secondary: tuple[float, float],
    half_distances: tuple[float, float],
    wheel_radius: float,
    source: str,
) -> CoachParameters:
    """Return a set from the columns of the usual table: (Mc, Jc, Mt, Jt, Mw), (kp, cp), (ks, cs), (lc, lt), r."""
    return CoachParameters(*masses, primary, secondary, *half_distances, wheel_radius, source=source)


COACHES: dict[str, CoachParameters] = {
    "seed-multiwheel": _coach(
        (40000.0, 1.5e6, 3000.0, 8000.0, 2000.0), (1.6e6, 40e3), (0.40e6, 60e3), (8.75, 1.25), 0.4575, _SEED
    ),
    "zhai-high-speed": _coach(
        (34000.0, 2.277e6, 3000.0, 2710.0, 1400.0), (1.10e6, 12e3), (0.80e6, 160e3), (9.0, 1.2), 0.4575, _ZHAI
    ),
    "zhai-double-deck": _coach(
        (29600.0, 2.139e6, 1700.0, 1700.0, 1900.0), (1.746e6, 60e3), (0.82e6, 217.4e3), (9.0, 1.2), 0.4575, _ZHAI
    ),
    "zhai-ordinary": _coach(
        (40560.0, 2.966e6, 3175.0, 2710.0, 1900.0), (1.61e6, 40e3), (0.618e6, 80e3), (9.0, 1.25), 0.4575, _ZHAI
    ),
    "china-star-power-car": _coach(
        (59364.2, 1.723e6, 5630.8, 9487.0, 1843.5), (4.7992e6, 60e3), (1.7716e6, 90e3), (5.73, 1.5), 0.525, _ZHAI
    ),
    "manchester": _coach(
        (32000.0, 1.97e6, 2615.0, 1476.0, 1813.0),
        (2.4e6, 8e3),
        (0.86e6, 40e3),
        (9.5, 1.28),
        0.46,
        "Iwnicki 1998, Manchester benchmarks; wheel radius typical, not from the source",
    ),
    "ice3-velaro": _coach(
        (47800.0, 1.957888e6, 3500.0, 1715.0, 1800.0),
        (2.4e6, 20e3),
        (0.70e6, 40e3),
        (8.6875, 1.25),
        0.46,
        "Goicolea 2014; wheel radius typical, not from the source",
    ),
    "shinkansen-300": _coach(
        (41750.0, 2.08e6, 3040.0, 3930.0, 1780.0),
        (1.18e6, 39.2e3),
        (0.53e6, 90.2e3),
        (8.75, 1.25),
        0.43,
        "Wu & Yang 2003; wheel radius typical, not from the source",
    ),
}
"""10-dof coaches by name"""

COLUMNS: dict[str, ColumnParameters] = {
    "koh-column": ColumnParameters(
        carbody_mass=3500.0,
        bogie_mass=250.0,
        wheel_mass=350.0,
        secondary=(1.41e5, 8.87e3),
        primary=(1.26e6, 7.1e3),
        wheel_radius=0.4575,
        source="Koh et al. 2003, moving element method, half model; wheel radius typical, not from the source",
    ),
}
"""3-dof columns by name"""
