"""Which campaign a folder holds: its resolved scenario, but for what decides no result.

More runs extend a campaign, they do not change it; a measured level and the matrices of a track are known by their
checksums, wherever their files lie; [limits] and [keep] judge and show runs, they do not make them.
"""

import copy
import hashlib
import json
from collections.abc import Mapping
from typing import Any

from tbatch.scenario.matrices import FILES

_RUNS = "campaign.runs"
_PLACES = ("irregularity.measured.file", *(f"track.matrices.{name}" for name in FILES))
AFTERWARDS = ("keep", "limits")
"""Tables that may change: what is done with the runs."""
_ABSENT = "absent"


def canonical(document: Any) -> str:
    """A document as JSON text that is the same for the same content. Floats keep every bit."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"))


def identity(resolved: Mapping[str, Any]) -> str:
    """SHA-256 of what decides the results; the same as ``Scenario.hash``."""
    deciding = copy.deepcopy(dict(resolved))
    for key in (_RUNS, *_PLACES, *AFTERWARDS):
        *tables, name = key.split(".")
        table: Any = deciding
        for part in tables:
            table = table.get(part, {})
        table.pop(name, None)
    return hashlib.sha256(canonical(deciding).encode()).hexdigest()


def run_count(resolved: Mapping[str, Any]) -> int:
    """Samples per speed of a resolved scenario."""
    return int(resolved["campaign"]["runs"])


def changed_keys(stored: Mapping[str, Any], given: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The keys in which two resolved scenarios differ: dotted key, stored value, given value.

    ``campaign.runs`` counts as changed only where it became less; the place of a file, [limits] and [keep] never.
    """
    return [
        (key, old, new)
        for key, old, new in _differences(stored, given)
        if key not in _PLACES and not _of(key, AFTERWARDS) and not (key == _RUNS and int(new) >= int(old))
    ]


def followed_keys(stored: Mapping[str, Any], given: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The keys of [limits] and [keep] in which two resolved scenarios differ, as ``changed_keys`` gives others."""
    return [change for change in _differences(stored, given) if _of(change[0], AFTERWARDS)]


def _differences(stored: Mapping[str, Any], given: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    before, after = dict(_leaves(stored)), dict(_leaves(given))
    pairs = ((key, before.get(key, _ABSENT), after.get(key, _ABSENT)) for key in sorted(before.keys() | after.keys()))
    return [(key, old, new) for key, old, new in pairs if old != new]


def _of(key: str, tables: tuple[str, ...]) -> bool:
    return key.split(".")[0] in tables


def _leaves(value: Any, path: str = "") -> list[tuple[str, str]]:
    """Every value of nested tables with its dotted key, as JSON text; a list of numbers is one value."""
    if isinstance(value, Mapping) and value:
        return [leaf for key, inner in value.items() for leaf in _leaves(inner, f"{path}.{key}" if path else str(key))]
    if isinstance(value, list | tuple) and any(isinstance(inner, Mapping) for inner in value):
        return [leaf for index, inner in enumerate(value) for leaf in _leaves(inner, f"{path}[{index}]")]
    return [(path, canonical(value))]
