"""Table: figures with their names and units, for people and for files."""

from dataclasses import dataclass, field
from typing import Any


@dataclass
class Table:
    """Some rows of figures."""

    title: str
    columns: tuple[str, ...]
    """Names with units."""
    rows: list[tuple[Any, ...]] = field(default_factory=list)

    def add(self, *values: Any) -> None:
        """Append a row.

        Args:
            values: One value a column.
        """
        if len(values) != len(self.columns):
            raise ValueError(f"table {self.title!r}: {len(values)} values given for {len(self.columns)} columns")
        self.rows.append(values)

    def as_json(self) -> list[dict[str, Any]]:
        """A dictionary a row."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]

    def as_text(self) -> str:
        """Title, head and rows, aligned."""
        cells = [list(self.columns), *([_shown(value) for value in row] for row in self.rows)]
        widths = [max(len(row[column]) for row in cells) for column in range(len(self.columns))]
        # Names stand left, figures right.
        left = [any(isinstance(row[column], str) for row in self.rows) for column in range(len(self.columns))]
        lines = []
        for row in cells:
            parts = zip(row, widths, left, strict=True)
            lines.append("  ".join(cell.ljust(width) if name else cell.rjust(width) for cell, width, name in parts))
        shown = [line.rstrip() for line in lines if line.strip()]
        return "\n".join([self.title, "-" * len(self.title), *shown])


def _shown(value: Any) -> str:
    """Four digits of a number, whole numbers as they are."""
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    return f"{value:,}" if isinstance(value, int) else str(value)
