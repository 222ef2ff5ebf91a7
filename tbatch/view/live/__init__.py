"""A campaign watched while it runs: what is told of it, how it gets out of this process, where to look at it.

The campaign's process only hands over small pieces of news and never waits for anybody. A process of its own draws
them, a server on the loopback passes them on to as many viewers as come and go: none of them can disturb the campaign.
"""

from tbatch.view.live.live_view import LiveView

__all__ = ["LiveView"]
