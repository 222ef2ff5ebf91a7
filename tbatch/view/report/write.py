"""From a campaign to its report: ``report/index.html`` and ``report/csv/``."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from tbatch import __version__
from tbatch.campaign.campaign import Campaign
from tbatch.campaign.durable import make_folder, write_bytes
from tbatch.campaign.estimates import ALL_SPEEDS, ANY_WHEELSET, Estimate, Units
from tbatch.campaign.limits import judge, stored_limits
from tbatch.view.report import curves, depth, tables
from tbatch.view.report.drawing import Picture
from tbatch.view.report.envelopes import envelope_pictures
from tbatch.view.report.histories import history_pictures
from tbatch.view.report.page import csv_text, figure_html, page_html, table_html
from tbatch.view.report.rare_loads import rare_loads_picture
from tbatch.view.report.ride import ride_picture
from tbatch.view.report.spectra import surface_picture

KMH = 3.6
MOST_SPEEDS = 5  # in a figure with a curve for each


def write_report(
    campaign: Campaign, folder: Path, *, histories: bool = True, message: Callable[[str], None] = lambda text: None
) -> Path:
    """Writes the report of a campaign and returns the page's path.

    Args:
        campaign: The campaign.
        folder: Where to write; made if it is missing.
        histories: Whether to simulate some runs again and draw what becomes of them along the line.
        message: Is told what is being done, where that takes long.
    """
    places = [
        (case, wheel) for case in range(len(campaign.speeds)) for wheel in (*campaign.records.wheels, ANY_WHEELSET)
    ]
    units = {case: campaign.records.units(case) for case in range(len(campaign.speeds))}
    found = {(case, wheel): {one.name: one for one in campaign.estimates(case, wheel)} for case, wheel in places}
    whole = {one.name: one for one in campaign.estimates(ALL_SPEEDS)}
    basis = tables.basis(campaign)
    pictures, notes = _pictures(campaign, units, found)
    if histories:
        telling = _telling_case(units)
        some = {case: units[case] for case in _spread(len(campaign.speeds))}
        at = f"at {KMH * campaign.speeds[telling]:.4g} km/h"
        message(f"simulating runs again: along the line at {len(some)} speed{'s' * (len(some) > 1)}")
        pictures["Along the line"] = envelope_pictures(campaign, some)
        message(f"simulating runs again: rare loads {at}")
        if (rare := rare_loads_picture(campaign, telling)) is not None:
            pictures["Along the line"].append(rare)
        message("simulating runs again: ride and single runs")
        ride = ride_picture(campaign, _spread(len(campaign.speeds)))
        if isinstance(ride, str):
            notes["Along the line"] = [f'<p class="note">{tables.escape(ride)}</p>']
        else:
            pictures["Ride"] = [ride]
        pictures["Single runs"] = history_pictures(campaign, telling, units[telling])
        if (surface := surface_picture(campaign, units[telling])) is not None:
            pictures["The running surface"] = [surface]
    parts = [
        f"<h1>{tables.escape(campaign.name)}</h1>",
        '<p class="note">Wheel-rail separation statistics. Intervals are 95 %; the run is the statistical unit.</p>',
        tables.facts(campaign),
        "<h2>Separations by speed, any wheelset</h2>",
        tables.headline(campaign, found, whole),
        "<details><summary>By wheelset</summary>" + tables.by_wheelset(campaign, found) + "</details>",
        _limits(campaign),
    ]
    for heading, group in pictures.items():
        parts.append(f"<h2>{heading}</h2>")
        parts += [figure_html(picture, basis) for picture in group]
        parts += notes.get(heading, [])
    parts.append("<h2>Every estimate</h2>" + tables.every(campaign, found, whole))
    make_folder(folder / "csv")
    for picture in (picture for group in pictures.values() for picture in group):
        write_bytes(folder / "csv" / f"{picture.name}.csv", csv_text(picture).encode())
    path = folder / "index.html"
    write_bytes(path, page_html(f"{campaign.name}: tbatch {__version__}", parts).encode())
    return path


def _pictures(
    campaign: Campaign, units: Mapping[int, Units], found: Mapping[tuple[int, int], Mapping[str, Estimate]]
) -> tuple[dict[str, list[Picture]], dict[str, list[str]]]:
    """The figures by heading, and tables that belong to them."""
    speeds, wheels = campaign.speeds, [*campaign.records.wheels]
    telling = _telling_case(units)
    speed, one = speeds[telling], units[telling]
    pictures: dict[str, list[Picture]] = {"Against the speed": tables.speed_pictures(found, speeds, wheels)}
    limits = tables.limit_lines(campaign)
    ensemble = {speeds[case]: units[case] for case in _spread(len(speeds))}
    pictures["Distributions"] = [
        curves.load_exceedance(ensemble, limits),
        curves.event_sizes(ensemble),
        curves.event_forces(ensemble),
        curves.positions(speed, one),
    ]
    pictures["EN 14363: 20 Hz"] = [
        tables.filtered_picture(found, speeds),
        curves.filtered_exceedance(ensemble, limits),
        curves.time_shares(ensemble),
    ]
    notes: dict[str, list[str]] = {}
    settling, followed = depth.convergence_picture(speed, one)
    pictures["How far to trust it"] = [settling]
    if (extremes := depth.extremes_picture(speed, one)) is not None:
        pictures["How far to trust it"].append(extremes[0])
        notes["How far to trust it"] = [tables.fits(extremes[1])]
    notes.setdefault("How far to trust it", []).append(depth.settling_table(followed))
    varied: list[Picture] = []
    if (sensitivity := depth.sensitivity_picture(speed, one)) is not None:
        varied.append(sensitivity[0])
    if (picture := depth.varied_picture(speed, one)) is not None:
        varied.append(picture)
    if varied:
        pictures["What it depends on"] = varied
    return pictures, notes


def _limits(campaign: Campaign) -> str:
    verdicts = judge(campaign, stored_limits(campaign))
    rows = [["pass" if one.passed else "FAIL", one.limit, one.place, one.message, one.source] for one in verdicts]
    failed = [index for index, one in enumerate(verdicts) if not one.passed]
    titles = ["", "limit", "where", "found", "source"]
    return "<h2>Limits</h2>" + table_html(titles, rows, text=5, failed=failed)


def _telling_case(units: Mapping[int, Units]) -> int:
    """The speed whose runs say most: some separate and some do not; the fastest of several that say as much."""

    def worth(case: int) -> float:
        separated = np.nan_to_num(units[case]["separations"]) > 0
        share = float(separated.mean()) if len(separated) else 0.0
        return round(share * (1.0 - share), 6)

    return max(units, key=lambda case: (worth(case), case))


def _spread(count: int) -> list[int]:
    """At most ``MOST_SPEEDS`` cases, evenly, both ends among them."""
    return sorted({int(place) for place in np.linspace(0, count - 1, min(count, MOST_SPEEDS)).round()})
