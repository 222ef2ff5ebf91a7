"""A sprung mass of two stages that crosses a simply supported beam, against the beam's modes integrated to 1e-8."""

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

import tbatch as tb

SPAN, EI, MASS = 25.0, 2.87e9 * 2.90, 2303.0
RAYLEIGH = 2e-4
"""β [s]: 0.3 % of critical damping in the first mode. Without it all modes ring on from the entry, and mesh and
step get those wrong that they do not resolve."""
MASSES = np.array([5000.0, 400.0, 350.0])
"""body, frame and wheel [kg]"""
SECONDARY, PRIMARY = (1.595e6, 1.0e3), (6.0e6, 5.0e3)
HERTZ, LINEAR = 1.15e11, 1.5e9
SPEED, SAMPLES = 27.78, 500
LOAD = MASSES.sum() * 9.81


@cache
def modal(stiffness: float, exponent: float, modes: int = 40) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact force [N], body's movement [m] and mid-span deflection [m] at the samples, by Radau on the modes.

    Forty modes: those left out hold Σ 2/(mLω²) ≈ 5e-6 of the deflection, and 60 change the force by 5e-6 of the load.
    """
    j = np.arange(1, modes + 1)
    omega = (j * np.pi / SPAN) ** 2 * np.sqrt(EI / MASS)
    n = modes + 3
    fixed = np.zeros((2 * n, 2 * n))
    fixed[:n, n:] = np.eye(n)
    fixed[n + 3 :, 3:n], fixed[n + 3 :, n + 3 :] = -np.diag(omega**2), -np.diag(RAYLEIGH * omega**2)
    upper, lower = np.array([1.0, -1.0, 0.0]), np.array([0.0, 1.0, -1.0])
    for first, part in ((0, 0), (n, 1)):
        links = SECONDARY[part] * np.outer(upper, upper) + PRIMARY[part] * np.outer(lower, lower)
        fixed[n : n + 3, first : first + 3] = -links / MASSES[:, None]

    def overlap(t: float, y: np.ndarray) -> tuple[np.ndarray, float]:
        shape = np.sin(j * np.pi * SPEED * t / SPAN)
        return shape, max(y[2] - shape @ y[3:n], 0.0)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        shape, delta = overlap(t, y)
        force = stiffness * delta**exponent
        dy = fixed @ y
        dy[n : n + 3] += 9.81
        dy[n + 2] -= force / MASSES[2]
        dy[n + 3 :] += 2.0 * force / (MASS * SPAN) * shape
        return dy

    def jacobian(t: float, y: np.ndarray) -> np.ndarray:
        shape, delta = overlap(t, y)
        row = stiffness * exponent * delta ** (exponent - 1.0) * np.concatenate([[0.0, 0.0, 1.0], -shape])
        result = fixed.copy()
        result[n + 2, :n] -= row / MASSES[2]
        result[n + 3 :, :n] += np.outer(2.0 / (MASS * SPAN) * shape, row)
        return result

    start = np.zeros(2 * n)
    start[2] = (LOAD / stiffness) ** (1.0 / exponent)
    start[1] = start[2] + (MASSES[0] + MASSES[1]) * 9.81 / PRIMARY[0]
    start[0] = start[1] + MASSES[0] * 9.81 / SECONDARY[0]
    time = np.linspace(0.0, SPAN / SPEED, SAMPLES + 1)
    atol = 1e-8 * np.repeat([1e-5, 1e-3], n)
    y = solve_ivp(rate, (0.0, time[-1]), start, "Radau", time, rtol=1e-8, atol=atol, jac=jacobian).y
    force = np.array([stiffness * overlap(t, y[:, i])[1] ** exponent for i, t in enumerate(time)])
    return force, y[0] - start[0], np.sin(0.5 * j * np.pi) @ y[3:n]


def errors(contact: tb.Contact, reference: tuple[np.ndarray, ...], elements: int, substeps: int) -> np.ndarray:
    """Largest errors of force (of the load), body and mid-span (of their largest)."""
    body, frame, wheel = MASSES
    vehicle = tb.Vehicle.column(
        carbody_mass=body, bogie_mass=frame, wheel_mass=wheel, secondary=SECONDARY, primary=PRIMARY
    )
    track = tb.Track.beam(length=SPAN, elements=elements, EI=EI, mass=MASS, rayleigh=(0.0, RAYLEIGH))
    step = SPAN / SPEED / SAMPLES / substeps
    result = tb.simulate(
        tb.Model.build(vehicle, track, contact, step=step),
        tb.Runs([SPEED], None, 0.0),
        SPAN / SPEED,
        save=tb.SaveAt(step * substeps, ("contact_force", "vehicle", "rail"), rail_at=[0.5 * SPAN]),
        threads=1,
    )
    force, movement, middle = reference
    return np.array(
        [
            np.abs(result.contact_force[0, :, 0] - force).max() / LOAD,
            np.abs(result.vehicle[0, :, 0] - movement).max() / np.abs(movement).max(),
            np.abs(result.rail[0, :, 0] - middle).max() / np.abs(middle).max(),
        ]
    )


def check(contact: tb.Contact, reference: tuple[np.ndarray, ...], holds) -> None:
    force, body, middle = errors(contact, reference, 20, 8)
    # A step of 0.22 ms: Δt² gives 1.3e-5 in the force; the modes left out of the reference 5e-6.
    assert holds("force, of the load", force, 3e-5)
    assert holds("body, of its largest movement", body, 1.5e-5)
    assert holds("mid-span deflection, of its largest", middle, 1.5e-5)


def test_a_sprung_mass_on_hertz_contact_crosses_the_beam_as_its_modes_say(holds):
    check(tb.Contact.hertz(constant=HERTZ), modal(HERTZ, 1.5), holds)


def test_a_sprung_mass_on_a_stiff_linear_contact_crosses_the_beam_as_its_modes_say(holds):
    check(tb.Contact.linear(LINEAR), modal(LINEAR, 1.0), holds)


def test_the_sprung_mass_converges_with_the_square_of_the_step():
    reference = modal(HERTZ, 1.5)
    substeps = np.array([1, 2, 4, 8])
    history = [errors(tb.Contact.hertz(constant=HERTZ), reference, 20, n)[[0, 2]] for n in substeps]
    force, middle = -np.polyfit(np.log(substeps), np.log(history), 1)[0]
    # Of 0.0018 s steps some modes are not resolved yet, so that the force starts better than its order says.
    assert 1.0 < force < 2.3
    assert np.log2(history[2][0] / history[3][0]) > 1.7
    assert 1.8 < middle < 2.3
