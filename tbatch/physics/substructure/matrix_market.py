"""Matrix Market exchange files."""

from io import BytesIO

import numpy as np
from scipy import io as scipy_io
from scipy import sparse

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, assemble

MARK = b"%%matrixmarket"


def read_matrix_market(content: bytes, path: str) -> FileMatrix:
    """Read a real matrix, general or symmetric, sparse (coordinate) or dense (array).

    Args:
        content: The file's bytes.
        path: The file, for messages.
    """
    try:
        rows, columns, entries, layout, field, symmetry = scipy_io.mminfo(BytesIO(content))
    except Exception as error:  # the reader of SciPy 1.17 is C++: its errors come in several types
        raise ValueError(f"{path}: the Matrix Market header is not read ({error})") from None
    if field not in ("real", "double", "integer", "unsigned-integer") or symmetry not in ("general", "symmetric"):
        raise ValueError(f"{path}: is {field} {symmetry}; accepted: real or integer, general or symmetric")
    if rows != columns or not 1 <= rows <= MOST_ROWS:
        raise ValueError(f"{path}: {rows} x {columns}; accepted: a square matrix of 1 to {MOST_ROWS} rows")
    dense = rows * rows if symmetry == "general" else rows * (rows + 1) // 2
    if (dense if layout == "array" else entries) > len(content):
        raise ValueError(f"{path}: ends before its {dense if layout == 'array' else entries} entries")
    try:
        matrix = sparse.coo_matrix(scipy_io.mmread(BytesIO(content)))
    except Exception as error:
        raise ValueError(f"{path}: {error}") from None
    i, j = matrix.row.astype(np.int64), matrix.col.astype(np.int64)
    # What stands in the file twice has been read twice, and SciPy would add it up.
    values = np.asarray(matrix.data, dtype=np.float64)
    named = lambda entry: f"entry ({i[entry] + 1}, {j[entry] + 1})"  # noqa: E731
    return FileMatrix(path, assemble(path, i, j, values, rows, half=False, named=named))
