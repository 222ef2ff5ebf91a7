"""Percentiles along the line: no peak is lost, no value is invented, and they are those of the stored runs."""

import subprocess
from itertools import pairwise

import numpy as np
import pytest

from tbatch.campaign.run import run
from tbatch.scenario import Scenario
from tbatch.view.envelope import LEVELS, envelope_runs, make_envelope, percentiles
from tbatch.view.passages import passage
from tbatch.view.timeline import write_envelope
from tbatch.view.viewer import find_binary

SHORT = ["run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"']


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return run(Scenario.load("quick", overrides=SHORT), out=tmp_path_factory.mktemp("campaign"))


@pytest.fixture(scope="module")
def envelope(campaign):
    return make_envelope(campaign, 1, envelope_runs(campaign, 1))


def test_a_passage_shows_the_extremes_of_each_bin_and_nothing_of_bins_it_did_not_cross():
    random = np.random.default_rng(5)
    position = 3.0 + 0.013 * np.arange(400)
    ratio = random.random(400)
    ratio[350:] = np.nan  # the run ended there, at x = 7.55 m
    edges = np.arange(2.0, 10.1, 0.5)
    least, middle, largest = passage(position, ratio, edges)
    for k, (low, high) in enumerate(pairwise(edges)):
        inside = (position >= low) & (position < high) & np.isfinite(ratio)
        if low >= 3.0 and high <= 7.55:
            assert (least[k], largest[k]) == (ratio[inside].min(), ratio[inside].max())
            assert least[k] <= middle[k] <= largest[k]
        else:
            assert np.isnan([least[k], middle[k], largest[k]]).all()


def test_percentiles_are_values_that_passages_have():
    random = np.random.default_rng(6)
    values = random.random((1000, 3))
    values[900:, 2] = np.nan  # a hundred passages did not come so far
    curves = percentiles(values, values, values)
    for k, (_, level) in enumerate(LEVELS):
        expected = [np.quantile(one[np.isfinite(one)], 0.01 * level, method="inverted_cdf") for one in values.T]
        np.testing.assert_array_equal(curves[:, k], expected)
    assert np.isnan(percentiles(*[np.full((4, 1), np.nan)] * 3)).all()


def test_the_highest_point_of_an_envelope_is_the_largest_force_stored(campaign, envelope):
    wheels = [row for row in campaign.table("wheels").to_pylist() if row["case"] == 1]
    stored = max(row["force_max"] / row["static_load"] for row in wheels)
    # Two ways to the static load: of the vehicle at rest, and the force at the run's begin; equal to round-off.
    assert np.nanmax(envelope.ratio[:, 0]) == pytest.approx(stored, rel=1e-9)
    assert envelope.runs == 4
    assert envelope.passages.max() == 4 * 2  # the rear bogie does not come so far
    assert (np.diff(envelope.ratio[envelope.passages > 0], axis=1) <= 0.0).all()  # the curves never cross


def test_the_share_that_loses_contact_is_where_separations_are_stored(campaign, envelope):
    # Statistics of a wheel begin with the envelope's first bin, so every stored separation lies in some bin.
    events = [row for row in campaign.table("events").to_pylist() if row["case"] == 1]
    assert events
    half = 0.5 * (envelope.place[1] - envelope.place[0])
    for event in events:
        k = int(np.argmin(np.abs(envelope.place - event["position"])))
        if abs(envelope.place[k] - event["position"]) < half:
            assert envelope.separated[k] > 0.0
    assert np.nanmax(envelope.separated) <= 1.0


def test_an_envelope_is_made_from_sound_runs_alone_and_not_from_more_than_take_seconds(campaign, monkeypatch):
    assert envelope_runs(campaign, 0) == [0, 1, 2, 3]
    monkeypatch.setattr("tbatch.view.envelope.MOST_RUN_STEPS", 1.0)
    assert envelope_runs(campaign, 0) == [0]
    monkeypatch.setattr("tbatch.view.envelope.MOST_RUNS", 2)
    monkeypatch.setattr("tbatch.view.envelope.MOST_RUN_STEPS", 1e9)
    assert envelope_runs(campaign, 0) == [0, 1]


def test_fewer_runs_together_give_the_same_envelope(campaign, envelope, monkeypatch):
    monkeypatch.setattr("tbatch.view.passages.MOST_MEMORY", 1.0)
    alone = make_envelope(campaign, 1, [0, 1, 2, 3])
    np.testing.assert_array_equal(alone.ratio, envelope.ratio)


def test_a_recorded_envelope_verifies_and_is_the_same_when_written_again(envelope, tmp_path, monkeypatch):
    import rerun as rr

    rr.set_strict_mode(True)
    try:
        paths = [write_envelope(envelope, tmp_path / f"{name}.rrd") for name in ("one", "two")]
    finally:
        rr.set_strict_mode(False)
    for command in (["verify"], ["compare", "--unordered"]):
        done = subprocess.run([str(find_binary()), "rrd", *command, *map(str, paths)], capture_output=True, timeout=120)
        assert done.returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.rrd", "two.rrd"]
