import os
import socket
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent.parent / "campaign"))  # the toy campaign

from synthetic_run import synthetic_record

from tbatch.view.record import RunRecord
from tbatch.view.viewer import find_binary


@pytest.fixture(scope="session")
def record() -> RunRecord:
    """A coach that loses contact twelve times at a dip."""
    return synthetic_record(seed=2, scale=0.75)


@pytest.fixture
def spawn(tmp_path):
    """Starts a viewer without a window, or skips where there is no graphics device."""
    from rerun.experimental import ViewerClient

    os.environ.setdefault("XDG_RUNTIME_DIR", str(tmp_path))

    def start():
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        try:
            client = ViewerClient.spawn(headless=True, port=port, executable_path=str(find_binary()))
            client.get_state()
        except (ConnectionError, RuntimeError, TimeoutError) as error:
            pytest.skip(f"no Vulkan device for the viewer (mesa-vulkan-drivers has a software one): {error}")
        return client

    return start
