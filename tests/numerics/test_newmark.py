"""Newmark and HHT-α against their published spectral radii, period errors and orders."""

import numpy as np
import pytest

from tbatch.numerics.newmark import Newmark
from tbatch.numerics.two_step import TwoStep


def radius(scheme: Newmark | TwoStep, omega: float) -> float:
    return float(np.abs(np.linalg.eigvals(scheme.amplification(omega))).max())


@pytest.mark.parametrize("ratio", [0.01, 0.1, 1.0, 100.0])
def test_newmark_neither_damps_nor_amplifies_at_any_step(ratio: float) -> None:
    # Eigenvalues of the average acceleration: (1 ± iωΔt/2)/(1 ∓ iωΔt/2), modulus one, and zero.
    values = np.linalg.eigvals(Newmark(1.0).amplification(2.0 * np.pi * ratio))
    half = np.pi * ratio
    exact = np.array([(1 + 1j * half) / (1 - 1j * half), (1 - 1j * half) / (1 + 1j * half)])
    for one in exact:
        assert np.abs(values - one).min() < 1e-7  # the eigenvalue solver's round-off near -1, where two meet
    assert abs(radius(Newmark(1.0), 2.0 * np.pi * ratio) - 1.0) < 1e-6


@pytest.mark.parametrize("alpha", [-0.05, -0.1, -0.3])
def test_hht_damps_the_highest_frequencies_by_its_closed_form(alpha: float) -> None:
    # As ωΔt grows the stiffness alone decides: u₁ = α/(1+α) u₀, and the double root -(1+α)/(1-α) of velocity and
    # acceleration (Hilber, Hughes and Taylor 1977).
    expected = max(abs(alpha) / (1.0 + alpha), (1.0 + alpha) / (1.0 - alpha))
    # A double root moves with the square root of the matrix's round-off and of 1/(ωΔt)².
    assert radius(Newmark(1.0, alpha), 1e4) == pytest.approx(expected, abs=2e-3)


def test_hht_is_stable_at_every_step_and_nearly_undamped_at_short_ones() -> None:
    radii = [radius(Newmark(1.0, -0.1), 2.0 * np.pi * ratio) for ratio in np.logspace(-3, 3, 61)]
    assert max(radii) <= 1.0 + 1e-9
    assert radius(Newmark(1.0, -0.1), 2.0 * np.pi * 0.01) > 0.99999


@pytest.mark.parametrize(
    ("splitting", "radii"),
    [(0.5, (0.9995, 0.9933, 0.8947, 0.6485)), (2.0 - 2.0**0.5, (0.9995, 0.9929, 0.8887, 0.6356))],
)
def test_the_two_step_scheme_has_its_known_spectral_radii(splitting: float, radii: tuple[float, ...]) -> None:
    for ratio, expected in zip((0.1, 0.2, 0.5, 1.0), radii, strict=True):
        # Given to four digits.
        assert radius(TwoStep(1.0, splitting), 2.0 * np.pi * ratio) == pytest.approx(expected, abs=6e-5)
    assert radius(TwoStep(1.0, splitting), 1e9) < 1e-6


@pytest.mark.parametrize("scheme", [Newmark(1.0), Newmark(1.0, -0.1), TwoStep(1.0), TwoStep(1.0, 0.5)])
def test_every_scheme_is_second_order_on_a_damped_oscillator(scheme: Newmark | TwoStep) -> None:
    damping = 0.05
    wd = np.sqrt(1.0 - damping**2)
    end = 10.0
    exact = np.exp(-damping * end) * (np.cos(wd * end) + damping / wd * np.sin(wd * end))
    errors = []
    for steps in (200, 400):
        step = end / steps
        one = Newmark(step, scheme.alpha) if isinstance(scheme, Newmark) else TwoStep(step, scheme.splitting)
        state = np.array([1.0, 0.0, -1.0]) if isinstance(one, Newmark) else np.array([1.0, 0.0])
        for _ in range(steps):
            state = one.amplification(1.0, damping) @ state
        errors.append(abs(state[0] - exact))
    # Of a second-order method the error falls by four, up to terms of the next order.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("step", "alpha"), [(0.0, 0.0), (float("nan"), 0.0), (1e-3, 0.1), (1e-3, -0.4)])
def test_coefficients_out_of_range_are_refused(step: float, alpha: float) -> None:
    with pytest.raises(ValueError, match="required"):
        Newmark(step, alpha)
