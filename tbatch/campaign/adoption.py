"""Shard files that no manifest names: left by a process killed between writing them and saying so."""

from collections.abc import Callable, Container, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from tbatch.campaign.durable import hash_of, read_bytes, read_table
from tbatch.campaign.faults import StoreDamaged
from tbatch.campaign.records import KINDS
from tbatch.campaign.shards import Shard

_FORMAT = "1"


class ForeignShard(StoreDamaged):
    """A file of another campaign; it may be somebody's only copy, so it is never removed."""


def shard_metadata(campaign: str, shard: Shard, kind: str) -> dict[str, str]:
    """What a shard's file says of itself, so that it is known wherever it turns up."""
    return {"tbatch.format": _FORMAT, "tbatch.campaign": campaign, "tbatch.shard": shard.name, "tbatch.kind": kind}


def adopt(
    folder: Path,
    campaign: str,
    known: Container[Shard],
    message: Callable[[str], None],
    mine: Callable[[Shard], bool] = lambda shard: True,
) -> dict[Shard, dict[str, Any]]:
    """Manifest entries of whole stray shards of this campaign; what is cut or incomplete is removed and will be redone.

    Args:
        folder: The campaign folder; the caller holds its lock.
        campaign: Identity of the campaign.
        known: Shards that the manifest names.
        message: Where to say what was found.
        mine: Which shards to look at; a part leaves alone what others may be writing.
    """
    names = {path.stem for kind in KINDS for path in (folder / kind).glob("*.parquet")}
    adopted: dict[Shard, dict[str, Any]] = {}
    for name in sorted(names):
        try:
            shard = Shard.parse(name)
        except ValueError:
            message(f"not a shard, ignored: {name}.parquet")
            continue
        if shard in known or not mine(shard):
            continue
        paths = {kind: folder / kind / f"{name}.parquet" for kind in KINDS}
        try:
            adopted[shard] = stray_entry(paths, campaign, shard)
            message(f"stored but not noted, taken over: {name}")
        except ForeignShard:
            raise
        except StoreDamaged as error:
            for path in paths.values():
                path.unlink(missing_ok=True)
            message(f"left incomplete, its runs are redone: {error.damage[0]}")
    return adopted


def stray_entry(paths: dict[str, Path], campaign: str, shard: Shard) -> dict[str, Any]:
    """The manifest's entry of a stray shard; StoreDamaged if it is not whole."""
    _refuse_foreign(paths.values(), campaign)
    tables = {kind: read_table(path) for kind, path in paths.items()}
    for kind, path in paths.items():
        said = _said(tables[kind])
        if said != shard_metadata(campaign, shard, kind):
            raise StoreDamaged(f"{path}: it is {said.get('tbatch.kind')} of {said.get('tbatch.shard')}")
    runs = tables["runs"]
    if runs["sample"].to_pylist() != [sample for _, sample in shard.pairs]:
        raise StoreDamaged(f"{paths['runs']}: does not hold the runs of its name")
    return {
        "runs": len(shard),
        "diverged": int(np.count_nonzero(runs["status"].to_numpy())),
        "files": {kind: _file_entry(path, tables[kind]) for kind, path in paths.items()},
    }


def _refuse_foreign(paths: Iterable[Path], campaign: str) -> None:
    """ForeignShard if any of the files is of another campaign, whatever became of those beside it."""
    for path in paths:
        try:
            said = _said(read_table(path, columns=()))
        except StoreDamaged:  # missing or cut: said so when all are read
            continue
        if said.get("tbatch.campaign", campaign) != campaign:
            raise ForeignShard(f"{path}: a shard of another campaign")


def _said(table: pa.Table) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}


def _file_entry(path: Path, table: pa.Table) -> dict[str, Any]:
    data = read_bytes(path)
    return {"sha256": hash_of(data), "bytes": len(data), "rows": table.num_rows}
