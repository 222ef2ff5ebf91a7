"""The mapping file that ANSYS writes beside a Harwell-Boeing matrix: equation, node, dof."""

import re

from tbatch.physics.substructure.file_matrix import Label

_DOFS = {name: number for number, name in enumerate(("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"), start=1)}


def read_mapping(text: str, path: str) -> tuple[Label, ...]:
    """Return node and dof of each equation, in the order of the equations.

    Args:
        text: The file's text.
        path: The file, for messages.
    """
    labels: dict[int, Label] = {}
    for number, line in enumerate(text.split("\n"), start=1):
        words = line.split()
        if not words or not words[0].isascii() or not words[0].isdigit():
            if labels and words:
                raise ValueError(f"{path}, line {number}: {line.strip()[:60]!r}; accepted: equation, node, dof name")
            continue  # headings
        if len(words) != 3 or re.fullmatch(r"\d{1,15}", words[1], re.ASCII) is None or len(words[0]) > 15:
            raise ValueError(f"{path}, line {number}: {line.strip()[:60]!r}; accepted: equation, node, dof name")
        if words[2].upper() not in _DOFS:
            raise ValueError(f"{path}, line {number}: dof {words[2][:20]!r}; accepted: {', '.join(_DOFS)}")
        equation, label = int(words[0]), (int(words[1]), _DOFS[words[2].upper()])
        if equation in labels:
            raise ValueError(f"{path}, line {number}: equation {equation} stands there twice")
        labels[equation] = label
    if not labels:
        raise ValueError(f"{path}: no equations; accepted: lines of equation, node, dof name")
    if sorted(labels) != list(range(1, len(labels) + 1)):
        raise ValueError(f"{path}: the equations are not 1 to {len(labels)}")
    if len(set(labels.values())) != len(labels):
        raise ValueError(f"{path}: a node's dof belongs to two equations")
    return tuple(labels[equation] for equation in sorted(labels))
