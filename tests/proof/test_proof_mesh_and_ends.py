"""What a finite line of short elements leaves out: echoes from its ends, bending within the loaded element."""

from functools import cache

import numpy as np
import pytest

import tbatch as tb

COACH = tb.Vehicle.coach("seed-multiwheel")
HERTZ = tb.Contact.hertz(wheel_radius=0.4575)
LOAD, SPEED, BAY = 132435.0, 300.0 / 3.6, 0.65


@cache
def flat_passage(margin: float) -> np.ndarray:
    """Forces of a coach over a flat on a line that ends `margin` m behind its last and before its first wheel."""
    lead, behind = round(margin / BAY) * BAY, round(20.0 / BAY) * BAY
    start, duration = lead + behind, 0.2
    track = tb.Track.slab("seed-slab", length=start + SPEED * duration + lead)
    flat = tb.Irregularity.flat(depth=2e-4, length=0.15, at=start + 2.0)
    model = tb.Model.build(COACH, track, HERTZ, step=1e-4)
    save = tb.SaveAt(1e-4, ("contact_force",))
    return tb.simulate(model, tb.Runs([SPEED], [flat], start), duration, save=save, threads=1).contact_force[0]


def test_thirty_metres_beyond_the_wheels_keep_the_echo_of_the_ends_below_one_per_cent(holds):
    far = flat_passage(60.0)
    pulse = np.abs(far - LOAD).max()
    assert pulse > LOAD
    echo = {margin: np.abs(flat_passage(margin) - far).max() / pulse for margin in (10.0, 30.0)}
    # A rule of thumb for any track; this one is damped well and shows 0.2 %.
    assert holds("echo at 30 m, of the pulse's peak", echo[30.0], 0.01)
    assert echo[10.0] > 2.0 * echo[30.0]


SPECTRA = [
    tb.Irregularity.spectrum("china-trunk-line", wavelengths=(0.3, 50.0), tail=3, seed=1, sample=i, scale=0.5)
    for i in range(3)
]
ROUGH = (None, *(spectrum.taper(25.0, 5.0) for spectrum in SPECTRA))


@cache
def line(elements_per_bay: int, local: bool) -> np.ndarray:
    """Forces at 300 km/h on a smooth and three rough rails, after 30 ms [of the static load], (run, n, wheel)."""
    track = tb.Track.slab("seed-slab", length=66.3, elements_per_bay=elements_per_bay)
    model = tb.Model.build(COACH, track, HERTZ, step=1e-4, local_compliance=local)
    runs = tb.Runs(np.full(len(ROUGH), SPEED), ROUGH, 62.0 * BAY)
    forces = tb.simulate(model, runs, 0.24, save=tb.SaveAt(1e-4, ("contact_force",)), threads=1).contact_force
    # The start is a small blow to elements of any length: 0.6 %, gone after 30 ms.
    return forces[:, 300:] / LOAD


def test_one_element_a_bay_with_local_compliance_stands_for_four(holds):
    fine = line(4, True)
    assert fine.min() > 0.0
    mended = np.abs(line(1, True) - fine).max((1, 2))
    plain = np.abs(line(1, False) - fine).max((1, 2))
    # What is left is the mesh of the rest of the line, and inertia within the element.
    assert holds("smooth rail, of the static load", mended[0], 0.003)
    assert holds("rough rails, of the static load", mended[1:].max(), 0.006)
    assert plain[0] > 5.0 * mended[0] and plain[0] > 0.015
    assert (plain[1:] > 3.0 * mended[1:]).all()


def test_four_elements_a_bay_stand_for_eight(holds):
    error = np.abs(line(4, True) - line(8, True)).max()
    # One a bay leaves 5e-3; fourth order in static deflections, less in waves as short as the element.
    assert holds("four elements a bay, of the static load", error, 4e-4)


@pytest.mark.parametrize("local", [True, False])
def test_the_force_swings_with_the_sleeper_passing_frequency_in_the_right_phase(local):
    forces = line(1, local)[0]
    time = (np.arange(len(forces)) + 300) * 1e-4
    swing = (forces[:, 0] - forces[:, 0].mean()) @ np.exp(-2j * np.pi * SPEED / BAY * time)
    fine = line(4, True)[0]
    right = (fine[:, 0] - fine[:, 0].mean()) @ np.exp(-2j * np.pi * SPEED / BAY * time)
    # Without the term the excitation has the wrong sign, and the force the opposite phase.
    assert (np.real(swing / right) > 0.0) == local
