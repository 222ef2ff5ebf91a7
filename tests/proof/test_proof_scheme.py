"""The two-step scheme on a single oscillator: numerical damping and period elongation."""

import numpy as np
import pytest

import tbatch as tb
from tbatch.numerics.two_step import EQUAL_SPLITTING, TwoStep

RADIUS = {
    0.5: {0.1: "0.9995", 0.2: "0.9933", 0.5: "0.8947", 1.0: "0.6485", 1e9: "0.0000"},
    EQUAL_SPLITTING: {0.1: "0.9995", 0.2: "0.9929", 0.5: "0.8887", 1.0: "0.6356", 1e9: "0.0000"},
}
"""Spectral radius by splitting and Δt/T, to the digits printed."""
HALF_DIGIT = 0.5e-4


def elongation(amplification: np.ndarray, ratio: float) -> float:
    """Relative growth of the period of an oscillator stepped with Δt/T = ratio."""
    turn = np.abs(np.angle(np.linalg.eigvals(amplification))).max()
    return 2.0 * np.pi * ratio / turn - 1.0


@pytest.mark.parametrize("splitting", RADIUS)
def test_the_spectral_radius_is_that_of_the_scheme(splitting, holds):
    for ratio, printed in RADIUS[splitting].items():
        eigenvalues = np.linalg.eigvals(TwoStep(ratio, splitting).amplification(2.0 * np.pi))
        # At Δt/T = 1e9 the radius is that of the limit to 1e-9.
        assert holds(
            f"spectral radius at Δt/T = {ratio:g}", abs(np.abs(eigenvalues).max() - float(printed)), HALF_DIGIT
        )


@pytest.mark.parametrize(("splitting", "percent"), [(0.5, 0.4095), (EQUAL_SPLITTING, 0.3975)])
def test_the_period_elongation_is_that_of_the_scheme(splitting, percent, holds):
    error = abs(100.0 * elongation(TwoStep(0.05, splitting).amplification(2.0 * np.pi), 0.05) - percent)
    assert holds("period elongation at Δt/T = 0.05, in per cent", error, HALF_DIGIT)


@pytest.mark.parametrize("ratio", [0.05, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("splitting", [0.5, EQUAL_SPLITTING])
def test_a_wheel_on_its_contact_spring_swings_as_the_amplification_matrix_says(splitting, ratio, holds):
    mass, stiffness = 350.0, 1.2e9
    omega = np.sqrt(stiffness / mass)
    step = ratio * 2.0 * np.pi / omega
    rest = mass * 9.81 / stiffness
    wheel = tb.Vehicle([[mass]], [[0.0]], [[0.0]], [0], [0.0])
    contact = tb.Contact.linear(stiffness)
    model = tb.Model.build(wheel, tb.Track.rigid(length=1.0), contact, step=step, splitting=splitting)
    # Half of the static overlap: the wheel stays on the spring.
    start = tb.State(np.array([0.5 * rest]), np.array([0.2 * rest * omega]))
    save = tb.SaveAt(step, ("vehicle",))
    result = tb.simulate(model, tb.Runs([0.0], None, 0.5), 40 * step, initial=start, save=save, threads=1)
    matrix = TwoStep(step, splitting).amplification(omega)
    state, expected = np.array([0.5 * rest, 0.2 * rest * omega]), []
    for _ in range(41):
        expected.append(state[0])
        state = matrix @ state
    # Round-off: the engine holds displacements beside a static overlap of 3 µm with 1e-16 of that.
    assert holds("displacement, of the amplitude", np.abs(result.vehicle[0, :, 0] - expected).max() / rest, 1e-11)
