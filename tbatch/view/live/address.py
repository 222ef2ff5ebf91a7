"""Where a live view is served, and how to look at it from this machine or from another one."""

from __future__ import annotations

import getpass
import socket
from dataclasses import dataclass
from urllib.parse import quote

LOOPBACK = "127.0.0.1"  # nobody else on the network is shown anything
PORT = 9876  # rerun's own
WEB_PORT = 9090


@dataclass(frozen=True)
class Address:
    """Ports of a live view on the loopback."""

    port: int
    web_port: int | None = None

    @classmethod
    def free(cls, *, web: bool) -> Address:
        """The usual ports, or others where they are taken.

        Args:
            web: Whether a port for the web viewer is needed.
        """
        return cls(_free_port(PORT), _free_port(WEB_PORT) if web else None)

    @property
    def url(self) -> str:
        """What a viewer connects to."""
        return f"rerun+http://{LOOPBACK}:{self.port}/proxy"

    @property
    def web_url(self) -> str | None:
        """What a browser opens."""
        if self.web_port is None:
            return None
        return f"http://{LOOPBACK}:{self.web_port}/?url={quote(self.url, safe='')}"

    def advice(self) -> str:
        """How to look from here and from elsewhere."""
        ports = [port for port in (self.web_port, self.port) if port is not None]
        tunnel = " ".join(f"-L {port}:{LOOPBACK}:{port}" for port in ports)
        here = f"rerun --connect {self.url}"
        lines = [f"live view, for this machine alone: {here}"]
        if self.web_url is not None:
            lines = [f"live view, for this machine alone, in a browser: {self.web_url}", f"  or in a window: {here}"]
        lines += [f"  from another machine: ssh {tunnel} {_who()}, then the same there"]
        return "\n".join(lines)


def _free_port(wanted: int) -> int:
    for port in (wanted, 0):
        with socket.socket() as probe:
            # Without it a port in use a minute ago would pass for taken.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((LOOPBACK, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise OSError(f"no free port on {LOOPBACK}")


def _who() -> str:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = "USER"
    return f"{user}@{socket.gethostname()}"
