"""Which campaign a folder holds: its resolved scenario, all but the number of runs."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

_RUNS = ("campaign", "runs")
_ABSENT = "absent"


def canonical(document: Any) -> str:
    """A document as JSON text that is the same for the same content. Floats keep every bit."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def identity(resolved: Mapping[str, Any]) -> str:
    """SHA-256 of a resolved scenario without ``campaign.runs``: more runs extend a campaign, they do not change it."""
    campaign = {key: value for key, value in resolved.get("campaign", {}).items() if key != _RUNS[1]}
    return hashlib.sha256(canonical({**resolved, "campaign": campaign}).encode()).hexdigest()


def run_count(resolved: Mapping[str, Any]) -> int:
    """Samples per speed of a resolved scenario."""
    return int(resolved["campaign"]["runs"])


def changed_keys(stored: Mapping[str, Any], given: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The keys in which two resolved scenarios differ: dotted key, stored value, given value.

    ``campaign.runs`` counts as changed only where it became less.
    """
    before, after = dict(_leaves(stored)), dict(_leaves(given))
    changed = []
    for key in sorted(before.keys() | after.keys()):
        old, new = before.get(key, _ABSENT), after.get(key, _ABSENT)
        if old != new and not (key == ".".join(_RUNS) and int(new) >= int(old)):
            changed.append((key, old, new))
    return changed


def _leaves(value: Any, path: str = "") -> list[tuple[str, str]]:
    """Every value of nested tables with its dotted key, as JSON text; a list of numbers is one value."""
    if isinstance(value, Mapping) and value:
        return [leaf for key, inner in value.items() for leaf in _leaves(inner, f"{path}.{key}" if path else str(key))]
    if isinstance(value, list | tuple) and any(isinstance(inner, Mapping) for inner in value):
        return [leaf for index, inner in enumerate(value) for leaf in _leaves(inner, f"{path}[{index}]")]
    return [(path, canonical(value))]
