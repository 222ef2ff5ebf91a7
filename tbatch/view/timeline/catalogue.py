"""The table of a campaign's recordings in the viewer: a catalogue server on the loopback, and a viewer on it.

    python -m tbatch.view.timeline.catalogue VIEWER NAME RUN.rrd... [-- ENVELOPE.rrd...]

A process of its own, which stays as long as its viewer is open. It says ``open`` when the viewer has come up.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import rerun as rr
from rerun.blueprint import table
from rerun.catalog import CatalogClient, DatasetEntry

STARTED = 3.0  # a viewer that lives this long has found its display and its graphics device [s]
COLUMNS = (
    ("rerun_segment_id", "run"),
    ("property:run:speed_kmh", "km/h"),
    ("property:run:separations", "separations"),
    ("property:run:longest_ms", "longest, ms"),
    ("property:run:force_max_kN", "max force, kN"),
    ("property:run:seed", "seed"),
    ("property:run:sample", "sample"),
    ("property:run:status", "status"),
)
"""Columns of the table: where the viewer finds them, and what they are called."""
HIDDEN = ("property:RecordingInfo:name", "property:run:case", "property:run:step_ms")


class Catalogue:
    """Serves recordings on the loopback while it is entered."""

    def __init__(self, name: str, runs: Sequence[Path], envelopes: Sequence[Path] = ()) -> None:
        """Takes what is to be served.

        Args:
            name: The campaign's name.
            runs: Recordings of runs.
            envelopes: Recordings of envelopes.
        """
        plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name)  # all that a table's name may have (rerun 0.41)
        datasets = {plain: list(runs), f"{plain}-envelopes": list(envelopes)}
        self._datasets = {key: files for key, files in datasets.items() if files}
        self._folder = tempfile.TemporaryDirectory(prefix="tbatch-catalogue-")

    def __enter__(self) -> Catalogue:
        """Starts the server; the layouts are registered before a viewer asks for them."""
        self._server = rr.server.Server(host="127.0.0.1", port=0, datasets=self._datasets)  # type: ignore[arg-type]
        self.url = self._server.url()
        """What a viewer opens: the first table."""
        client = _client(self.url)
        for number, (name, files) in enumerate(self._datasets.items()):
            dataset = client.get_dataset(name)
            self._register(dataset, files[0])
            if number == 0:
                self.url = f"{self._server.url()}/entry/{dataset.id}"
        return self

    def __exit__(self, *_: object) -> None:
        """Stops the server."""
        self._server.shutdown()
        self._folder.cleanup()

    def _register(self, dataset: DatasetEntry, first: Path) -> None:
        """Registers the layout of the table, and that of a recording.

        A server takes no layout from a recording by itself, and has one for all recordings of a table (rerun 0.41).
        """
        dataset.register_blueprint(first.absolute().as_uri())
        rows = Path(self._folder.name) / f"{dataset.id}.rbl"
        run_table().save(str(dataset.id), rows)
        dataset.register_blueprint(rows.as_uri(), segment_table=True)


def run_table() -> table.TableBlueprint:
    """The table: the most separations first, to be sorted by any other column with a click."""
    columns = [table.Column(source, name=name) for source, name in COLUMNS]
    columns += [table.Column(source, visible=False) for source in HIDDEN]
    worst = table.SortBy("property:run:separations", direction="descending")
    return table.TableBlueprint(table_layout=table.TableLayout(columns=columns), sort_by=worst)


def _client(url: str) -> CatalogClient:
    """A client of the server without DataFusion, 200 MB that only its queries need (rerun 0.41)."""
    from rerun_bindings import CatalogClientInternal

    return CatalogClient._from_internal(CatalogClientInternal(url, None, None))


def main(arguments: Sequence[str]) -> int:
    """Serves and opens until the viewer is closed."""
    viewer, name, *files = arguments
    at = files.index("--") if "--" in files else len(files)
    runs, envelopes = [Path(file) for file in files[:at]], [Path(file) for file in files[at + 1 :]]
    with Catalogue(name, runs, envelopes) as catalogue:
        window = subprocess.Popen([viewer, "--bind", "127.0.0.1", "--port", "auto", catalogue.url])
        try:
            window.wait(STARTED)
        except subprocess.TimeoutExpired:
            print("open", flush=True)
        return window.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
