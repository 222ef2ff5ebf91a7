"""The methods of a comparison as a recording."""

import numpy as np

import tbatch as tb
from tbatch.methods.case import Case
from tbatch.methods.comparison import compare
from tbatch.view.overlaid_methods import BEYOND, overlaid_methods
from tbatch.view.overlay import difference, overlay_sheet
from tbatch.view.timeline import write_overlay


def test_a_page_a_step_shows_every_method_beside_the_reference(tmp_path):
    """A column over 2 m of track with a bump: small enough for the methods that run one step at a time."""
    vehicle = tb.Vehicle.column("koh-column")
    track = tb.Track.winkler("koh-winkler", length=12.0, elements=24)
    model = tb.Model.build(vehicle, track, tb.Contact.hertz(wheel_radius=0.4575), step=2e-4)
    rough = tb.Irregularity.cosines([1.0], [2e-4], [0.0]).taper(5.0, 0.5)
    case = Case(name="bump", model=model, speed=30.0, irregularity=rough, start=5.0, duration=0.04)
    comparison = compare(case, steps=(4e-4,), methods=("two-step", "NML", "NMN"), reference_step=5e-5)
    overlay = overlaid_methods(comparison)
    assert [page.name for page in overlay.pages] == ["step 0.2 ms", "step 0.4 ms"]
    for page in overlay.pages:
        assert [one.name for one in page.responses] == ["reference", "two-step", "NML", "NMN"]
        scores = [score for score in comparison.scores if page.name == f"step {1e3 * score.step:g} ms"]
        for method, score in zip(page.responses[1:], scores, strict=True):
            assert method.name == score.method
            # The same measure as the comparison's own: the largest force error against the same law, in static loads.
            largest = np.abs(difference(method, page.responses[0], "force/wheel_1").values).max()
            np.testing.assert_allclose(largest, score.error_own["force"], rtol=1e-6)
            assert np.nanmax(np.abs(method.values["force/wheel_1"])) <= BEYOND
    sheet = overlay_sheet(overlay)
    assert "step 0.4 ms" in sheet
    assert "no error of a time integration" in sheet
    assert write_overlay(overlay, tmp_path / "methods.rrd").stat().st_size > 10_000
