"""Where each key of a TOML text stands: tomllib reads values but forgets their lines."""

import re
import tomllib
from bisect import bisect_right

from tbatch.scenario.errors import Path

_BLANK = re.compile(r"[ \t\r]*")
_BLANK_OR_COMMENT = re.compile(r"(?:[\s]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}(?!")'
    r"|'''.*?'{3,5}(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


def key_lines(text: str) -> dict[Path, int]:
    """Return the line of every key, table and array element of a valid TOML text.

    Args:
        text: A text that tomllib accepts. For any other text the result is incomplete, never an error.

    Returns:
        Line, counted from 1, by path: keys and array indices from the top.
    """
    walk = _Walk(text)
    try:
        walk.document()
    except (IndexError, RecursionError, ValueError):
        pass  # not valid TOML after all: what was found until here still serves
    return walk.lines


class _Walk:
    """One pass over a text, from ``at`` to its end."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[Path, int] = {}
        self._tables: dict[Path, int] = {}  # how many tables [[path]] has so far
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def document(self) -> None:
        table: Path = ()
        while self._skip(_BLANK_OR_COMMENT) < len(self.text):
            if self.text[self.at] == "[":
                table = self._header()
            else:
                self._pair(table)

    def _header(self) -> Path:
        many = self.text.startswith("[[", self.at)
        start = self.at
        self.at += 2 if many else 1
        keys = self._keys()
        path: Path = ()
        for count, key in enumerate(keys, start=1):
            path += (key,)
            if count == len(keys) and many:
                self._tables[path] = self._tables.get(path, 0) + 1
                self._note(path, start)
            if path in self._tables:
                path += (self._tables[path] - 1,)
            self._note(path, start)
        self.at += 2 if many else 1
        return path

    def _pair(self, table: Path) -> None:
        start = self.at
        path = table
        for key in self._keys():
            path += (key,)
            self._note(path, start)
        self._expect("=")
        self._value(path)

    def _keys(self) -> list[str]:
        """Read a dotted key and the blanks after it."""
        keys = []
        while True:
            self._skip(_BLANK)
            match = _STRING.match(self.text, self.at) or _BARE_KEY.match(self.text, self.at)
            if match is None:
                raise ValueError("no key here")
            self.at = match.end()
            quoted = match[0][0] in "\"'"
            keys.append(tomllib.loads(f"key = {match[0]}")["key"] if quoted else match[0])
            self._skip(_BLANK)
            if self.text[self.at] != ".":
                return keys
            self.at += 1

    def _value(self, path: Path) -> None:
        self._skip(_BLANK)
        first = self.text[self.at]
        if first == "[":
            self.at += 1
            index = 0
            while self._next("]"):
                self._note((*path, index), self.at)
                self._value((*path, index))
                index += 1
        elif first == "{":
            self.at += 1
            while self._next("}"):
                self._pair(path)
        else:
            match = _STRING.match(self.text, self.at) or _SCALAR.match(self.text, self.at)
            if match is None or not match[0]:
                raise ValueError("no value here")
            self.at = match.end()

    def _next(self, closing: str) -> bool:
        """Step over blanks, comments and a comma to the next element; False, behind it, at the closing bracket."""
        self._skip(_BLANK_OR_COMMENT)
        if self.text[self.at] == ",":
            self.at += 1
            self._skip(_BLANK_OR_COMMENT)
        if self.text[self.at] == closing:
            self.at += 1
            return False
        return True

    def _expect(self, character: str) -> None:
        if self.text[self.at] != character:
            raise ValueError(f"no {character} here")
        self.at += 1

    def _skip(self, pattern: re.Pattern[str]) -> int:
        match = pattern.match(self.text, self.at)
        self.at = match.end() if match else self.at
        return self.at

    def _note(self, path: Path, at: int) -> None:
        self.lines.setdefault(path, bisect_right(self._starts, at))
