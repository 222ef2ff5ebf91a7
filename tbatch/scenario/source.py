"""Where a scenario's text comes from: a file, or one that ships with tbatch."""

import tomllib
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import tbatch
from tbatch.scenario.errors import Path, Problem, ScenarioError, did_you_mean, shown

_LARGEST = 256 * 1024
_LONGEST_LINE = 2000  # tomllib takes quadratic time over dotted keys of many parts: a hostile line must be short


@dataclass(frozen=True)
class Source:
    """A scenario's text and where it stood."""

    text: str
    file: str
    """Name of the file as given, or "scenario" for one that was no file."""
    folder: FilePath
    """Folder that relative paths within the scenario start from."""

    @classmethod
    def find(cls, path_or_name: str | FilePath) -> "Source":
        """Read a scenario file, or the shipped scenario of that name.

        Args:
            path_or_name: Path of a TOML file, or a name that ``tbatch list scenarios`` shows.

        Raises:
            ScenarioError: There is none, or it cannot be read.
        """
        file = str(path_or_name)
        try:
            path = FilePath(path_or_name)
            if not path.is_file() and file in (shipped := shipped_scenarios()):
                path = shipped[file]
            if not path.is_file():
                raise ScenarioError([_missing(path, file)])
            with path.open("rb") as stream:
                content = stream.read(_LARGEST + 1)
            if len(content) > _LARGEST:
                raise ScenarioError([Problem((), "is too large", None, "a scenario of at most 256 KiB", file)])
            return cls(_decode(content, file), file, path.resolve().parent)
        except OSError as error:
            raise ScenarioError([Problem((), f"cannot be read: {error.strerror or error}", file=file)]) from None
        except ScenarioError:
            raise
        except ValueError:  # a path with a null character
            raise ScenarioError([Problem((), "is not a path", file=shown(file))]) from None

    def parse(self) -> dict[str, Any]:
        """Return the text as tables.

        Raises:
            ScenarioError: The text is not TOML; the problem has line and column.
        """
        for number, line in enumerate(self.text.split("\n"), start=1):
            if len(line) > _LONGEST_LINE:
                accepted = f"lines of at most {_LONGEST_LINE} characters; arrays may be broken over lines"
                raise ScenarioError([Problem((), "is too long a line", None, accepted, self.file, number)])
        try:
            return tomllib.loads(self.text)
        except RecursionError:
            raise ScenarioError([Problem((), "is nested too deeply", file=self.file)]) from None
        except ValueError as error:
            raise ScenarioError([self._syntax(error)]) from None

    def _syntax(self, error: ValueError) -> Problem:
        """Return tomllib's complaint with its place as line and column."""
        message, _, at = str(error).rpartition(" (at ")
        numbers = [int(word) for word in at.replace(",", "").replace(")", "").split() if word.isdecimal()]
        if message and at.startswith("end of document"):
            line, column = self.text.count("\n") + 1, len(self.text) - self.text.rfind("\n")
            message = f"TOML: {message} at the end of the file"
            return Problem((), message, file=self.file, line=line, column=column)
        if not message or len(numbers) != 2:  # a number with more digits than Python reads
            return Problem((), f"TOML: {error}", file=self.file)
        return Problem((), f"TOML: {message}", file=self.file, line=numbers[0], column=numbers[1])


def shipped_scenarios() -> dict[str, FilePath]:
    """Return the scenarios that ship with tbatch, by name."""
    package = FilePath(tbatch.__file__).parent
    # In an installed package the folder was put inside; in a checkout it stands beside the package.
    folder = next((f for f in (package / "scenarios", package.parent / "scenarios") if f.is_dir()), None)
    return {} if folder is None else {path.stem: path for path in sorted(folder.glob("*.toml"))}


def parse_override(text: str) -> tuple[Path, Any]:
    """Return the path and the value of an override such as ``track.length=120 m``.

    Args:
        text: ``dotted.key=value``; what is no TOML value is taken as a string.

    Raises:
        ScenarioError: There is no key or no ``=``.
    """
    key, equals, value = text.partition("=")
    problem = Problem(
        (), f"{shown(text)} is not an override", None, 'dotted.key=value, such as "track.length=120 m"', "--set"
    )
    if not equals or len(text) > _LONGEST_LINE:
        raise ScenarioError([problem])
    try:
        table = tomllib.loads(f"{key} = 0")
    except (ValueError, RecursionError):
        raise ScenarioError([problem]) from None
    path: Path = ()
    while isinstance(table, dict):
        if len(table) != 1:
            raise ScenarioError([problem])
        path, table = (*path, next(iter(table))), next(iter(table.values()))
    try:
        parsed = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        parsed = {}
    return path, parsed["value"] if set(parsed) == {"value"} else value.strip()


def set_value(tables: dict[str, Any], path: Path, value: Any) -> Path | None:
    """Set a value in nested tables; return the path of what stands in the way, if anything does.

    A number picks an entry of a list, from 0: ``irregularity.defect.0.depth``.
    """
    table: Any = tables
    for count, key in enumerate(path, start=1):
        place: Any = key
        if isinstance(table, list):
            if not (isinstance(key, str) and key.isdecimal() and int(key) < len(table)):
                return path[: count - 1]
            place = int(key)
        elif not isinstance(table, dict):
            return path[: count - 1]
        if count == len(path):
            table[place] = value
        else:
            table = table[place] if isinstance(table, list) else table.setdefault(place, {})
    return None


def _missing(path: FilePath, file: str) -> Problem:
    if path.exists():
        return Problem((), "is a folder" if path.is_dir() else "is not a file", None, "a scenario file", file)
    names = shipped_scenarios()
    guess = did_you_mean(path.stem, names)
    accepted = "a scenario file, or one of " + ", ".join(f'"{name}"' for name in names)
    return Problem((), f"no such scenario{guess}", None, accepted, file if file.isprintable() else shown(file))


def _decode(content: bytes, file: str) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        message = f"is not a text file in UTF-8 (byte {error.start + 1}: {error.reason})"
        raise ScenarioError([Problem((), message, file=file, line=line)]) from None
