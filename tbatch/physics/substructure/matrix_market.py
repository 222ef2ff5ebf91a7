"""Matrix Market exchange files.

SciPy 1.17 reads them too, but its reader ends the whole process (segmentation fault) on some files that stop early.
"""

import numpy as np

from tbatch.physics.substructure.file_matrix import MOST_ROWS, FileMatrix, assemble
from tbatch.physics.substructure.number_table import read_table

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
    lines = text.split("\n")
    at = [n for n, line in enumerate(lines) if line and line[0] != "%" and not line.isspace()]
    if not at:
        raise ValueError(f"{path}: ends before the line of its size")
    sparse = layout == "coordinate"
    first, size = at[0] + 1, lines[at[0]].split()
    if len(size) != (3 if sparse else 2) or not all(word.isascii() and word.isdigit() for word in size):
        wanted = "rows, columns, number of entries" if sparse else "rows, columns"
        raise ValueError(f"{path}, line {first}: {' '.join(size)[:60]!r}; accepted: {wanted}")
    if max(map(len, size)) > 15 or size[0] != size[1] or not 1 <= (rows := int(size[0])) <= MOST_ROWS:
        shape = f"{size[0][:20]} x {size[1][:20]}"
        raise ValueError(f"{path}, line {first}: {shape}; accepted: a square matrix of 1 to {MOST_ROWS} rows")
    dense = rows * rows if symmetry == "general" else rows * (rows + 1) // 2
    count = int(size[2]) if sparse else dense
    del at[0]
    if len(at) != count:
        raise ValueError(f"{path}: {len(at)} entries; line {first} says {count}")
    whole = 2 if sparse else 0

    def parse(index: int) -> tuple[list[int], float]:
        words = lines[at[index]].split()
        try:
            if len(words) == whole + 1:
                places = [int(word) for word in words[:-1]]
                if all(1 <= place <= rows for place in places):
                    return places, float(words[-1])
        except ValueError:
            pass
        wanted = f"row, column (1 to {rows}), value" if sparse else "one value"
        raise ValueError(f"{path}, line {at[index] + 1}: {' '.join(words)[:60]!r}; accepted: {wanted}")

    if not at:
        raise ValueError(f"{path}: no entries")
    places, values = read_table([lines[n] for n in at], whole, parse)
    if sparse:
        if (wrong := ((places < 1) | (places > rows)).any(axis=1)).any():
            parse(int(np.argmax(wrong)))
        i, j = places.T - 1
    elif symmetry == "general":
        j, i = np.divmod(np.arange(count), rows)
    else:
        j, i = np.triu_indices(rows)  # the lower half by columns
    half = symmetry == "symmetric"
    matrix = assemble(path, i, j, values, rows, half=half, named=lambda entry: f"line {at[entry] + 1}")
    matrix.eliminate_zeros()
    return FileMatrix(path, matrix)
