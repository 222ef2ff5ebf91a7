"""Matrix Market exchange files.

SciPy 1.17 reads them too, but its reader ends the whole process (segmentation fault) on some files that stop early.
"""

import numpy as np

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, assemble

MARK = b"%%matrixmarket"
_FIELDS = ("real", "double", "integer")
_SYMMETRIES = ("general", "symmetric")


def read_matrix_market(text: str, path: str) -> FileMatrix:
    """Read a real matrix, general or symmetric, sparse (coordinate) or dense (array).

    Args:
        text: The file's text.
        path: The file, for messages.
    """
    heading, _, _ = text.partition("\n")
    words = heading.lower().split()
    if len(words) != 5 or words[1] != "matrix" or words[2] not in ("coordinate", "array"):
        raise ValueError(f"{path}, line 1: {heading[:60]!r}; accepted: %%MatrixMarket matrix coordinate real general")
    _, _, layout, field, symmetry = words
    if field not in _FIELDS or symmetry not in _SYMMETRIES:
        raise ValueError(f"{path}, line 1: {field} {symmetry}; accepted: real or integer, general or symmetric")
    body = [(n, w) for n, line in enumerate(text.split("\n"), start=1) if line[:1] != "%" and (w := line.split())]
    if not body:
        raise ValueError(f"{path}: ends before the line of its size")
    sparse = layout == "coordinate"
    line, size = body.pop(0)
    if len(size) != (3 if sparse else 2) or not all(word.isascii() and word.isdigit() for word in size):
        raise ValueError(
            f"{path}, line {line}: accepted: rows, columns{' and the number of entries' if sparse else ''}"
        )
    if max(map(len, size)) > 15 or size[0] != size[1] or not 1 <= (rows := int(size[0])) <= MOST_ROWS:
        shape = f"{size[0][:20]} x {size[1][:20]}"
        raise ValueError(f"{path}, line {line}: {shape}; accepted: a square matrix of 1 to {MOST_ROWS} rows")
    dense = rows * rows if symmetry == "general" else rows * (rows + 1) // 2
    count = int(size[2]) if sparse else dense
    if len(body) != count:
        raise ValueError(f"{path}: {len(body)} entries; line {line} says {count}")
    width = 3 if sparse else 1
    values, places = np.empty(count), np.empty((2, count), dtype=np.int64)
    for at, (number, entry) in enumerate(body):
        try:
            if len(entry) != width:
                raise ValueError
            values[at] = float(entry[-1])
            if sparse:
                places[:, at] = int(entry[0]), int(entry[1])
        except (ValueError, OverflowError):
            raise ValueError(f"{path}, line {number}: {' '.join(entry)[:60]!r}; accepted: {_wanted(sparse)}") from None
    if sparse:
        places -= 1
        if (wrong := (places < 0) | (places >= rows)).any():
            number, entry = body[int(np.argmax(wrong.any(axis=0)))]
            raise ValueError(f"{path}, line {number}: ({entry[0]}, {entry[1]}); rows and columns are from 1 to {rows}")
        i, j = places
    elif symmetry == "general":
        j, i = np.divmod(np.arange(count), rows)
    else:
        j, i = np.triu_indices(rows)  # the lower half by columns
    half = symmetry == "symmetric"
    matrix = assemble(path, i, j, values, rows, half=half, named=lambda entry: f"line {body[entry][0]}")
    matrix.eliminate_zeros()
    return FileMatrix(path, matrix)


def _wanted(sparse: bool) -> str:
    return "row, column, value" if sparse else "one value"
