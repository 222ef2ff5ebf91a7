"""The report is one page that needs nothing else, and each figure's numbers lie beside it."""

import base64
import math
import re
import shutil
import subprocess
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("matplotlib")

import tbatch as tb
from tbatch import __version__
from tbatch.campaign.estimates import Estimate
from tbatch.campaign.run import run
from tbatch.scenario import Scenario
from tbatch.view.report import write_report
from tbatch.view.report.against_speed import by_wheelset
from tbatch.view.report.depth import extremes_picture, sensitivity_picture, varied_picture
from tbatch.view.report.histories import marked_frequencies

RUNS = 24


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    short = [
        f"campaign.runs={RUNS}",
        "run.distance=9 m",
        "run.evaluate_from=1 m",
        'keep.timelines="none"',
        'limits."load_ratio.max.p95".max=1.5',
    ]
    return run(Scenario.load("quick", overrides=short), out=tmp_path_factory.mktemp("quick"))


@pytest.fixture(scope="module")
def folder(campaign, tmp_path_factory):
    return write_report(campaign, tmp_path_factory.mktemp("report")).parent


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "index.html").read_text(encoding="utf-8")


def figures(page):
    return re.findall(r"<svg .*?</svg>", page, flags=re.DOTALL)


def test_the_page_needs_nothing_from_elsewhere(page):
    assert "<script" not in page
    addresses = re.findall(r"""(?:src|href|url)\s*[=(]\s*["']?([^"')\s>]+)""", page)
    assert all(address.startswith(("data:text/csv", "#")) for address in addresses), addresses
    assert "@import" not in page


def test_every_figure_is_sound_and_says_what_it_rests_on(page):
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", page, flags=re.DOTALL)
    assert len(figures(page)) == len(captions) >= 14
    for svg, caption in zip(figures(page), captions, strict=True):
        root = ElementTree.fromstring(svg)
        assert root.get("aria-label")
        assert f"{2 * RUNS} runs, seed 1, samples 0 to {RUNS - 1}; tbatch {__version__}." in caption
        assert re.search("95 %|without an interval", caption), caption


def test_no_two_figures_share_an_id(page):
    per_figure = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in figures(page)]
    assert len(set.union(*per_figure)) == sum(map(len, per_figure))


def test_axes_have_units_in_brackets(page):
    for svg in figures(page):
        words = [text for text in re.findall(r"<text[^>]*>([^<]+)</text>", svg) if re.search("[a-z]{3}", text)]
        assert any(re.search(r"\[[^\]]+\]", text) for text in words)


def test_the_numbers_behind_each_figure_are_in_the_page_and_beside_it(page, folder):
    links = re.findall(r'download="([^"]+)" href="data:text/csv;base64,([^"]+)"', page)
    assert {name for name, _ in links} == {path.name for path in (folder / "csv").iterdir()}
    for name, data in links:
        content = base64.b64decode(data)
        assert content == (folder / "csv" / name).read_bytes()
        assert content.count(b"\n") > 1, name


def test_the_same_campaign_gives_the_same_page(campaign, folder, tmp_path):
    again = write_report(campaign, tmp_path)
    assert again.read_bytes() == (folder / "index.html").read_bytes()


def test_limits_stand_in_the_page_with_their_verdicts(page):
    assert page.count('<tr class="fail">') > 0
    assert "load_ratio.max.p95" in page


def test_none_seen_is_an_arrow_to_the_upper_limit():
    def one(value, low, high):
        return {"separation.probability": Estimate("separation.probability", "", value, low, high, "exact", 100, 0)}

    table = {(0, 1): one(0.0, 0.0, 0.036), (1, 1): one(0.5, 0.4, 0.6)}
    options = {"title": "t", "axis": "p [-]", "caption": "c"}
    picture = by_wheelset(table, [50.0, 60.0], [1], "separation.probability", **options)
    assert [row[3] for row in picture.rows] == [0.0, 0.5]
    empty = by_wheelset({(0, 1): one(0.0, 0.0, 0.036)}, [50.0], [1], "separation.probability", **options)
    ElementTree.fromstring(empty.svg)


def test_varied_numbers_have_figures_and_no_variation_has_none(campaign):
    units = campaign.records.units(0)
    assert sensitivity_picture(50.0, units) is None
    assert varied_picture(50.0, units) is None
    source = np.random.default_rng(1)
    units.inputs["vehicle.primary.stiffness"] = source.uniform(1e6, 2e6, len(units))
    picture, found = sensitivity_picture(50.0, units)
    assert {one.varied for one in found} == {"vehicle.primary.stiffness"}
    assert "vehicle.primary.stiffness" in picture.svg
    assert sum(row[-1] for row in varied_picture(50.0, units).rows) == len(units)
    del units.inputs["vehicle.primary.stiffness"]


def test_extremes_are_drawn_within_the_numbers(campaign):
    picture, fits = extremes_picture(50.0, campaign.records.units(1))
    assert [fit.family for fit in fits] == ["gumbel", "gev"]
    assert "1e30" not in picture.svg
    assert all(math.isfinite(row[2]) for row in picture.rows)


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs chromium")
def test_a_browser_shows_the_page(folder, tmp_path):
    from PIL import Image

    shot = tmp_path / "page.png"
    flags = (
        "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking"
        " --disable-component-update --disable-sync --hide-scrollbars --window-size=1100,4000"
    )
    command = ["chromium", *flags.split(), f"--user-data-dir={tmp_path}", f"--screenshot={shot}"]
    subprocess.run([*command, (folder / "index.html").as_uri()], check=True, capture_output=True, timeout=120)
    pixels = np.asarray(Image.open(shot).convert("L"), float)
    assert (pixels < 200).mean() > 0.005  # ink
    assert (pixels > 250).mean() > 0.5  # paper


def test_a_run_without_any_separation_has_a_report_too(tmp_path):
    short = ["run.distance=6 m", "run.evaluate_from=1 m", 'keep.timelines="none"']
    campaign = run(Scenario.load("smooth_track", overrides=short), out=tmp_path / "smooth")
    page = write_report(campaign, tmp_path / "report", histories=False).read_text(encoding="utf-8")
    assert len(figures(page)) >= 10
    for svg in figures(page):
        ElementTree.fromstring(svg)


def test_marked_frequencies_are_those_of_seats_and_of_the_wheelset_on_the_track():
    coach, contact = tb.Vehicle.coach("seed-multiwheel"), tb.Contact.hertz(wheel_radius=0.46)
    slab = tb.Model.build(coach, tb.Track.slab("seed-slab", length=65.0), contact, step=1e-4)
    marks = marked_frequencies(slab, 65.0)
    assert marks["fasteners"] == pytest.approx(100.0)
    assert 30.0 < marks["P2"] < 120.0
    rigid = tb.Model.build(coach, tb.Track.rigid(length=10.0), contact, step=1e-4)
    assert marked_frequencies(rigid, 30.0) == {}
