"""What is wrong with a scenario: every problem at once, each with its place."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

Path = tuple[str | int, ...]

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_LONGEST_SHOWN = 60


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a scenario."""

    path: Path
    """Keys and indices that lead to the value; empty for the file as a whole."""
    message: str
    """What is wrong, in words that follow the value."""
    value: str | None = None
    """The value as written, shortened; None where there is none."""
    accepted: str | None = None
    """What is accepted instead, with its range and unit."""
    file: str = ""
    """The file, or ``--set`` for an override."""
    line: int | None = None
    """Line in the file, counted from 1; None if unknown."""
    column: int | None = None
    """Column in the line, counted from 1; known for syntax errors only."""

    @property
    def key(self) -> str:
        """Dotted key, as in ``irregularity.defect[0].depth``."""
        return dotted(self.path)

    def __str__(self) -> str:
        """Return ``file:line: key = value: message; accepted: ...`` on one line."""
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part not in ("", None))
        what = self.key if self.value is None else f"{self.key} = {self.value}"
        text = ": ".join(part for part in (place, what, self.message) if part)
        return f"{text}; accepted: {self.accepted}" if self.accepted else text


class ScenarioError(ValueError):
    """A scenario that cannot be run; ``problems`` lists everything that is wrong with it."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Collect the problems, in the order of their lines.

        Args:
            problems: At least one problem.
        """
        self.problems = tuple(sorted(problems, key=lambda problem: problem.line or 0))
        super().__init__("\n".join(str(problem) for problem in self.problems))


class Findings:
    """Problems and warnings, gathered while a scenario is read."""

    def __init__(self) -> None:
        """Begin with none."""
        self.problems: list[Problem] = []
        self.warnings: list[str] = []

    def refuse(self, path: Path, message: str, *, value: Any = None, accepted: str | None = None) -> None:
        """Note a problem.

        Args:
            path: Keys and indices that lead to the value.
            message: What is wrong, in words that follow the value.
            value: The value as read; None where there is none.
            accepted: What is accepted instead.
        """
        self.problems.append(Problem(path, message, None if value is None else shown(value), accepted))

    def warn(self, text: str) -> None:
        """Note something that will run but may not be meant."""
        self.warnings.append(text)


def place(
    problems: Iterable[Problem], file: str, lines: Mapping[Path, int], overridden: Iterable[Path]
) -> list[Problem]:
    """Add to each problem the file and line of its key.

    A key that is not in the file gets the line of the table it would stand in; an overridden one, or a table that only
    an override made, the option's name.

    Args:
        problems: Problems with their paths.
        file: Name of the file, as the user gave it.
        lines: Line of each key, from ``key_lines``.
        overridden: Paths given by overrides instead of by the file.
    """
    overridden = list(overridden)
    placed = []
    for problem in problems:
        path = problem.path
        made = path and path not in lines and any(given[: len(path)] == path for given in overridden)
        if made or any(path[: len(given)] == given for given in overridden):
            placed.append(replace(problem, file="--set"))
            continue
        while path and path not in lines:
            path = path[:-1]
        placed.append(replace(problem, file=file, line=problem.line or lines.get(path)))
    return placed


def dotted(path: Path) -> str:
    """Return a path as TOML writes it, with quotes where a key needs them and indices in brackets."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += ("." if text else "") + (part if _BARE_KEY.fullmatch(part) else shown(part))
    return text


def shown(value: Any) -> str:
    """Return a value as a user would write it, on one line, printable and short."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an int beyond Python's 4300 digits; a table nested too deeply to print
        return "a very large number" if isinstance(value, int) else "a deeply nested value"
    if isinstance(value, bool):
        text = text.lower()
    elif isinstance(value, str):
        text = f'"{text[1:-1]}"'
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 4] + " ..."


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """Return ``"; did you mean ...?"`` for a close name, else an empty text."""
    close = get_close_matches(word[:_LONGEST_SHOWN], list(names), n=1, cutoff=0.6)
    return f"; did you mean {shown(close[0])}?" if close else ""
