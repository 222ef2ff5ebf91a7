"""A part of a campaign, ``--shard i/n``: the share of one of several processes that know nothing of each other.

Which shards a part holds is fixed by the scenario: it depends neither on what is stored nor on which machines work. A
part writes its own shard files and its own manifest under ``parts/`` and nothing else, so that any number of parts may
work in one folder of a shared file system, or in folders of their own that ``tbatch merge`` joins.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tbatch.campaign.durable import make_folder
from tbatch.campaign.faults import FolderInUse
from tbatch.campaign.lock import LOCK_NAME, FolderLock, folder_owner
from tbatch.campaign.shards import SHARD_SAMPLES, Shard

PARTS = "parts"
_TEXT = re.compile(r"(\d{1,6})/(\d{1,6})", re.ASCII)


@dataclass(frozen=True)
class Part:
    """Part ``index`` of ``count``, counted from 0."""

    index: int
    count: int

    @classmethod
    def parse(cls, text: str) -> "Part":
        """The part of a text such as ``0/4``; ValueError for any other."""
        match = _TEXT.fullmatch(text)
        if match is None or int(match[1]) >= int(match[2]):
            raise ValueError(f"--shard {text!r}: i/n is needed, i from 0 to n - 1, such as 0/4, 1/4, 2/4 and 3/4")
        return cls(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"

    @property
    def name(self) -> str:
        """The name of its files under ``parts/``, without suffix."""
        return f"{self.index}-of-{self.count}"

    @property
    def manifest_name(self) -> str:
        """Its manifest, below the campaign folder."""
        return f"{PARTS}/{self.name}.json"

    @property
    def lock_name(self) -> str:
        """Its lock, below the campaign folder."""
        return f"{PARTS}/{self.name}.lock"

    def holds(self, shard: Shard, case_count: int) -> bool:
        """Whether a shard is this part's; all shards within one block of samples of a case are in the same part.

        The cases turn by one from block to block: slow speeds take more steps, and would otherwise gather in one part
        where ``count`` is a multiple of the number of cases.
        """
        block = shard.start // SHARD_SAMPLES
        return (block * case_count + (shard.case + block) % case_count) % self.count == self.index


def part_manifests(folder: Path) -> list[Path]:
    """The manifests of the parts that worked in a campaign folder."""
    return sorted((folder / PARTS).glob("*-of-*.json"))


@contextmanager
def holding(folder: Path, part: Part | None, message: Callable[[str], None]) -> Iterator[None]:
    """Holds a campaign folder, or a part of it, for this process; FolderInUse if another one does.

    Whoever holds one looks for the other afterwards: of two that come at the same moment both may be refused, never
    none.

    Args:
        folder: The campaign folder, which exists.
        part: The part; None for all of the folder.
        message: Where to say that a dead process's lock was taken over.
    """
    if part is None:
        with FolderLock(folder, message=message):
            for path in sorted((folder / PARTS).glob("*.lock")):
                _refuse_if_held(folder, f"{PARTS}/{path.name}")
            yield
        return
    make_folder(folder / PARTS)
    # What a part does may be done twice without harm, and a scheduler starts a lost job again on another machine.
    with FolderLock(folder, part.lock_name, take_over_elsewhere=True, message=message):
        _refuse_if_held(folder, LOCK_NAME)
        yield


def _refuse_if_held(folder: Path, name: str) -> None:
    owner = folder_owner(folder, name)
    if owner is not None:
        raise FolderInUse(
            f"folder {folder} is in use by pid {owner.get('pid')} on host {owner.get('host')} ({name} is its lock)."
        )
