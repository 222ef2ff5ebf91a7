"""Every estimate of a campaign in one table: as plain data, and for people."""

import math
from collections.abc import Iterator
from typing import Any

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import ANY_WHEELSET, Estimate
from tbatch.campaign.summary import KMH, columns

Place = dict[str, Any]


def estimates_document(campaign: Campaign) -> list[dict[str, Any]]:
    """Every estimate as plain data: of the campaign, and per speed of any wheelset and of each."""
    return [{**place, **estimate.row()} for place, found in all_estimates(campaign) for estimate in found]


def estimates_text(campaign: Campaign) -> str:
    """Every estimate as a table for people, in SI units, with the remarks on those that rest on too few runs."""
    blocks = []
    for place, found in all_estimates(campaign):
        speed = "all speeds, by sample" if place["speed"] is None else f"{place['speed'] * KMH:.4g} km/h"
        wheel = "any wheelset" if place["wheel"] == ANY_WHEELSET else f"wheelset {place['wheel']}"
        rows = [[one.name, *map(_shown, (one.value, one.low, one.high)), one.unit or "-", one.flag] for one in found]
        lines = columns(["estimate", "value", "95 % from", "to", "unit", "remark"], [], rows)
        blocks.append("\n".join([f"{speed}, {wheel}", *lines]))
    return "\n\n".join(blocks)


def all_estimates(campaign: Campaign) -> Iterator[tuple[Place, list[Estimate]]]:
    """Each place, with its speed [m/s] (None for all) and wheelset, and what is estimated there."""
    yield {"speed": None, "wheel": ANY_WHEELSET}, campaign.estimates()
    for case, speed in enumerate(campaign.speeds):
        for wheel in (*campaign.records.wheels, ANY_WHEELSET):
            yield {"speed": speed, "wheel": wheel}, campaign.estimates(case, wheel)


def _shown(value: float) -> str:
    """A number, or that these runs leave it open."""
    return format(value, ".4g") if math.isfinite(value) else "open"
