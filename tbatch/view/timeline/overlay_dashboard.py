"""The dashboard of a comparing recording: each quantity of all responses in one plot, and the differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from tbatch.view.overlay import Page, Panel
from tbatch.view.timeline.clock import CHAINAGE, TIME
from tbatch.view.timeline.contact import EVENTS, LANES, events_view, lanes_view
from tbatch.view.timeline.layout import View, close_up, framed, plot, stacked, tabbed, whole

NEARER = 0.2  # of the usual window: what is compared differs in details
OVERVIEW = "overview"
MOST_LANES = 8
MOST_ROWS = 4  # plots above each other; further ones stand behind them


@dataclass(frozen=True)
class Place:
    """Where the entities of a page are."""

    page: Page
    prefix: str
    """Of all its paths; empty, or ending in a slash."""
    thinned: bool
    """Whether whole runs are shown by an overview of extremes."""

    @property
    def events(self) -> str:
        """The entity of its log."""
        return f"{self.prefix}{EVENTS}"

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        return sum(panel.key.startswith("force/wheel_") for panel in self.page.panels)

    @property
    def lanes(self) -> bool:
        """Whether there is room for the lanes of all responses."""
        return self.wheel_count * len(self.page.responses) <= MOST_LANES

    def whole_run(self, panel: Panel) -> str:
        """The entity that shows a panel's whole run."""
        return f"{self.prefix}{OVERVIEW}/{panel.key}" if self.thinned else f"{self.prefix}{panel.key}"


def overlay_dashboard(places: Sequence[Place]) -> rrb.Blueprint:
    """Lay out all pages, the first one in front."""
    pages = [_page(place, alone=len(places) == 1) for place in places]
    first = places[0].page
    timeline = TIME if all(place.page.same_speed for place in places) else CHAINAGE
    views: View = pages[0] if len(pages) == 1 else rrb.Tabs(*pages)
    return framed(views, speed=first.responses[0].speed, timeline=timeline)


def _page(place: Place, *, alone: bool) -> rrb.Horizontal:
    page = place.page
    main = [panel for panel in page.panels if panel.row]
    names = list(dict.fromkeys(panel.row for panel in main))
    rows = [[panel for panel in main if panel.row == name] for name in names]
    if len(rows) > MOST_ROWS:
        rows = [main]
    left: list[tuple[float, View]] = []
    for row in rows:
        left.append((1.6, tabbed([plot(place.whole_run(panel), panel.title, legend=row is rows[0]) for panel in row])))
    if place.lanes:
        count = place.wheel_count * len(page.responses)
        left.append((0.5 + 0.4 * count, lanes_view(whole(), origin=f"{LANES}/{place.prefix}".rstrip("/"))))
    near = [close_up(f"{place.prefix}{panel.key}", f"{panel.title}, at the cursor", NEARER) for panel in main]
    further = [panel for panel in page.panels if not panel.row]
    differences = [
        plot(f"{place.prefix}difference/{panel.key}", f"Δ {panel.title}", legend=False) for panel in page.panels
    ]
    right: list[tuple[float, View]] = [(2.0, tabbed(near)), (2.0, tabbed(differences))]
    if further:
        right.append((1.6, tabbed([plot(place.whole_run(panel), panel.title, legend=False) for panel in further])))
    sheet = rrb.TextDocumentView(origin="/sheet", name="Compared")
    right.append((2.4, rrb.Tabs(sheet, events_view(origin=place.events))))
    return rrb.Horizontal(stacked(left), stacked(right), column_shares=[2.0, 1], name=None if alone else page.name)
