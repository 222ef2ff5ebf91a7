"""What a manifest says of each shard, held as the text that it is written with.

A campaign of a million runs has 15,625 shards, and its manifest is written anew whenever some are stored: as text an
entry takes a third of the memory that it takes as tables, and no time to write.
"""

import json
from collections.abc import Iterator, Mapping, MutableMapping
from typing import Any

from tbatch.campaign.shards import Shard

_NAME = '{"name": "'
_BETWEEN = ",\n"


class Entries(MutableMapping[Shard, dict[str, Any]]):
    """Entries by shard. What is taken out is a copy: an entry changes by being put in again."""

    def __init__(self, entries: Mapping[Shard, Mapping[str, Any]] | None = None) -> None:
        """Takes the first entries."""
        self._text: dict[Shard, str] = {}
        for shard, entry in (entries or {}).items():
            self[shard] = entry

    @classmethod
    def parse(cls, text: str) -> "Entries":
        """The entries of a text that ``text`` gave; ValueError for any other."""
        found = cls()
        for line in text.split(_BETWEEN) if text else ():
            if not line.startswith(_NAME):
                raise ValueError(f"{line[:40]!r} is not the entry of a shard")
            found._text[Shard.parse(line[len(_NAME) : line.index('"', len(_NAME))])] = line
        return found

    def text(self) -> str:
        """All entries in their order as JSON objects, a line each, with commas between."""
        return _BETWEEN.join(self._text[shard] for shard in sorted(self._text))

    def __getitem__(self, shard: Shard) -> dict[str, Any]:
        entry: dict[str, Any] = json.loads(self._text[shard])
        del entry["name"]
        return entry

    def __setitem__(self, shard: Shard, entry: Mapping[str, Any]) -> None:
        self._text[shard] = json.dumps({"name": shard.name, **entry})

    def __delitem__(self, shard: Shard) -> None:
        del self._text[shard]

    def __contains__(self, shard: object) -> bool:
        return shard in self._text

    def __iter__(self) -> Iterator[Shard]:
        return iter(self._text)

    def __len__(self) -> int:
        return len(self._text)
