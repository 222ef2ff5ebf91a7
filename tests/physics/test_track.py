"""Tracks against known static deflections, modes of beams, and the half/whole rule."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve

from tbatch.physics.rails import common_rails
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle


def deflection(track, x, force):
    """Return the displacements, shape (node, m), under a static force on the rail."""
    element, N = track.locate(x)
    load = np.zeros(track.pinned.shape)
    load[element, :2] += force * N[:2]
    load[element + 1, :2] += force * N[2:]
    free = track.free.ravel()
    u = np.zeros(free.size)
    u[free] = spsolve(track.stiffness.to_csc()[free][:, free], load.ravel()[free])
    return u.reshape(load.shape)


@pytest.mark.parametrize(
    ("per", "expected"), [("fastener", [0.8833, 0.4098, 0.3646]), ("metre", [1.0443, 0.5729, 0.5074])]
)
# Tabulated to 5e-5 mm; one element per bay is known to be within 5e-4 of it.
@pytest.mark.parametrize(("elements", "tolerance"), [(4, 0.0), (1, 5e-4)])
def test_seed_slab_track_deflects_as_known_under_one_wheelset(per, expected, elements, tolerance):
    track = Track.slab("seed-slab", length=100.0, elements_per_bay=elements, per=per)
    at_seat = deflection(track, 77 * 0.65, 132435.0)[77 * elements]
    np.testing.assert_allclose(at_seat[[0, 2, 4]] * 1e3, expected, rtol=tolerance, atol=5.1e-5)


def test_winkler_beam_deflects_as_the_infinite_one():
    track = Track.winkler("koh-winkler", length=60.0, elements=480)
    EI, k, P = 6.12e6, 1.0e7, 1.0e5
    lam = (k / (4.0 * EI)) ** 0.25
    x = np.linspace(0.0, 60.0, 481)
    s = lam * np.abs(x - 30.0)
    exact = P * lam / (2.0 * k) * np.exp(-s) * (np.cos(s) + np.sin(s))
    # The ends are 24 decay lengths away; elements of a tenth of one leave (1/10)^4 / 200 of the peak.
    np.testing.assert_allclose(deflection(track, 30.0, P)[:, 0], exact, atol=2e-6 * exact.max())


def test_default_winkler_mesh_is_good_to_a_thousandth():
    track = Track.winkler("koh-winkler", length=50.0)
    lam = (1.0e7 / (4.0 * 6.12e6)) ** 0.25
    middle = deflection(track, 25.0, 1.0)[track.element_count // 2, 0]
    assert middle == pytest.approx(lam / 2.0e7, rel=1e-3)


def test_simply_supported_beam_has_the_sine_modes_and_the_textbook_deflection():
    L, EI, m = 20.0, 4.0e9, 5000.0
    track = Track.beam(length=L, elements=20, EI=EI, mass=m)
    free = track.free.ravel()
    K, M = (matrix.to_csc().toarray()[np.ix_(free, free)] for matrix in (track.stiffness, track.mass))
    n = np.arange(1, 5)
    exact = (n * np.pi / L) ** 2 * np.sqrt(EI / m)
    # Cubic elements: relative frequency error about (n pi / 20)^4 / 1440.
    error = np.sqrt(eigh(K, M, eigvals_only=True)[:4]) / exact - 1.0
    assert (np.abs(error) < 1.5 * (n * np.pi / 20) ** 4 / 1440).all()
    assert deflection(track, L / 2, 1e5)[10, 0] == pytest.approx(1e5 * L**3 / (48 * EI), rel=1e-9)


def test_only_the_vertical_dofs_at_the_two_ends_are_pinned():
    for track in (Track.slab("seed-slab", length=5.0), Track.beam(length=5.0, elements=4, EI=1.0, mass=1.0)):
        expected = np.zeros_like(track.pinned)
        expected[0, ::2] = expected[-1, ::2] = True
        np.testing.assert_array_equal(track.pinned, expected)
        rows = track.pinned.ravel()
        for matrix in (track.mass, track.damping, track.stiffness):
            dense = matrix.to_csc().toarray()
            assert not dense[rows].any()
            assert not dense[:, rows].any()
            np.testing.assert_array_equal(dense, dense.T)


def test_slab_length_is_rounded_up_to_whole_bays():
    assert Track.slab("seed-slab", length=100.0).length == pytest.approx(154 * 0.65)
    assert Track.slab("seed-slab", length=7 * 0.65).element_count == 7
    assert Track.slab("seed-slab", length=7 * 0.65 + 1e-3).element_count == 8
    track = Track.slab("seed-slab", length=108.55, elements_per_bay=3)
    assert (track.node_count, track.node_dofs, track.period) == (167 * 3 + 1, 6, 3)
    assert track.element_length == pytest.approx(0.65 / 3)


def test_slab_track_carries_a_uniform_displacement_by_its_subgrade_alone():
    track = Track.slab("seed-slab", length=6.5, elements_per_bay=2)
    free_ends = track.parameters.matrices(10, 2)
    up = np.zeros(track.pinned.shape)
    up[:, ::2] = 1.0
    mass, damping, stiffness = (float((up * matrix.dot(up)).sum()) for matrix in free_ends)
    # Slab 1275 kg/m and base 2212.5 kg/m by hand from the table's sections and density.
    assert mass == pytest.approx(6.5 * (2 * 60.64 + 1275.0 + 2212.5), rel=1e-12)
    assert stiffness == pytest.approx(10 * 60e6, rel=1e-6)
    assert damping == pytest.approx(10 * 90e3, rel=1e-9)


def test_seed_set_is_two_rails_on_doubled_fasteners_and_whole_width_slabs():
    seed = Track.slab("seed-slab", length=10.0).parameters
    assert seed.rail == pytest.approx((2 * 2.059e11 * 3.217e-5, 2 * 60.64))
    assert seed.fastener == (120e6, 95.4e3)
    assert seed.slab == pytest.approx((6.63e7, 1275.0))
    assert seed.base == pytest.approx((1.99125e8, 2212.5))


def test_one_number_of_a_named_set_can_be_changed():
    soft = Track.slab("seed-slab", length=10.0, fastener=(50e6, 1e5))
    assert soft.parameters.fastener == (50e6, 1e5)
    assert soft.parameters.mortar == (900e6, 83e3)
    assert "changed: fastener" in soft.source
    undamped = Track.winkler("koh-winkler", length=10.0, damping=0.0)
    assert not undamped.damping.diagonal.any()
    assert undamped.stiffness.diagonal.any()


def test_rayleigh_damping_is_that_of_the_full_matrices():
    plain = Track.slab("seed-slab", length=6.5)
    damped = Track.slab("seed-slab", length=6.5, rayleigh=(1.5, 2e-5))
    expected = plain.damping + 1.5 * plain.mass + 2e-5 * plain.stiffness
    np.testing.assert_allclose(damped.damping.to_csc().toarray(), expected.to_csc().toarray(), rtol=1e-12)


def test_rigid_track_has_a_length_and_no_dofs():
    track = Track.rigid(length=12.0)
    assert (track.length, track.node_dofs, track.rails, track.rail_EI) == (12.0, 0, None, None)
    assert track.stiffness.to_csc().shape == (0, 0)
    assert track.stiffness.dot(np.zeros((2, 0, 3))).shape == (2, 0, 3)


def test_locate_finds_the_element_and_refuses_places_off_the_track():
    track = Track.beam(length=10.0, elements=5, EI=1.0, mass=1.0)
    element, N = track.locate([0.0, 3.0, 10.0])
    np.testing.assert_array_equal(element, [0, 1, 4])
    np.testing.assert_allclose(N @ [1.0, 0.0, 1.0, 0.0], 1.0)
    for x in (-0.1, 10.1, np.nan):
        with pytest.raises(ValueError, match=r"from 0 to 10 \[m\]"):
            track.locate(x)


def test_half_and_whole_models_are_never_mixed():
    coach, column = Vehicle.coach("seed-multiwheel"), Vehicle.column("koh-column")
    slab, winkler = Track.slab("seed-slab", length=5.0), Track.winkler("koh-winkler", length=5.0)
    rigid = Track.rigid(length=5.0)
    either = Vehicle([[1.0]], [[0.0]], [[0.0]], [0], [0.0])
    assert (common_rails(coach, slab), common_rails(column, winkler)) == (2, 1)
    assert (common_rails(coach, rigid), common_rails(either, slab), common_rails(either, rigid)) == (2, 2, 1)
    for vehicle, track in ((coach, winkler), (column, slab)):
        with pytest.raises(ValueError, match=r"both must be half or both whole"):
            common_rails(vehicle, track)


def test_rails_label_the_numbers_and_never_rescale_them():
    one, two = Track.slab("seed-slab", length=5.0, rails=1), Track.slab("seed-slab", length=5.0)
    assert (one.rails, two.rails) == (1, 2)
    np.testing.assert_array_equal(one.stiffness.diagonal, two.stiffness.diagonal)
    assert Track.beam(length=5.0, elements=2, EI=1.0, mass=1.0).rails is None


BEAM = {"length": 5.0, "elements": 2, "EI": 1.0, "mass": 1.0}


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Track.slab("seed-slab", length=0.0), r"track.length = 0.0: must be above 0 \[m\]"),
        (lambda: Track.slab("seed-slab", length="100 m"), r"track.length = '100 m'"),
        (lambda: Track.slab("seed-slab", length=9.0, elements_per_bay=0), "track.elements_per_bay = 0"),
        (lambda: Track.slab("seed-slab", length=9.0, elements_per_bay=1.5), "track.elements_per_bay = 1.5"),
        (lambda: Track.slab("seed-slab", length=9.0, per="meter"), r"track.per = 'meter'.*'fastener', 'metre'"),
        (lambda: Track.slab("seed-slab", length=9.0, fastener=6e7), "track.fastener = 60000000.0: must be a pair"),
        (lambda: Track.slab("seed-slab", length=9.0, rail=(0.0, 60.0)), "track.rail EI = 0.0"),
        (lambda: Track.slab("seed-slab", length=9.0, mortar=(-1.0, 0.0)), r"track.mortar stiffness.*per fastener"),
        (lambda: Track.slab("seed-slab", length=9.0, rayleigh=(0.0, -1.0)), "track.rayleigh beta"),
        (lambda: Track.slab("no-such", length=9.0), "'no-such' is not in the catalogue; it has seed-slab"),
        (lambda: Track.slab(length=9.0, bay=0.6), "rail, fastener, slab, mortar, base, subgrade missing"),
        (lambda: Track.winkler(length=9.0, elements=3, EI=1.0, mass=1.0), "stiffness, damping missing"),
        (lambda: Track.winkler("koh-winkler", length=9.0, stiffness=-1.0), "track.stiffness = -1.0"),
        (lambda: Track.beam(**{**BEAM, "elements": 0}), "track.elements = 0"),
        (lambda: Track.beam(**{**BEAM, "mass": float("inf")}), "track.mass = inf"),
        (lambda: Track.rigid(length=-1.0), "track.length = -1.0"),
        (lambda: Track.rigid(length=1.0, rails=4), "track.rails = 4"),
        (lambda: Track.ballast("zhai"), "not yet"),
    ],
)
def test_impossible_tracks_are_refused_by_name(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_description_says_half_or_whole_and_what_the_beds_are_per():
    text = dict(Track.slab("seed-slab", length=10.0, per="metre").describe_rows())
    assert text["track rails"] == "whole (two rails)"
    assert text["mortar and subgrade"] == "given per metre"
