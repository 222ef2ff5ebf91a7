"""Chromium without a window, driven over its debugging pipe: no driver, no package."""

import base64
import json
import os
import shutil
import subprocess
import time
from pathlib import Path

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--window-size=1600,1000", "--remote-debugging-pipe",
)  # fmt: skip


def find_browser() -> str | None:
    """Its program, if there is one."""
    return next((path for name in PROGRAMS if (path := shutil.which(name))), None)


class Browser:
    """One page."""

    def __init__(self, profile: Path) -> None:
        """Starts it with an empty profile."""
        program = find_browser()
        assert program is not None
        take, self._to = os.pipe()
        self._from, give = os.pipe()
        # The pipe is expected at the descriptors 3 and 4.
        command = f'exec "$0" "$@" 3<&{take} 4>&{give}'
        self._process = subprocess.Popen(
            ["bash", "-c", command, program, *OPTIONS, f"--user-data-dir={profile}"],
            pass_fds=(take, give), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(take)
        os.close(give)
        self._buffer, self._number, self._session = b"", 0, None

    def __enter__(self) -> "Browser":
        """Gives itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Ends it."""
        self._process.kill()
        self._process.wait()
        os.close(self._to)
        os.close(self._from)

    def open(self, url: str) -> None:
        """Opens a page."""
        target = self._ask("Target.createTarget", url=url)["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def picture(self) -> bytes:
        """The page as PNG."""
        return base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])

    def _ask(self, method: str, **parameters: object) -> dict:
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + 120.0
        while time.monotonic() < until:
            while b"\0" not in self._buffer:
                more = os.read(self._from, 1 << 20)
                if not more:
                    raise ConnectionError("the browser has gone")
                self._buffer += more
            text, _, self._buffer = self._buffer.partition(b"\0")
            answer = json.loads(text)
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(answer["error"])
                return answer["result"]
        raise TimeoutError(method)
