"""Numbers as users give them: accepted with their range and unit, or refused by name."""

from collections.abc import Sequence
from math import isfinite
from numbers import Integral, Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def positive(field: str, value: object, unit: str) -> float:
    """Return `value` as a float above zero."""
    number = finite(field, value, unit)
    if number <= 0.0:
        raise ValueError(f"{field} = {value!r}: must be above 0 [{unit}]")
    return number


def non_negative(field: str, value: object, unit: str) -> float:
    """Return `value` as a float of zero or more."""
    number = finite(field, value, unit)
    if number < 0.0:
        raise ValueError(f"{field} = {value!r}: must be 0 or more [{unit}]")
    return number


def finite(field: str, value: object, unit: str) -> float:
    """Return `value` as a finite float."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real) or not isfinite(float(value)):
        raise ValueError(f"{field} = {value!r}: must be a finite number [{unit}]")
    return float(value)


def whole_number(field: str, value: object, low: int) -> int:
    """Return `value` as an int of at least `low`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < low:
        raise ValueError(f"{field} = {value!r}: must be a whole number of at least {low}")
    return int(value)


def one_of(field: str, value: object, accepted: Sequence[str]) -> str:
    """Return `value` if it is one of the `accepted` words."""
    if not isinstance(value, str) or value not in accepted:
        raise ValueError(f"{field} = {value!r}: must be one of {', '.join(map(repr, accepted))}")
    return value


def pair(field: str, value: object, names: tuple[str, str]) -> tuple[object, object]:
    """Return the two entries of `value`, a pair such as (stiffness, damping)."""
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray) or len(value) != 2:
        raise ValueError(f"{field} = {value!r}: must be a pair ({names[0]}, {names[1]})")
    return value[0], value[1]


def spring_damper(
    field: str, value: object, *, per: str = "", stiffness_above_zero: bool = False
) -> tuple[float, float]:
    """Return `value` as (stiffness, damping), each zero or more; `per` ends the units, such as ' per metre'."""
    stiffness, damping = pair(field, value, ("stiffness", "damping"))
    accept = positive if stiffness_above_zero else non_negative
    return (
        accept(f"{field} stiffness", stiffness, f"N/m{per}"),
        non_negative(f"{field} damping", damping, f"N s/m{per}"),
    )


def beam_section(field: str, value: object) -> tuple[float, float]:
    """Return `value` as (EI, mass per metre), both above zero."""
    bending_stiffness, mass = pair(field, value, ("EI", "mass per metre"))
    return positive(f"{field} EI", bending_stiffness, "N m2"), positive(f"{field} mass", mass, "kg/m")


def rail_count(field: str, value: object) -> int | None:
    """Return 1 (half model), 2 (whole model) or None (either)."""
    if value is None:
        return None
    if isinstance(value, bool) or value not in (1, 2):
        raise ValueError(f"{field} = {value!r}: must be 1 (half model, one rail), 2 (whole model) or None (either)")
    return int(value)


def symmetric_matrix(field: str, value: ArrayLike, size: int | None = None) -> FloatArray:
    """Return `value` as a read-only symmetric matrix, of the given size if one is given.

    An asymmetry of round-off (1e-9 of the largest entry) is removed, a larger one is refused.
    """
    matrix = array(field, value)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise ValueError(f"{field} has shape {matrix.shape}: must be square, (dof, dof), with at least one dof")
    if size is not None and matrix.shape[0] != size:
        raise ValueError(f"{field} has shape {matrix.shape}: must be ({size}, {size}) like the mass")
    asymmetry = float(np.abs(matrix - matrix.T).max())
    if asymmetry > 1e-9 * float(np.abs(matrix).max()):
        raise ValueError(f"{field} is not symmetric: entries differ from their mirror by up to {asymmetry:.6g}")
    return read_only(0.5 * (matrix + matrix.T))


def mass_matrix(field: str, value: ArrayLike) -> FloatArray:
    """Return `value` as a read-only symmetric, positive definite matrix."""
    M = symmetric_matrix(field, value)
    diagonal = np.diag(M)
    if (diagonal <= 0.0).any():
        dof = int(np.argmin(diagonal))
        raise ValueError(f"{field} of dof {dof} = {float(diagonal[dof])!r}: must be above 0 [kg or kg m2]")
    # Scaled to a unit diagonal, so that kilograms and inertias compare.
    scale = 1.0 / np.sqrt(diagonal)
    if float(np.linalg.eigvalsh(scale[:, None] * M * scale)[0]) <= 1e-12:
        raise ValueError(f"{field} must be positive definite: some motion has no mass or a negative one")
    return M


def vector(field: str, value: ArrayLike, size: int, axis: str) -> FloatArray:
    """Return `value` as a read-only vector of `size` finite entries."""
    entries = array(field, value)
    if entries.shape != (size,):
        raise ValueError(f"{field} has shape {entries.shape}: must be ({size},), one entry a {axis}")
    return read_only(entries)


def array(field: str, value: ArrayLike) -> FloatArray:
    """Return a copy of `value` as a finite float array."""
    try:
        entries = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{field}: must be an array of numbers ({error})") from None
    if not np.isfinite(entries).all():
        raise ValueError(f"{field}: every entry must be finite")
    return entries


def read_only(entries: FloatArray) -> FloatArray:
    """Return `entries`, no longer writeable: models are shared by all runs."""
    entries.setflags(write=False)
    return entries
