"""Deflection of the track at any place and sample, from fixed places that are seldom saved."""

from __future__ import annotations

import numpy as np

from tbatch.view.record import Array, RunRecord
from tbatch.view.thinning import Samples


def under_wheels(record: RunRecord, samples: Samples, layer: str = "rail") -> Array | None:
    """Deflection of a layer under each wheel [m], shape (sample, wheel): given, or interpolated from the fixed places.

    Args:
        record: The run.
        samples: Samples asked for.
        layer: "rail", "slab" or "base".

    Returns:
        None where it is not known.
    """
    given = getattr(record, f"{layer}_under_wheel", None)
    if given is not None:
        return np.asarray(given)[samples]
    values = getattr(record, layer)
    return None if values is None else deflection(record, values, samples, record.wheel_position[samples])


def deflection(record: RunRecord, values: Array | None, samples: Samples, x: Array) -> Array:
    """Deflection of a layer at any places, a row of them a sample [m], shape (sample, place); zero where not known.

    Args:
        record: The run.
        values: The layer's histories, `record.rail`, `.slab` or `.base`.
        samples: Samples asked for, shape (sample,).
        x: Places [m], shape (sample, place).
    """
    rows = _rows(record, values, samples)
    return np.zeros_like(x) if rows is None or record.rail_at is None else along(record.rail_at, rows, x)


def along(at: Array, values: Array, x: Array) -> Array:
    """Interpolate rows of `values` (row, point), known at `at`, at their own places x (row, k): cubic splines."""
    at, values = np.asarray(at, float), np.nan_to_num(np.asarray(values, float))
    if len(at) < 2:
        return np.repeat(values[:, :1], x.shape[1], axis=1)
    from scipy.interpolate import CubicSpline  # not at the top: a campaign without recordings need not wait for it

    coefficients = CubicSpline(at, values, axis=1, bc_type="natural" if len(at) < 4 else "not-a-knot").c
    x = np.clip(x, at[0], at[-1])
    piece = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
    s = x - at[piece]
    c = coefficients[:, piece, np.arange(len(x))[:, None]]
    return ((c[0] * s + c[1]) * s + c[2]) * s + c[3]


def _rows(record: RunRecord, values: Array | None, samples: Samples) -> Array | None:
    """Rows of a track channel at the samples, in between where the channel has times of its own."""
    if values is None:
        return None
    values = np.nan_to_num(np.asarray(values))
    if record.track_time is None or len(values) < 2:
        return values[np.minimum(samples, len(values) - 1)]
    own, time = np.asarray(record.track_time), np.asarray(record.time)[samples]
    low = np.clip(np.searchsorted(own, time, side="right") - 1, 0, len(own) - 2)
    share = np.clip((time - own[low]) / (own[low + 1] - own[low]), 0.0, 1.0)[:, None]
    return (1 - share) * values[low] + share * values[low + 1]
