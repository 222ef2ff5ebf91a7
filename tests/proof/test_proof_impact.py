"""A wheel that falls on a rail which does not give: closed forms, energy, and the table of separations."""

import numpy as np
import pytest
from closed_forms import GRAVITY, bounce_on_spring, hertz_impact

import tbatch as tb

MASS, SPRING, HERTZ = 350.0, 1.2e9, 1.15e11
RAIL = tb.Track.rigid(length=10.0)
HALF_PERIOD = np.pi * np.sqrt(MASS / SPRING)
IMPACT_SPEED = 0.3
IMPACT_TIME = hertz_impact(MASS, HERTZ, IMPACT_SPEED)[1]
CONTACTS = {
    "linear": (tb.Contact.linear(SPRING), HALF_PERIOD),
    "hertz": (tb.Contact.hertz(constant=HERTZ), IMPACT_TIME),
}


def mass(weight: float) -> tb.Vehicle:
    return tb.Vehicle([[MASS]], [[0.0]], [[0.0]], [0], [0.0], [weight])


def fall(
    contact: tb.Contact, weight: float, step: float, height, speed, steps: int, rolling: float = 0.0, **model
) -> tb.Result:
    """Runs of a wheel `height` above the rail, falling with `speed`; one entry a run."""
    built = tb.Model.build(mass(weight), RAIL, contact, step=step, **model)
    height, speed = np.broadcast_arrays(np.asarray(height, float), np.asarray(speed, float))
    start = -height - built.static_vehicle[0]
    return tb.simulate(
        built,
        tb.Runs(np.full(len(height), rolling), None, 5.0),
        steps * step,
        initial=tb.State(start[:, None], speed[:, None].copy()),
        save=tb.SaveAt(step, ("contact_force", "vehicle")),
        threads=1,
    )


def crossings(time: np.ndarray, overlap: np.ndarray) -> tuple[float, float]:
    """Times of the first contact and of its end, by straight lines through the overlaps at either side."""
    inside = np.flatnonzero(overlap > 0.0)
    first = inside[0]
    last = first + np.argmin(overlap[first:] > 0.0)
    times = [time[i] - overlap[i] * (time[i] - time[i - 1]) / (overlap[i] - overlap[i - 1]) for i in (first, last)]
    return times[0], times[1]


def half_digit(printed: str) -> float:
    return 0.5 * 10.0 ** -len(printed.partition(".")[2])


def test_a_dropped_wheel_meets_a_unilateral_spring_as_the_closed_form_says(holds):
    heights = np.geomspace(1e-5, 1e-2, 16)
    weight, step = MASS * GRAVITY, HALF_PERIOD / 100.0
    # The runs begin late in the fall, two micrometres above the rail; the heights give phases of landing.
    low = np.full(16, 2e-6)
    result = fall(CONTACTS["linear"][0], weight, step, low, np.sqrt(2.0 * GRAVITY * (heights - low)), 260)
    rest = weight / SPRING
    force_error, time_error = 0.0, 0.0
    for i, height in enumerate(heights):
        largest, duration = bounce_on_spring(MASS, SPRING, height)
        begin, end = crossings(result.time, result.vehicle[i, :, 0] + rest)
        force_error = max(force_error, abs(result.contact_force[i].max() / largest - 1.0))
        time_error = max(time_error, abs((end - begin) / duration - 1.0))
    # Second order: (ωΔt)² is 1e-3 here and its factor below one; the sampled peak is up to (ωΔt)²/8 low.
    assert holds("largest force", force_error, 4e-4)
    assert holds("contact time", time_error, 4e-4)


def test_a_hertz_impact_has_the_closed_form_approach_and_contact_time(holds):
    speeds = np.geomspace(0.02, 1.0, 16)
    approach_error, time_error = 0.0, 0.0
    for speed in speeds:
        approach, duration = hertz_impact(MASS, HERTZ, speed)
        step = duration / 100.0
        result = fall(CONTACTS["hertz"][0], 0.0, step, [1.37 * speed * step], [speed], 110)
        overlap = result.vehicle[0, :, 0]
        begin, end = crossings(result.time, overlap)
        approach_error = max(approach_error, abs(overlap.max() / approach - 1.0))
        time_error = max(time_error, abs((end - begin) / duration - 1.0))
    # Second order with 100 steps a contact: (π/100)² = 1e-3, and its factor is a fraction.
    assert holds("largest approach", approach_error, 3e-4)
    assert holds("contact time", time_error, 3e-4)


@pytest.mark.parametrize("splitting", [2.0 - 2.0**0.5, 0.5])
@pytest.mark.parametrize(
    ("law", "per_contact", "low", "high"),
    [
        ("linear", 1, "0.62", "1.32"),
        ("linear", 2, "0.88", "1.08"),
        ("linear", 4, "0.98", "1.013"),
        ("linear", 10, "0.998", "1.002"),
        ("hertz", 1, "0.67", "1.18"),
        ("hertz", 2, "0.94", "0.99"),
        ("hertz", 4, "0.989", "0.999"),
        ("hertz", 10, "0.998", "1.002"),
    ],
)
def test_restitution_stays_within_its_bounds_at_every_phase_of_landing(law, per_contact, low, high, splitting, holds):
    contact, duration = CONTACTS[law]
    step = duration / per_contact
    phases = (np.arange(512) + 0.5) / 512
    height = IMPACT_SPEED * step * (1.0 + phases)
    result = fall(contact, 0.0, step, height, np.full(512, IMPACT_SPEED), 3 * per_contact + 12, splitting=splitting)
    z = result.vehicle[:, :, 0]
    restitution = (z[:, -2] - z[:, -1]) / step / IMPACT_SPEED
    assert (result.contact_force[:, -2:] == 0.0).all()
    # The bounds are good to half of their last digit, and hold for both splittings.
    assert holds("below the least restitution", float(low) - restitution.min(), half_digit(low))
    assert holds("above the greatest restitution", restitution.max() - float(high), half_digit(high))


@pytest.mark.parametrize("law", ["linear", "hertz"])
def test_energy_lost_in_an_impact_falls_with_the_square_of_the_step(law):
    contact, duration = CONTACTS[law]
    counts = np.array([8, 16, 32, 64])
    lost = []
    for n in counts:
        step = duration / n
        height = IMPACT_SPEED * step * (1.0 + (np.arange(64) + 0.5) / 64)
        z = fall(contact, 0.0, step, height, np.full(64, IMPACT_SPEED), n + 8).vehicle[:, :, 0]
        lost.append(np.abs(1.0 - (z[:, -2] - z[:, -1]) / step / IMPACT_SPEED).max())
    order = -np.polyfit(np.log(counts), np.log(lost), 1)[0]
    # At least second order in the worst phase; nearly third is seen.
    assert order > 1.9


def test_flights_between_bounces_are_reported_as_separations(holds):
    weight, step, speed = MASS * GRAVITY, HALF_PERIOD / 80.0, 0.2
    flight, rise = 2.0 * speed / GRAVITY, speed**2 / (2.0 * GRAVITY)
    largest, duration = bounce_on_spring(MASS, SPRING, rise)
    steps = int(4.0 * (flight + duration) / step)
    # Rolling at 1 m/s: a wheel's statistics begin beyond the place where it starts.
    above = 2e-5
    falling = np.sqrt(speed**2 - 2.0 * GRAVITY * above)
    result = fall(CONTACTS["linear"][0], weight, step, [above], [falling], steps, rolling=1.0)
    table = result.separations.to_pydict()
    # The run starts in the air: that separation is censored, and so is the one that its end cuts.
    assert table["censored"] == [True, False, False, False, True]
    whole = slice(1, 4)
    start, end = np.array(table["start"])[whole], np.array(table["end"])[whole]
    # Sampled at step ends: first order. A bounce under gravity returns 1 ± 1e-4 of the speed at 80 steps a half-period;
    # three bounces come before the last flight.
    assert holds("duration of a flight", np.abs(end - start - flight).max(), 1.01 * step + 3e-4 * flight)
    assert holds("bounce from end to start", np.abs(start[1:] - end[:-1] - duration).max(), 1.01 * step)
    # The highest sample is within half a step of the top, 1e-6 of the rise; the bounces' energy is what counts.
    assert holds("gap", np.abs(np.array(table["gap"])[whole] / rise - 1.0).max(), 6e-4)
    # The peak is sampled within (ωΔt)²/8 = 2e-4, and the speed of landing is known to 3e-4.
    assert holds("landing force", np.abs(np.array(table["landing_force"])[whole] / largest - 1.0).max(), 5e-4)


def scalar_two_step(height: np.ndarray, speed: float, step: float, steps: int, splitting: float) -> np.ndarray:
    """Overlap of a heavy wheel on a unilateral spring, shape (step, run), by the scheme written with accelerations."""
    h = splitting * step
    c1, c2 = (1.0 - splitting) / (splitting * step), -1.0 / ((1.0 - splitting) * splitting * step)
    c3 = (2.0 - splitting) / ((1.0 - splitting) * step)

    def solved(inertia: float, load: np.ndarray) -> np.ndarray:
        # inertia u + k max(u, 0) = load, by the sign of u.
        return np.where(load > 0.0, load / (inertia + SPRING), load / inertia)

    u, v = -height, np.full(height.shape, speed)
    history = [u]
    for _ in range(steps):
        a = GRAVITY - SPRING * np.maximum(u, 0.0) / MASS
        u1 = solved(4.0 * MASS / h**2, MASS * (GRAVITY + 4.0 * u / h**2 + 4.0 * v / h + a))
        v1 = 2.0 * (u1 - u) / h - v
        u2 = solved(MASS * c3**2, MASS * (GRAVITY - c1 * v - c2 * v1 - c3 * (c1 * u + c2 * u1)))
        v, u = c1 * u + c2 * u1 + c3 * u2, u2
        history.append(u)
    return np.array(history)


@pytest.mark.parametrize("splitting", [2.0 - 2.0**0.5, 0.5])
@pytest.mark.parametrize("per_contact", [1, 4, 40])
def test_a_bouncing_wheel_is_stepped_as_the_written_scheme_says(per_contact, splitting, holds):
    step, steps = HALF_PERIOD / per_contact, 4 * per_contact + 10
    height = 0.2 * step * (1.0 + (np.arange(64) + 0.5) / 64)
    speed = np.full(64, 0.2)
    result = fall(CONTACTS["linear"][0], MASS * GRAVITY, step, height, speed, steps, splitting=splitting)
    expected = scalar_two_step(height, 0.2, step, steps, splitting)
    overlap = result.vehicle[:, :, 0].T + MASS * GRAVITY / SPRING
    # The same equations in increments and from rest: round-off alone.
    assert holds("overlap, of the largest movement", np.abs(overlap - expected).max() / np.abs(expected).max(), 1e-11)
