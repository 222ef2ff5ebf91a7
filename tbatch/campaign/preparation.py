"""A campaign folder made ready to be written: documents in place, leftovers gone, stray shards taken over.

One process has the folder for itself, or several parts work in it, each on its own shards and its own manifest. What
one process writes joins the manifests of the parts that worked before it.
"""

import contextlib
import json
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tbatch.campaign.adoption import adopt
from tbatch.campaign.durable import hash_of, make_folder, read_bytes, remove_leftovers, write_bytes
from tbatch.campaign.faults import ScenarioChanged, StoreDamaged
from tbatch.campaign.identity import changed_keys, followed_keys, identity
from tbatch.campaign.manifest import MANIFEST_NAME, Manifest
from tbatch.campaign.part import PARTS, Part, part_manifests
from tbatch.campaign.provenance import decisive, processor, versions
from tbatch.campaign.records import KINDS
from tbatch.campaign.shards import Shard
from tbatch.campaign.store import RECORDINGS, RESOLVED_NAME, SCENARIO_NAME, Message, Store, read_manifests


def prepare(
    folder: Path, source: str, resolved: Mapping[str, Any], *, message: Message, part: Part | None = None
) -> Store:
    """Makes a folder ready; see ``Store.prepare``."""
    given: dict[str, Any] = json.loads(json.dumps(resolved))
    places = [folder, *(folder / kind for kind in KINDS)]
    for place in [*places, *([folder / PARTS] if part else [])]:
        make_folder(place)
    if part is None:  # a part's neighbours are writing
        tidy(folder)
    store = _opened(folder, given, message)
    if part is not None:
        store.own = Manifest.read(folder, part.manifest_name) or Manifest(store.manifest.campaign)
        store.own_name = part.manifest_name
    if part is None:
        _follow(store, given, message)
    _write_documents(store, source, given)
    _adopt(store, part, message)
    store.own.sessions.append(new_session(store.own, message))
    store.save()
    if part is None:
        for path in part_manifests(folder):
            path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            (folder / PARTS).rmdir()
    return store


def tidy(folder: Path) -> None:
    """Removes what killed processes and workers were about to write; nobody else may be writing."""
    for place in [folder, *(folder / kind for kind in KINDS), folder / PARTS]:
        remove_leftovers(place)


def new_session(manifest: Manifest, message: Message) -> dict[str, Any]:
    """What the manifest notes of this process, which is about to add runs to those it names."""
    session = {"id": uuid.uuid4().hex[:16], "versions": versions(), "processor": processor()}
    for before in manifest.sessions[-1:]:
        warn_of_other_versions(before, session, message)
    return session | {"run_steps": 0, "seconds": 0.0, "kernel_seconds": 0.0}


def warn_of_other_versions(before: Mapping[str, Any], session: Mapping[str, Any], message: Message) -> None:
    """Says so where two sessions of a campaign may not give the same bits."""
    was, now = decisive(before["versions"]), decisive(session["versions"])
    differing = [f"{name} {was[name]} -> {now[name]}" for name in now if was[name] != now[name]]
    if differing:
        message(f"made by other versions so far ({', '.join(differing)}): runs may differ in their last bits")
    elif before["processor"] != session["processor"]:
        message(f"made on another processor so far ({before['processor']}): runs may differ in their last bits")


def refuse_if_changed(folder: Path, stored: Mapping[str, Any], given: Mapping[str, Any]) -> None:
    """ScenarioChanged if two resolved scenarios are not of one campaign."""
    changed = changed_keys(stored, given)
    if changed:
        lines = "\n".join(f"  {key}: stored {old}, given {new}" for key, old, new in changed)
        raise ScenarioChanged(
            f"folder {folder} holds a campaign of another scenario:\n{lines}\n"
            "Choose another folder with --out, or give the stored values: more runs extend a campaign, [limits] and"
            " [keep] may change, nothing else."
        )


def _opened(folder: Path, given: dict[str, Any], message: Message) -> Store:
    """The store as it stands; a lost document is the given scenario's, if that is the manifest's campaign."""
    lost = [name for name in (SCENARIO_NAME, RESOLVED_NAME) if not (folder / name).exists()]
    manifest = read_manifests(folder) if lost else None
    if manifest is not None and manifest.documents:
        if RESOLVED_NAME not in lost:
            refuse_if_changed(folder, Store.open(folder, lost=lost).resolved, given)
        if identity(given) != manifest.campaign:
            raise ScenarioChanged(
                f"folder {folder} holds a campaign of another scenario; which keys differ cannot be said without its"
                f" {RESOLVED_NAME}. Choose another folder with --out, or give the scenario that it was run with."
            )
        message(f"missing, written again from the scenario given: {', '.join(str(folder / name) for name in lost)}")
        return Store(folder, given, manifest)
    if (folder / RESOLVED_NAME).exists() or (folder / MANIFEST_NAME).exists() or part_manifests(folder):
        store = Store.open(folder)
        refuse_if_changed(folder, store.resolved, given)
        return store
    return Store(folder, given, Manifest(identity(given)))


def _follow(store: Store, given: dict[str, Any], message: Message) -> None:
    """Says which of [keep] and [limits] changed, and drops recordings that hold other channels than asked for now."""
    followed = followed_keys(store.resolved, given)
    if not followed:
        return
    message("other than before: " + ", ".join(f"{key} {old} -> {new}" for key, old, new in followed))
    if any(key in ("keep.channels", "keep.every") for key, _, _ in followed):
        for name in store.own.recordings:
            (store.folder / RECORDINGS / name).unlink(missing_ok=True)
        store.own.recordings = {}


def _write_documents(store: Store, source: str, resolved: dict[str, Any]) -> None:
    """Writes the scenario; while one is replaced, the manifest allows the old and the new."""
    path = store.folder / SCENARIO_NAME
    if not source:  # a scenario made from tables, such as those of resolved.json when a campaign is resumed
        source = path.read_text(encoding="utf-8") if path.exists() else f"# made from tables, see {RESOLVED_NAME}\n"
    texts = {SCENARIO_NAME: source.encode(), RESOLVED_NAME: json.dumps(resolved, indent=1).encode()}
    new = {name: [hash_of(data)] for name, data in texts.items()}
    own, old = store.own, store.manifest.documents
    differing = [name for name, data in texts.items() if not _holds(store.folder / name, data)]
    if own.documents == new and not differing:
        return
    if differing and old:
        own.documents = {name: [*new[name], *old.get(name, [])] for name in new}
        store.save()
    for name in differing:
        write_bytes(store.folder / name, texts[name])
    own.documents = new
    store.resolved = resolved


def _holds(path: Path, data: bytes) -> bool:
    return path.exists() and read_bytes(path) == data


def _adopt(store: Store, part: Part | None, message: Message) -> None:
    """Drops shards whose files are gone, takes over whole ones that no manifest names, refuses damaged ones."""
    cases = len(store.resolved["speed"]["values"])

    def mine(shard: Shard) -> bool:
        return part is None or part.holds(shard, cases)

    for shard in filter(mine, list(store.manifest.shards)):
        gone = [str(path) for kind in KINDS if not (path := store.path(kind, shard)).exists()]
        if gone:
            for manifest in (store.manifest, store.own):
                manifest.shards.pop(shard, None)
            message(f"missing, its runs are redone: {', '.join(gone)}")
    damage = store.damage(mine)
    if damage:
        raise StoreDamaged(damage)
    session = len(store.own.sessions) - 1
    for shard, entry in adopt(store.folder, store.manifest.campaign, store.manifest.shards, message, mine).items():
        store.own.shards[shard] = {**entry, "session": session if session >= 0 else None}
