"""Several responses on the same axes: runs, methods or steps, and what one differs from another by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tbatch.view.palette import Colour
from tbatch.view.record import Array, Separation


@dataclass(frozen=True)
class Panel:
    """One quantity that all responses have."""

    key: str  # names it in paths, "force/wheel_1"
    title: str  # with its unit
    row: str = ""  # panels of a row are behind each other; one without a row is looked at less often


@dataclass(frozen=True, eq=False, kw_only=True)
class Response:
    """The histories of one run, one method or one step."""

    name: str
    colour: Colour
    time: Array
    # time since the start [s], shape (n,)
    position: Array
    # x of wheel 1 [m], shape (n,), ascending
    values: Mapping[str, Array]
    # by key of the panel, shape (n,)
    events: Sequence[Separation] = ()
    # its separations
    facts: Mapping[str, str] = field(default_factory=dict)
    # results in words, columns of the sheet's table

    @cached_property
    def samples(self) -> int:
        """Number of samples up to its end: histories are NaN after it."""
        sound = np.all([np.isfinite(values) for values in self.values.values()], axis=0)
        ended = np.flatnonzero(~sound)
        return int(ended[0]) if len(ended) else len(self.time)

    @property
    def speed(self) -> float:
        """Mean speed [m/s]."""
        last = self.samples - 1
        return float(self.position[last] - self.position[0]) / float(self.time[last] - self.time[0])


@dataclass(frozen=True, eq=False, kw_only=True)
class Page:
    """Responses that are drawn together; the first is what the others are compared with."""

    name: str
    panels: Sequence[Panel]
    responses: Sequence[Response]

    def __post_init__(self) -> None:
        """Check that there is something to compare, under different names."""
        names = [response.name for response in self.responses]
        if len(names) < 2:
            raise ValueError(f"responses of {self.name!r} are {len(names)}; at least 2 are needed to compare")
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise ValueError(f"responses hold {', '.join(sorted(twice))} twice; each is accepted once")

    @property
    def same_speed(self) -> bool:
        """Whether equal times are equal places."""
        speeds = [response.speed for response in self.responses]
        return max(speeds) - min(speeds) <= 1e-6 * max(speeds)


@dataclass(frozen=True, eq=False, kw_only=True)
class Overlay:
    """What one comparing recording holds."""

    name: str
    pages: Sequence[Page]
    notes: Sequence[str] = ()
    # said on the sheet, a paragraph each


@dataclass(frozen=True, eq=False)
class Difference:
    """What one response has more than another, at the samples of the coarser one."""

    time: Array
    # of the response compared with [s], shape (k,)
    position: Array
    # x of wheel 1 [m], shape (k,)
    values: Array
    # shape (k,)


def difference(response: Response, base: Response, key: str) -> Difference:
    """Take a response's difference from another at the same places of wheel 1.

    With one speed and start these are the same times. The finer sampled of the two is interpolated linearly to the
    samples of the coarser: where one step is a whole multiple of the other, nothing is interpolated at all.

    Args:
        response: Of whom.
        base: From whom.
        key: The panel.
    """
    parts = [(one.position[: one.samples], one.values[key][: one.samples]) for one in (response, base)]
    (own, _), (other, _) = parts
    spacings = [(place[-1] - place[0]) / max(len(place) - 1, 1) for place, _ in parts]
    grid = own if spacings[0] > spacings[1] * (1 + 1e-9) else other
    slack = 1e-9 * max(abs(float(grid[-1])), 1.0)
    grid = grid[(grid >= max(own[0], other[0]) - slack) & (grid <= min(own[-1], other[-1]) + slack)]
    values = [np.interp(grid, place, value) for place, value in parts]
    time = np.interp(grid, other, base.time[: base.samples])
    return Difference(time, grid, values[0] - values[1])


def overlay_sheet(overlay: Overlay) -> str:
    """One page of markdown: what is compared, each response's results, and the largest differences."""
    text = [f"# {overlay.name}", ""]
    for note in overlay.notes:
        text += [note, ""]
    for page in overlay.pages:
        columns = list(dict.fromkeys(name for response in page.responses for name in response.facts))
        base = page.responses[0].name
        text += [f"## {page.name}", ""] if len(overlay.pages) > 1 else []
        if columns:
            text += ["| | " + " | ".join(columns) + " |", "|---" + "|---:" * len(columns) + "|"]
            text += [
                f"| {response.name} | " + " | ".join(response.facts.get(name, "") for name in columns) + " |"
                for response in page.responses
            ]
            text.append("")
        others = page.responses[1:]
        text += [f"Differences are from {base}, at the same places of wheel 1.", ""]
        text += ["| largest difference | " + " | ".join(one.name for one in others) + " |"]
        text += ["|---" + "|---:" * len(others) + "|"]
        for panel in page.panels:
            largest = [float(np.max(np.abs(difference(one, page.responses[0], panel.key).values), initial=0.0))
                       for one in others]  # fmt: skip
            text.append(f"| {panel.title} | " + " | ".join(f"{value:.3g}" for value in largest) + " |")
        text.append("")
    return "\n".join(text)
