"""Contact laws against their published constants and against their definitions."""

import numpy as np
import pytest

from tbatch.physics.contact import Contact

HALF_LOAD, WHOLE_LOAD = 66217.5, 132435.0


def test_hertz_constants_are_the_published_ones():
    worn = Contact.hertz(wheel_radius=0.4575)
    conical = Contact.hertz(wheel_radius=0.4575, profile="conical")
    # G to the six digits it is tabulated with.
    assert worn.hertz_constant(1) ** (-2 / 3) == pytest.approx(4.22321e-8, rel=2e-6)
    assert conical.hertz_constant(1) ** (-2 / 3) == pytest.approx(5.13473e-8, rel=2e-6)
    assert worn.hertz_constant(1) == pytest.approx(1.1522e11, rel=5e-5)
    assert worn.hertz_constant(2) == pytest.approx(2.3044e11, rel=5e-5)
    assert worn.hertz_constant(2) ** (-2 / 3) == pytest.approx(2.66045e-8, rel=2e-6)


def test_tangent_and_approach_are_the_published_ones_per_wheel_and_per_wheelset():
    linear = Contact.linear(wheel_radius=0.4575)
    half, whole = linear.resolve([HALF_LOAD], 1), linear.resolve([WHOLE_LOAD], 2)
    assert half.stiffness[0] == pytest.approx(1.4369e9, rel=5e-5)
    assert whole.stiffness[0] == pytest.approx(2.8739e9, rel=5e-5)
    assert half.approach[0] == pytest.approx(46.08e-6, rel=1e-4)
    assert whole.approach[0] == pytest.approx(half.approach[0], rel=1e-12)
    hertz = Contact.hertz(wheel_radius=0.4575)
    assert hertz.resolve([HALF_LOAD], 1).approach[0] == pytest.approx(69.12e-6, rel=1e-4)
    assert hertz.resolve([WHOLE_LOAD], 2).approach[0] == pytest.approx(69.12e-6, rel=1e-4)


LAWS = [
    Contact.hertz(wheel_radius=0.46),
    Contact.hertz(constant=1e11),
    Contact.linear(wheel_radius=0.46),
    Contact.linear(1.2e9),
    Contact.affine(wheel_radius=0.46),
    Contact.affine(stiffness=1.5e9, constant=1e11),
]


@pytest.mark.parametrize("contact", LAWS, ids=str)
def test_every_law_carries_the_static_load_at_its_approach_and_nothing_once_separated(contact):
    load = np.array([40e3, 66e3, 90e3])
    constants = contact.resolve(load, 1)
    np.testing.assert_allclose(constants.force(constants.approach), load, rtol=1e-13)
    np.testing.assert_array_equal(constants.force(constants.separation), 0.0)
    np.testing.assert_array_equal(constants.force(constants.separation - 1e-4), 0.0)
    assert (constants.force(constants.separation + 1e-7) > 0.0).all()


def test_affine_law_touches_hertz_at_rest_and_separates_at_a_third_of_the_approach():
    hertz, affine = (law.resolve([HALF_LOAD], 1) for law in (Contact.hertz(), Contact.affine()))
    assert affine.approach[0] == hertz.approach[0]
    assert affine.separation[0] == pytest.approx(hertz.approach[0] / 3.0, rel=1e-12)
    h = 1e-4 * hertz.approach[0]
    slope = (hertz.force(hertz.approach + h) - hertz.force(hertz.approach - h)) / (2.0 * h)
    # A central difference over 1e-4 of the approach is off by some 1e-10 of the slope.
    assert affine.stiffness[0] == pytest.approx(slope[0], rel=1e-8)


def test_given_constants_are_per_wheel_dof_and_not_multiplied_by_the_rails():
    assert Contact.hertz(constant=1e11).resolve([1e5], 2).stiffness[0] == 1e11
    assert Contact.linear(stiffness=2e9).resolve([1e5], 2).stiffness[0] == 2e9


def test_the_vehicles_wheel_radius_serves_only_where_the_contact_has_none():
    own = Contact.hertz(wheel_radius=0.5)
    assert own.hertz_constant(1, 0.43) == own.hertz_constant(1)
    assert Contact.hertz().hertz_constant(1, 0.43) == Contact.hertz(wheel_radius=0.43).hertz_constant(1)


def test_an_unloaded_wheel_rests_without_overlap_and_has_no_tangent():
    assert Contact.hertz().resolve([0.0], 1).approach[0] == 0.0
    assert Contact.linear(1e9).resolve([0.0], 1).approach[0] == 0.0
    with pytest.raises(ValueError, match=r"contact.stiffness.*wheel 2"):
        Contact.linear().resolve([1e4, 0.0], 1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Contact.hertz(wheel_radius=0.0), r"contact.wheel_radius = 0.0.*above 0 \[m\]"),
        (lambda: Contact.hertz(constant=-1.0), r"contact.constant = -1.0"),
        (lambda: Contact.hertz(constant=float("nan")), "contact.constant = nan"),
        (lambda: Contact.hertz(wheel_radius=0.4, constant=1e11), "one of the two"),
        (lambda: Contact.hertz(profile="flat"), "'worn', 'conical'"),
        (lambda: Contact.linear(stiffness="stiff"), "contact.stiffness = 'stiff'"),
        (lambda: Contact.hertz().resolve([-1.0], 1), "static_load"),
        (lambda: Contact.hertz().resolve([1.0], 3), "rails = 3"),
    ],
)
def test_impossible_numbers_are_refused_by_name(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_description_names_the_law_and_the_source_of_its_numbers():
    contact = Contact.affine()
    text = dict(contact.describe_rows(contact.resolve([WHOLE_LOAD], 2), 2, 0.4575))
    assert "affine" in text["contact law"]
    assert "worn" in text["Hertz constant"]
    assert text["separates at an overlap of"] == "23.0411 µm"
