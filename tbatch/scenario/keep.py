"""What a user may write of the runs to keep with their full histories."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Field as Limits
from pydantic import ValidationInfo

from tbatch.engine.runs import CHANNELS
from tbatch.scenario.errors import Findings
from tbatch.scenario.fields import Field, Quantity, Word, kind_of, refuse
from tbatch.scenario.run_name import parse_run_name, run_name
from tbatch.scenario.section import Section

_MOST_KEPT = 1000


@dataclass(frozen=True)
class Timelines(Field):
    """``"worst:3"``, ``"none"`` or a list of run names; a list is kept as a tuple."""

    accepted: ClassVar[str] = (
        f'"worst:0" to "worst:{_MOST_KEPT}" (per speed), "none", or a list of run names such as ["c03-s000127"]'
    )

    def check(self, value: Any, info: ValidationInfo) -> str | tuple[str, ...]:
        """Return the text, or the names."""
        if isinstance(value, str):
            match = re.fullmatch(r"worst:(\d{1,4})", value, re.ASCII)
            if value == "none" or (match is not None and int(match[1]) <= _MOST_KEPT):
                return value
            refuse("is not understood", self.accepted)
        if not isinstance(value, list | tuple):
            refuse(f"is {kind_of(value)}", self.accepted)
        for index, name in enumerate(value):
            try:
                parse_run_name(name if isinstance(name, str) else "")
            except ValueError:
                refuse(f"holds at [{index}] something that is not the name of a run", self.accepted)
        if not 1 <= len(value) <= _MOST_KEPT or len(set(value)) < len(value):
            refuse("is empty, too long, or names a run twice", self.accepted)
        return tuple(value)

    def accepts(self, context: Mapping[str, Any] | None) -> str:
        """Return the three ways."""
        return self.accepted

    def json_schema(self) -> dict[str, Any]:
        """Return word-or-list."""
        names = {"type": "array", "items": {"type": "string", "pattern": r"^c\d{2,}-s\d{6,}$"}, "minItems": 1}
        return {"anyOf": [{"type": "string", "pattern": r"^(none|worst:\d{1,4})$"}, names]}


class Keep(Section):
    """Which runs are kept with their full histories, and how much of them."""

    timelines: Annotated[str | tuple[str, ...], Timelines()] = "worst:3"
    """Of each speed the worst (longest separation, then largest force), named runs, or none."""
    channels: Annotated[
        tuple[Annotated[str, Word(CHANNELS)], ...] | None, Limits(min_length=1, max_length=len(CHANNELS))
    ] = None
    """What is kept; by default all that a dashboard shows."""
    every: Annotated[float | None, Quantity("s", 1e-7, 10.0)] = None
    """Time between kept samples [s], a whole multiple of the step; by default about 0.1 ms."""

    @property
    def worst(self) -> int:
        """How many of the worst runs of each speed to keep."""
        text = self.timelines
        return int(text.removeprefix("worst:")) if isinstance(text, str) and text != "none" else 0

    @property
    def runs(self) -> tuple[tuple[int, int], ...]:
        """The named runs to keep, as (case, sample)."""
        return () if isinstance(self.timelines, str) else tuple(parse_run_name(name) for name in self.timelines)


def complete_keep(keep: Keep, track_kind: str, step: float, cases: int, samples: int, findings: Findings) -> Keep:
    """Return the table with its channels and the time between samples.

    Args:
        keep: The table as read.
        track_kind: Kind of the track, which decides the channels there are.
        step: Time step [s].
        cases: Number of speeds.
        samples: Samples per speed.
        findings: Takes what does not fit.
    """
    layers = {"slab": ("rail", "slab", "base"), "rigid": ()}.get(track_kind, ("rail",))
    under = tuple(f"{layer}_under_wheel" for layer in layers if layer != "base")
    channels = keep.channels
    if channels is None:
        channels = ("contact_force", "vehicle", "vehicle_acceleration", *under, *layers, "irregularity")
    for index, channel in enumerate(channels):
        if channel.startswith(("rail", "slab", "base")) and not channel.startswith(layers):
            message = f"does not exist on a {track_kind} track"
            findings.refuse(("keep", "channels", index), message, value=channel, accepted="a layer of the track")
    wanted = 1e-4 if keep.every is None else keep.every
    whole = max(1, round(wanted / step))
    every = whole * step
    if keep.every is not None and abs(keep.every - every) > 1e-9 * every:
        accepted = f"a whole multiple of integration.step = {step:g} s, such as {every:g} s"
        findings.refuse(("keep", "every"), "falls between the steps", value=keep.every, accepted=accepted)
    for index, (case, sample) in enumerate(keep.runs):
        if case >= cases or sample >= samples:
            accepted = f"up to {run_name(cases - 1, samples - 1)}: {cases} speeds, {samples} samples each"
            message = "is not a run of this campaign"
            findings.refuse(("keep", "timelines", index), message, value=keep.timelines[index], accepted=accepted)
    return keep.model_copy(update={"channels": channels, "every": every})
