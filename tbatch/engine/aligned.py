"""Memory that lane vectors can load: aligned to 64 bytes. A plain NumPy array crashes the process."""

import numpy as np

ALIGNMENT = 64


def aligned_zeros(shape: tuple[int, ...], dtype: type = np.float64) -> np.ndarray:
    """Zeros at an address that is a multiple of 64 bytes.

    Args:
        shape: Shape of the array.
        dtype: Type of its numbers.
    """
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + ALIGNMENT, np.uint8)
    offset = -raw.ctypes.data % ALIGNMENT
    return raw[offset : offset + size].view(dtype).reshape(shape)


def aligned(array: np.ndarray) -> np.ndarray:
    """A copy of an array at an aligned address."""
    copy = aligned_zeros(array.shape, array.dtype.type)
    copy[...] = array
    return copy
