"""A look at a campaign in the viewer: the table of its runs, one of them, and an envelope."""

import time
from dataclasses import replace

import numpy as np
import pytest
from headless import colours, count, settled

from tbatch.view.envelope import LEVELS, Envelope
from tbatch.view.palette import WARNING, wheel_colour
from tbatch.view.timeline import write_envelope, write_recording


@pytest.fixture
def catalogue(record, tmp_path):
    from tbatch.view.timeline.catalogue import Catalogue

    runs = []
    for sample in range(3):
        name = f"c03-s00000{sample}"
        properties = {**record.properties, "separations": sample, "longest_ms": 1.5, "sample": sample}
        runs.append(write_recording(replace(record, name=name, properties=properties), tmp_path / f"{name}.rrd"))
    place = np.linspace(40.0, 80.0, 200)
    wave = np.sin(place)[:, None]
    level = np.linspace(3.0, 0.2, len(LEVELS))
    envelope = Envelope(
        "synthetic", 3, 83.3, 100, place, level + 0.1 * wave, 0.02 + 0.01 * wave[:, 0], np.full(200, 400)
    )
    with Catalogue("synthetic", runs, [write_envelope(envelope, tmp_path / "envelope-c03.rrd")]) as catalogue:
        yield catalogue


@pytest.mark.slow
def test_a_campaign_s_table_runs_and_envelopes_can_be_seen(catalogue, spawn):
    from tbatch.view.timeline.catalogue import _client

    client = _client(catalogue.url.partition("/entry/")[0])
    with spawn() as viewer:
        viewer.open(catalogue.url)
        time.sleep(4.0)
        seen = settled(viewer.take_screenshot)
        assert seen.std() > 8  # a table is mostly dark
        greenish = (seen[..., 1] - seen[..., 0] > 40) & (seen[..., 1] > 120)
        assert greenish.sum() > 300  # the numbers of three rows
        for dataset, segment in (
            ("synthetic", "synthetic-c03-s000001"),
            ("synthetic-envelopes", "synthetic-envelope-c03"),
        ):
            viewer.open(client.get_dataset(dataset).segment_url(segment))
            time.sleep(3.0)
            seen = settled(viewer.take_screenshot)
            assert colours(seen) > 60
            state = viewer.get_state()
            assert [(view.name, report.summary) for view in state.views for report in view.reports] == []
            # Its own layout and not one that the viewer makes up.
            assert count(seen, wheel_colour(1) if dataset == "synthetic" else WARNING) > 100
