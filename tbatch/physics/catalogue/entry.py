"""An entry of the catalogue: found by name, changed here and there, or given in full."""

from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from typing import Any, TypeVar

P = TypeVar("P")


def complete(kind: type[P], entries: Mapping[str, P], noun: str, name: str | None, given: Mapping[str, Any]) -> P:
    """Return the parameters of the set `name` with the `given` ones changed, or the given ones alone.

    Args:
        kind: the dataclass of the parameters.
        entries: the catalogue.
        noun: what the entries are, for messages.
        name: an entry's name, or None.
        given: values by field; None is "not given".
    """
    changes: dict[str, Any] = {field: value for field, value in given.items() if value is not None}
    if name is None:
        required = [field.name for field in fields(kind) if field.default is MISSING]  # type: ignore[arg-type]
        missing = [field for field in required if field not in changes]
        if missing:
            raise ValueError(f"{noun}: {', '.join(missing)} missing; give them, or a name: {', '.join(entries)}")
        return kind(**changes)
    if name not in entries:
        raise ValueError(f"{noun} {name!r} is not in the catalogue; it has {', '.join(entries)}")
    if not changes:
        return entries[name]
    source = f"{getattr(entries[name], 'source', '')}; changed: {', '.join(changes)}"
    return replace(entries[name], **changes, source=source)  # type: ignore[type-var]
