"""Every estimate of a campaign in one table: as plain data, and for people."""

import math
from collections.abc import Iterator
from typing import Any

from tbatch.campaign.campaign import Campaign
from tbatch.campaign.estimates import ANY_WHEELSET, Estimate
from tbatch.campaign.estimates.sensitivity import Sensitivity, sensitivities
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
    return "\n\n".join([*blocks, *filter(None, [sensitivities_text(campaign)])])


def sensitivities_document(campaign: Campaign) -> list[dict[str, Any]]:
    """What the outcome of a run goes with, speed by speed, any wheelset, as plain data; empty if nothing varies."""
    return [{"speed": speed, **one.row()} for speed, found in _sensitivities(campaign) for one in found]


def sensitivities_text(campaign: Campaign) -> str:
    """The same as a table for people; empty if nothing varies."""
    titles = ["varied", "outcome", "rank corr.", "95 % from", "to", "share of variance", "95 % from", "to", "runs"]
    blocks = []
    for speed, found in _sensitivities(campaign):
        rows = [
            [
                one.varied,
                one.outcome,
                *map(_shown, (one.correlation, one.low, one.high, one.share, one.share_low, one.share_high)),
                str(one.runs),
            ]
            for one in found
        ]
        if rows:
            blocks.append("\n".join([f"{speed * KMH:.4g} km/h, any wheelset: sensitivity", *columns(titles, [], rows)]))
    return "\n\n".join(blocks)


def _sensitivities(campaign: Campaign) -> Iterator[tuple[float, list[Sensitivity]]]:
    for case, speed in enumerate(campaign.speeds):
        yield speed, sensitivities(campaign.records.units(case))


def all_estimates(campaign: Campaign) -> Iterator[tuple[Place, list[Estimate]]]:
    """Each place, with its speed [m/s] (None for all) and wheelset, and what is estimated there."""
    yield {"speed": None, "wheel": ANY_WHEELSET}, campaign.estimates()
    for case, speed in enumerate(campaign.speeds):
        for wheel in (*campaign.records.wheels, ANY_WHEELSET):
            yield {"speed": speed, "wheel": wheel}, campaign.estimates(case, wheel)


def _shown(value: float) -> str:
    """A number, or that these runs leave it open."""
    return format(value, ".4g") if math.isfinite(value) else "open"
