import subprocess
from dataclasses import replace

import numpy as np
import pytest

from tbatch.campaign.run import run
from tbatch.scenario import Scenario
from tbatch.view.overlaid_runs import overlaid_runs, replay_with_steps
from tbatch.view.overlay import Overlay, Page, Panel, Response, difference, overlay_sheet
from tbatch.view.timeline import write_overlay
from tbatch.view.viewer import find_binary

SHORT = ["run.distance=6 m", "run.evaluate_from=1 m", "campaign.runs=2", "speed.values=['200 km/h','300 km/h']"]
PANELS = (Panel("force/wheel_1", "Q/Q0, wheel 1", "0"), Panel("rail", "Rail [mm]"))


def response(
    name: str, step: float, *, speed: float = 50.0, phase: float = 0.0, samples: int | None = None
) -> Response:
    """A force that is a sine of the place: 2 m long, sampled with a step."""
    time = np.arange(samples or round(0.4 / step) + 1) * step
    position = 30.0 + speed * time
    wave = 1.0 + np.sin(np.pi * position + phase)
    return Response(name=name, colour=(1, 2, 3), time=time, position=position,
                    values={"force/wheel_1": wave, "rail": 2.0 * wave})  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def strict():
    """Turn what rerun would drop with a warning into errors."""
    import rerun as rr

    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Two short runs at each of two speeds."""
    return run(Scenario.load("quick", overrides=SHORT), out=tmp_path_factory.mktemp("compared"))


def rerun(*arguments) -> int:
    return subprocess.run([str(find_binary()), *map(str, arguments)], capture_output=True, timeout=120).returncode


@pytest.mark.parametrize("steps", [(1e-4, 5e-5), (5e-5, 1e-4), (1e-4, 1e-4)])
def test_whole_multiples_of_a_step_are_compared_without_interpolation(steps):
    fine, coarse = response("a", steps[0]), response("b", steps[1])
    found = difference(fine, coarse, "force/wheel_1")
    assert np.abs(found.values).max() < 1e-9
    assert np.diff(found.time).mean() == pytest.approx(max(steps))


def test_runs_of_different_speeds_are_compared_at_the_same_places():
    """Linear interpolation of a wave 2 m long between samples 10 mm apart is off by (pi 0.01)^2/8."""
    slow, fast = response("slow", 1e-4, speed=40.0), response("fast", 1e-4, speed=100.0)
    found = difference(fast, slow, "force/wheel_1")
    assert np.abs(found.values).max() < 1.25e-4
    assert found.position[-1] == pytest.approx(30.0 + 40.0 * 0.4)  # as far as both went
    np.testing.assert_allclose(found.position, 30.0 + 40.0 * found.time)  # stamped with the times of the first
    assert not Page(name="page", panels=PANELS, responses=[slow, fast]).same_speed


def test_a_difference_is_that_of_the_values():
    one, other = response("one", 1e-4), response("other", 1e-4, phase=0.3)
    found = difference(other, one, "rail")
    np.testing.assert_allclose(found.values, other.values["rail"] - one.values["rail"], atol=1e-9)


def test_a_response_that_ended_early_is_compared_up_to_there():
    whole, broken = response("whole", 1e-4), response("broken", 1e-4)
    history = broken.values["force/wheel_1"].copy()
    history[1000:] = np.nan
    broken = replace(broken, values={**broken.values, "force/wheel_1": history})
    assert len(difference(broken, whole, "rail").values) == 1000


def test_pages_with_one_response_or_with_a_name_twice_are_refused():
    one = response("one", 1e-4)
    with pytest.raises(ValueError, match="at least 2"):
        Page(name="page", panels=PANELS, responses=[one])
    with pytest.raises(ValueError, match="one twice"):
        Page(name="page", panels=PANELS, responses=[one, one])


def test_pages_are_written_verify_and_are_the_same_when_written_again(tmp_path):
    pages = [Page(name=f"step {k}", panels=PANELS, responses=[response("a", 1e-4), response("b", 2e-4, phase=0.1 * k)])
             for k in (1, 2)]  # fmt: skip
    overlay = Overlay(name="two pages", pages=pages)
    first, again = (write_overlay(overlay, tmp_path / name) for name in ("first.rrd", "again.rrd"))
    assert rerun("rrd", "verify", first, again) == 0
    assert rerun("rrd", "compare", "--unordered", first, again) == 0
    other = write_overlay(replace(overlay, pages=pages[::-1]), tmp_path / "other.rrd")
    assert rerun("rrd", "compare", "--unordered", first, other) == 1


def test_runs_with_another_step_are_said_not_to_be_stored(campaign, tmp_path):
    name = "c01-s000000"
    parts = replay_with_steps(campaign, [name], ["0.1 ms", "0.05 ms"])  # the stored step counts once
    assert [part.step for part in parts] == [1e-4, 5e-5]
    assert campaign.differs_from_stored(name, parts[0].result) == []
    overlay = overlaid_runs(parts, stored_step=campaign.step)
    assert "With 0.05 ms this is **not the stored run**" in overlay_sheet(overlay)
    (page,) = overlay.pages
    assert [one.name for one in page.responses] == [f"{name}, 0.1 ms", f"{name}, 0.05 ms"]
    # The scheme is of second order: half a step changes the force by little, but it does change it.
    changed = np.abs(difference(page.responses[1], page.responses[0], "force/wheel_1").values).max()
    assert 0.0 < changed < 0.05
    assert rerun("rrd", "verify", write_overlay(overlay, tmp_path / "steps.rrd")) == 0


def test_runs_are_compared_wheel_by_wheel_on_both_time_lines(campaign, tmp_path):
    from rerun.chunk import RrdReader

    names = ["c00-s000001", "c01-s000001"]
    overlay = overlaid_runs(replay_with_steps(campaign, names, []), stored_step=campaign.step)
    assert "Speeds differ" in overlay_sheet(overlay)
    reader = RrdReader(str(write_overlay(overlay, tmp_path / "runs.rrd")))
    found = {}
    for chunk in reader.store(store=reader.recordings()[0]).stream():
        found.setdefault(chunk.entity_path, set()).update(chunk.to_record_batch().schema.names)
    for wheel in range(1, 5):
        for name in names:
            assert {"sim_time", "chainage_mm"} <= found[f"/force/wheel_{wheel}/{name}"]
            assert "StateChange:state" in found[f"/contact/wheel_{wheel}/{name}"]
        assert f"/difference/force/wheel_{wheel}/{names[1]}" in found
        assert f"/difference/force/wheel_{wheel}/{names[0]}" not in found
    assert not any("log_time" in columns for columns in found.values())


@pytest.mark.parametrize(("steps", "said"), [([], "2 are needed"), (["0.1 kg"], "no time"), (["1 s"], "out of range")])
def test_what_cannot_be_compared_is_refused_in_words(campaign, steps, said):
    with pytest.raises(ValueError, match=said):
        replay_with_steps(campaign, ["c00-s000000"], steps)
