"""The beam element against quadrature of its own shape functions, and against exact beams."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.catalogue.tracks import CHN60
from tbatch.physics.elements import beam_stiffness, consistent_bed, fixed_fixed_compliance, hermite

LENGTH, EI = 0.7, 3.0e6
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(6)
T, DT = 0.5 * (POINTS + 1.0), 0.5 * WEIGHTS


def test_shape_values_reproduce_any_cubic():
    cubic = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7])
    slope = cubic.deriv()
    nodal = np.array([cubic(0.0), slope(0.0), cubic(LENGTH), slope(LENGTH)])
    t = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(hermite(t, LENGTH) @ nodal, cubic(t * LENGTH), rtol=1e-13)


def test_consistent_bed_is_the_integral_of_the_shape_values_squared():
    # Six Gauss points integrate the polynomial of degree six exactly.
    N = hermite(T, LENGTH)
    expected = 5.0 * LENGTH * np.einsum("q,qi,qj->ij", DT, N, N)
    np.testing.assert_allclose(consistent_bed(LENGTH, 5.0), expected, rtol=1e-13)


def test_bending_stiffness_is_the_integral_of_the_curvatures_squared():
    curvature = (
        np.stack(
            [12.0 * T - 6.0, LENGTH * (6.0 * T - 4.0), 6.0 - 12.0 * T, LENGTH * (6.0 * T - 2.0)],
            axis=-1,
        )
        / LENGTH**2
    )
    expected = EI * LENGTH * np.einsum("q,qi,qj->ij", DT, curvature, curvature)
    np.testing.assert_allclose(beam_stiffness(LENGTH, EI), expected, rtol=1e-12, atol=1e-9 * EI)


def test_fixed_fixed_compliance_is_the_textbook_value_under_the_force_and_symmetric():
    a, b = 0.3, LENGTH - 0.3
    under = fixed_fixed_compliance(a, a, LENGTH, EI)
    np.testing.assert_allclose(under, a**3 * b**3 / (3.0 * EI * LENGTH**3), rtol=1e-13)
    middle = fixed_fixed_compliance(LENGTH / 2, LENGTH / 2, LENGTH, EI)
    np.testing.assert_allclose(middle, LENGTH**3 / (192.0 * EI), rtol=1e-13)
    np.testing.assert_allclose(
        fixed_fixed_compliance(0.1, 0.5, LENGTH, EI), fixed_fixed_compliance(0.5, 0.1, LENGTH, EI), rtol=1e-13
    )


def test_fixed_fixed_compliance_between_two_points_is_that_of_a_divided_clamped_beam():
    # Cubic elements are exact at nodes under nodal forces, so seven of them are exact at the points.
    clamped = BlockTridiagonal.from_elements(beam_stiffness(LENGTH / 7, EI), 7).to_csc().toarray()[2:-2, 2:-2]
    flexibility = np.linalg.inv(clamped)[::2, ::2]
    x = np.arange(1, 7) * LENGTH / 7
    np.testing.assert_allclose(fixed_fixed_compliance(x[:, None], x, LENGTH, EI), flexibility, rtol=1e-9)


def deflection_under(force, x, *, elements_per_bay, bay=0.65, bays=60, seat=60e6):
    """Return the deflection at x under a force there, of one CHN60 rail on discrete seats without the local term."""
    length = bay / elements_per_bay
    K = BlockTridiagonal.from_elements(beam_stiffness(length, CHN60[0]), bays * elements_per_bay)
    K.diagonal[::elements_per_bay, 0, 0] += seat
    element = int(x / length)
    N = hermite(x / length - element, length)
    load = np.zeros(2 * K.node_count)
    rows = slice(2 * element, 2 * element + 4)
    load[rows] = force * N
    return N @ spsolve(K.to_csc(), load)[rows]


LOAD, SEAT, MID_BAY = 66217.5, 30 * 0.65, 30.5 * 0.65


def test_one_plain_element_per_bay_flips_the_sign_of_the_sleeper_passing_deflection():
    # Values of the mesh trap to the two decimals in µm that they are known to.
    assert deflection_under(LOAD, SEAT, elements_per_bay=1) == pytest.approx(487.03e-6, abs=0.006e-6)
    assert deflection_under(LOAD, MID_BAY, elements_per_bay=1) == pytest.approx(481.19e-6, abs=0.006e-6)
    assert deflection_under(LOAD, MID_BAY, elements_per_bay=4) == pytest.approx(495.49e-6, abs=0.006e-6)


@pytest.mark.parametrize("place", [0.1, 0.25, 0.5, 0.8])
def test_the_local_compliance_makes_one_element_per_bay_exact(place):
    x = (30 + place) * 0.65
    local = fixed_fixed_compliance(place * 0.65, place * 0.65, 0.65, CHN60[0])
    coarse = deflection_under(LOAD, x, elements_per_bay=1) + LOAD * local
    # Forces at nodes of the fine mesh: exact there, so only round-off is left.
    assert coarse == pytest.approx(deflection_under(LOAD, x + 1e-12, elements_per_bay=20), rel=1e-6)
