"""Lines of numbers: read at once by NumPy where they are as they should be, else line by line for the one that is not.

A large model has millions of lines, and a Python object for each would take most of the time.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

_LARGEST_WHOLE = 2.0**53


def read_table(
    lines: Sequence[str], whole: int, parse: Callable[[int], tuple[list[int], float]], *, delimiter: str | None = None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the whole numbers and the value at the end of each line.

    Args:
        lines: Lines without blank ones.
        whole: How many whole numbers stand before the value.
        parse: Reads one line, given its index, or raises ValueError with its place; it may accept more than NumPy.
        delimiter: What stands between the numbers, None for blanks.

    Returns:
        The whole numbers, shape (line, number), and the values, shape (line,).
    """
    try:
        table = np.loadtxt(lines, dtype=np.float64, delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        table = np.zeros((0, 0))
    if table.shape == (len(lines), whole + 1):
        numbers = table[:, :whole]
        if (np.abs(numbers) < _LARGEST_WHOLE).all() and (numbers == np.floor(numbers)).all():
            return numbers.astype(np.int64), np.ascontiguousarray(table[:, whole])
    integers, values = np.empty((len(lines), whole), dtype=np.int64), np.empty(len(lines))
    for index in range(len(lines)):
        integers[index], values[index] = parse(index)
    return integers, values
