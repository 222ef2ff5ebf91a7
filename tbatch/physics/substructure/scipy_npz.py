"""SciPy's own files of sparse matrices."""

from io import BytesIO

import numpy as np
from scipy import sparse

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix

MARK = b"PK\x03\x04"


def read_npz(content: bytes, path: str) -> FileMatrix:
    """Read what ``scipy.sparse.save_npz`` wrote.

    Args:
        content: The file's bytes.
        path: The file, for messages.
    """
    try:
        given = sparse.load_npz(BytesIO(content))
        if given.ndim != 2 or given.shape[0] != given.shape[1] or not 1 <= given.shape[0] <= MOST_ROWS:
            shape = " x ".join(map(str, given.shape))
            raise ValueError(f"{shape}; accepted: a square matrix of 1 to {MOST_ROWS} rows")
        if given.dtype.kind not in "fiu":
            raise ValueError(f"holds {given.dtype} values; accepted: real numbers")
        if hasattr(given, "check_format"):
            given.check_format(full_check=True)  # without it, indices out of range are read out of bounds
        matrix = sparse.csc_matrix(given, dtype=np.float64)
        matrix.sum_duplicates()
    except Exception as error:  # zipfile, zlib, NumPy and SciPy each have errors of their own
        said = str(error).strip("'\"") or type(error).__name__
        raise ValueError(f"{path}: not a matrix of scipy.sparse.save_npz: {said}") from None
    if not np.isfinite(matrix.data).all():
        raise ValueError(f"{path}: holds a value that is not finite")
    return FileMatrix(path, matrix)
