"""A scenario as a user may write it: its tables, but for the large ones that have files of their own."""

import re
from typing import Annotated

from tbatch.scenario.contact import ContactSection
from tbatch.scenario.fields import Count, Quantity, Text, Word
from tbatch.scenario.irregularity import IrregularitySection
from tbatch.scenario.keep import Keep
from tbatch.scenario.limits import LimitsSection
from tbatch.scenario.passage import Integration, RunSection, Speed
from tbatch.scenario.sampling import METHODS
from tbatch.scenario.section import Section
from tbatch.scenario.track import TrackSection
from tbatch.scenario.vary import Vary
from tbatch.scenario.vehicle import VehicleSection


def names_a_folder(name: str) -> bool:
    """Return whether a campaign may have this name: it also names its results folder."""
    return re.fullmatch(r"[A-Za-z0-9_](?:[A-Za-z0-9_. -]{0,78}[A-Za-z0-9_-])?", name, re.ASCII) is not None


class Stop(Section):
    """When a speed has runs enough, asked at fixed multiples of 64 runs; all that is given must hold."""

    min_events: Annotated[int, Count(0, 10_000_000)] = 0
    """Separations, of all wheelsets, that a speed needs."""
    rel_ci: Annotated[float, Quantity("", 1e-3, 10.0)] = 0.1
    """Half the 95 % interval of a speed's probability of separation, relative to the probability."""
    max_runs: Annotated[int, Count(1, 10_000_000)] = 100_000
    """Samples at which a speed stops in any case."""


class Campaign(Section):
    """What the campaign is called and how many runs it has."""

    name: Annotated[str, Text("1 to 80 letters, digits, '_', '-', '.' or spaces, to name a folder", names_a_folder)] = (
        ""
    )
    """Name, also of the results folder; by default the scenario file's."""
    runs: Annotated[int, Count(1, 10_000_000)] = 1
    """Samples per speed; with ``stop`` the least number."""
    seed: Annotated[int, Count(0, 2**63 - 1)] = 0
    """Seed of all random numbers."""
    stop: Stop | None = None
    """When a speed has runs enough; without it, each has ``runs``."""
    sampling: Annotated[str | None, Word(METHODS)] = None
    """How varied numbers are drawn, "random" by default."""
    plan: Annotated[int | None, Count(2, 65_536)] = None
    """Samples of each Latin hypercube, 64 by default."""


class Document(Section):
    """A tbatch scenario. Bare numbers are in SI units; strings carry a unit, as in "300 km/h"."""

    campaign: Campaign = Campaign()
    vehicle: VehicleSection
    track: TrackSection
    contact: ContactSection = ContactSection()
    irregularity: IrregularitySection = IrregularitySection()
    speed: Speed
    run: RunSection = RunSection()
    integration: Integration = Integration()
    vary: Vary = None
    """Numbers that differ from sample to sample: a distribution by dotted key."""
    keep: Keep = Keep()
    limits: LimitsSection = LimitsSection()  # type: ignore[valid-type]
