"""Who watches a campaign while it runs: told of it at its begin, and asked which runs of each batch it would follow.

An observer only looks. What it is shown depends on nothing it does, and what is stored does not depend on it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from tbatch.campaign.campaign import Campaign


@dataclass(frozen=True)
class Following:
    """Runs of a batch whose histories an observer is shown while they are stepped."""

    save: Any
    """Which runs, by their place in the batch, and which channels: a SaveAt with ``runs``."""
    take: Callable[[Any], None]
    """Takes each piece of their histories; is to return at once."""


class Observer(Protocol):
    """Watches a campaign."""

    def begin(self, campaign: "Campaign") -> None:
        """Is told of the campaign before its first batch."""
        ...

    def follow(self, pairs: Sequence[tuple[int, int]]) -> Following | None:
        """Says which of the runs that are simulated next it would follow; None for none."""
        ...
