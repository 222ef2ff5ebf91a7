"""Whether a run simulated again is the stored one, bit for bit."""

import pyarrow as pa


def rows_of(table: pa.Table, column: str, value: int) -> pa.Table:
    """The rows of a table with one value in a column, without that column."""
    return table.filter(pa.array(table[column].to_numpy() == value)).drop_columns([column])


def differing_columns(stored: pa.Table, given: pa.Table) -> list[str]:
    """Names of the stored columns that another table does not hold bit for bit; NaN equals NaN."""
    return [
        name
        for name in stored.column_names
        if name not in given.column_names or not _same(stored[name].combine_chunks(), given[name].combine_chunks())
    ]


def _same(one: pa.Array, other: pa.Array) -> bool:
    if one.type != other.type or len(one) != len(other):
        return False
    if pa.types.is_floating(one.type):
        return one.to_numpy(zero_copy_only=False).tobytes() == other.to_numpy(zero_copy_only=False).tobytes()
    return one.equals(other)
