"""Where runs start from: static equilibrium, its deflections, 'rest' and given states."""

from functools import cache

import numpy as np
import pytest
from closed_forms import WinklerBeam
from direct_integration import DirectIntegration

import tbatch as tb

QUARTER = tb.Vehicle.column(
    carbody_mass=10000.0, bogie_mass=1500.0, wheel_mass=2000.0, secondary=(1e5, 1.5e4), primary=(1.6e6, 4e4), rails=2
)
"""A quarter of the seed's coach on one wheelset: 132.435 kN."""
LOAD = 132435.0
BAY, SEAT = 0.65, 39.0
HERTZ = tb.Contact.hertz(wheel_radius=0.4575)
LAYERS = ("rail", "slab", "base")


@cache
def slab(per: str, elements_per_bay: int) -> tb.Track:
    return tb.Track.slab("seed-slab", length=78.0, elements_per_bay=elements_per_bay, per=per)


@pytest.mark.parametrize(
    ("per", "expected"), [("fastener", (0.8833, 0.4098, 0.3646)), ("metre", (1.0443, 0.5729, 0.5074))]
)
def test_one_wheelset_at_a_seat_presses_the_slab_track_down_as_known(per, expected, holds):
    for elements, tolerance in ((4, 0.0), (1, 5e-4)):
        model = tb.Model.build(QUARTER, slab(per, elements), HERTZ, step=1e-4)
        assert model.static_load == pytest.approx(LOAD, rel=1e-12)
        save = tb.SaveAt(1e-4, LAYERS, rail_at=[SEAT])
        result = tb.simulate(model, tb.Runs([0.0], None, SEAT), 1e-4, save=save, threads=1)
        for layer, known in zip(LAYERS, expected, strict=True):
            # Known to half a digit of 1e-4 mm; one element a bay is within 5e-4 besides.
            error = abs(1e3 * getattr(result, layer)[0, 0, 0] - known)
            assert holds(f"{layer} in mm, {elements} per bay", error, 0.51e-4 + tolerance * known)


def test_a_standing_vehicle_stays_at_its_static_loads_to_round_off(holds):
    vehicle = tb.Vehicle.coach("seed-multiwheel")
    track = tb.Track.slab("seed-slab", length=36.4)
    for contact in (HERTZ, tb.Contact.linear(), tb.Contact.affine()):
        model = tb.Model.build(vehicle, track, contact, step=1e-4)
        save = tb.SaveAt(1e-3, ("contact_force", "vehicle", *LAYERS), rail_at=[15.0, 25.0])
        starts = np.array([28.6, 28.73])
        result = tb.simulate(model, tb.Runs([0.0, 0.0], None, starts), 0.5, save=save, threads=1)
        # The round-off of a step, 1e-16, is seen through K̂/K ≈ 1e5: the run settles 1e-11 beside where it began, and
        # stays there.
        change = np.abs(result.contact_force / result.contact_force[:, :1] - 1.0)
        assert holds(f"force within 5000 steps, {contact.law}", change.max(), 1e-10)
        assert holds(
            "last tenth against the one before", np.abs(change[:, 450:].max() - change[:, 400:450].max()), 1e-11
        )
        for channel in ("vehicle", *LAYERS):
            history = getattr(result, channel)
            assert holds(f"{channel} within 5000 steps, m", np.abs(history - history[:, :1]).max(), 1e-10)
        # At a seat or not, four wheelsets together carry the coach.
        assert result.contact_force[:, 0].sum(1) == pytest.approx(4.0 * LOAD, rel=1e-12)


def test_a_creeping_wheelset_presses_the_track_down_as_if_it_stood(holds):
    model = tb.Model.build(QUARTER, slab("fastener", 1), HERTZ, step=1e-3)
    save = tb.SaveAt(1e-3, ("contact_force", *LAYERS), rail_at=[SEAT])
    result = tb.simulate(model, tb.Runs([1.0], None, SEAT - BAY), BAY + 0.2, save=save, threads=1)
    over = round(BAY / 1e-3)
    standing = tb.simulate(model, tb.Runs([0.0], None, SEAT), 1e-3, save=save, threads=1)
    # m v²(2π/bay)² times the 5 µm that the wheelset sinks between seats is 1 N of 132 kN; the start is a blow of 2e-5.
    assert holds("force at 1 m/s", np.abs(result.contact_force[0, :, 0] / LOAD - 1.0).max(), 5e-5)
    for layer in LAYERS:
        still = getattr(standing, layer)[0, 0, 0]
        assert holds(f"{layer} at 1 m/s", abs(getattr(result, layer)[0, over, 0] / still - 1.0), 2e-5)


def test_a_wheel_on_a_winkler_bed_sinks_by_the_closed_form(holds):
    beam = WinklerBeam(6.12e6, 60.0, 1.0e7)
    vehicle = tb.Vehicle.column("koh-column")
    contact = tb.Contact.hertz(wheel_radius=0.4575)
    load = vehicle.weight.sum()
    depth = load * beam.wavenumber / (2.0 * beam.stiffness)
    for element, tolerance in ((0.5, 5e-4), (0.25, 5e-4 / 16.0)):
        track = tb.Track.winkler("koh-winkler", length=40.0, elements=round(40.0 / element))
        model = tb.Model.build(vehicle, track, contact, step=1e-4)
        start = 20.0 + element * np.array([0.0, 0.25, 0.5])
        save = tb.SaveAt(1e-4, ("vehicle",))
        result = tb.simulate(model, tb.Runs(np.zeros(3), None, start), 1e-4, save=save, threads=1)
        # Fourth order in the element's length beside 1/λ = 1.25 m, at the nodes and, by the local compliance, between.
        assert holds(f"wheel on {element:g} m elements", np.abs(result.vehicle[:, 0, 2] / depth - 1.0).max(), tolerance)


def test_the_loaded_element_bends_within_itself(holds):
    # CHN60 on seats of 60 MN/m every 0.65 m that stand on rock: mortar and subgrade as stiff as the arithmetic bears.
    # The column is half the quarter coach, 66.2175 kN; at standstill its wheel is where the rail is.
    rail, rock = (2.059e11 * 3.217e-5, 60.64), (1e14, 1e5)
    half = tb.Vehicle.column(
        carbody_mass=5000.0, bogie_mass=750.0, wheel_mass=1000.0, secondary=(5e4, 7.5e3), primary=(8e5, 2e4)
    )
    places = 30 * BAY + BAY * np.array([0.0, 0.5])

    def deflections(elements_per_bay: int, local: bool) -> np.ndarray:
        track = tb.Track.slab(
            length=39.0, elements_per_bay=elements_per_bay, bay=BAY, rail=rail, fastener=(60e6, 47.7e3),
            slab=(6.63e7, 1275.0), mortar=rock, base=(1.99e8, 2212.5), subgrade=rock, rails=1,
        )  # fmt: skip
        model = tb.Model.build(half, track, HERTZ, step=1e-4, local_compliance=local)
        save = tb.SaveAt(1e-4, ("vehicle",))
        return 1e6 * tb.simulate(model, tb.Runs([0.0, 0.0], None, places), 1e-4, save=save, threads=1).vehicle[:, 0, 2]

    plain, mended, fine = deflections(1, False), deflections(1, True), deflections(4, False)
    # Rock gives 0.002 µm; the known values are good to 0.005 µm.
    assert holds("seat, one element a bay, µm", abs(plain[0] - 487.03), 0.01)
    assert holds("mid-bay, one plain element a bay, µm", abs(plain[1] - 481.19), 0.01)
    assert holds("mid-bay, four elements a bay, µm", abs(fine[1] - 495.49), 0.01)
    # The local term is the exact difference of the loaded element; the rest of the line is one element a bay.
    assert holds("mid-bay, one element and local compliance, µm", abs(mended[1] - 495.49), 0.01)
    # The sleeper-passing excitation: the wheel sinks between the seats, and rises there without the term.
    assert mended[1] - mended[0] > 8.0 and fine[1] - fine[0] > 8.0
    assert plain[1] - plain[0] < -5.0


KOH = tb.Vehicle.column("koh-column")
BED = tb.Track.winkler("koh-winkler", length=30.0, elements=40)
KOH_HERTZ = (3.86e-8 * 0.4575**-0.115) ** -1.5
TIMES = np.arange(101) * 1e-4


def koh_system(speed: float, start: float) -> DirectIntegration:
    return DirectIntegration(KOH, BED, KOH_HERTZ, 1.5, speed, start, rail_EI=2.0e11 * 3.06e-5)


def koh_run(speed: float, start: float, initial: str | tb.State) -> tuple[tb.Result, np.ndarray]:
    model = tb.Model.build(KOH, BED, tb.Contact.hertz(wheel_radius=0.4575), step=2.5e-6)
    save = tb.SaveAt(1e-4, ("contact_force", "vehicle", "rail"), rail_at=[15.0])
    result = tb.simulate(model, tb.Runs([speed], None, start), TIMES[-1], initial=initial, save=save, threads=1)
    return result, result.vehicle[0] + model.static_vehicle


def resting() -> np.ndarray:
    """Dofs of the column from the unloaded position on a rigid rail."""
    load = 9.81 * np.cumsum([3500.0, 250.0, 350.0])
    overlap = (load[2] / KOH_HERTZ) ** (2.0 / 3.0)
    return np.array([overlap + load[1] / 1.26e6 + load[0] / 1.41e5, overlap + load[1] / 1.26e6, overlap])


def test_rest_starts_on_an_undeformed_track_with_the_static_load(holds):
    start, local = 14.55, 0.3**3 * 0.45**3 / (3 * 2.0e11 * 3.06e-5 * 0.75**3)
    load = 9.81 * 4100.0
    z = resting()
    z[2] += local * load
    system = koh_system(30.0, start)
    initial = np.zeros(2 * (system.nv + system.nt))
    initial[:3] = z
    history = system.run(TIMES, initial=initial, rtol=1e-7)
    result, vehicle = koh_run(30.0, start, "rest")
    assert result.contact_force[0, 0, 0] == pytest.approx(load, rel=1e-12)
    assert (result.rail[0, 0] == 0.0).all()
    # The undeformed track takes the load as a blow; 2.5 µs resolve the 1 kHz contact with rail modes to 1e-4.
    assert holds("force, of the load", np.abs(result.contact_force[0, :, 0] - history.force[:, 0]).max() / load, 3e-4)
    assert holds("vehicle", np.abs(vehicle - history.vehicle).max() / np.abs(history.vehicle - z).max(), 1e-4)


def test_a_given_state_is_carried_on_from_its_displacements_and_velocities(holds):
    speed, start = 30.0, 14.5
    x = np.arange(41) * 0.75
    wave, slope = np.sin(np.pi * x / 7.5), np.pi / 7.5 * np.cos(np.pi * x / 7.5)
    track, velocity = 4e-4 * np.stack([wave, slope], 1), 0.03 * np.stack([wave, slope], 1)
    track[[0, -1], 0] = velocity[[0, -1], 0] = 0.0
    q, rate = np.array([2e-3, -1e-3, 1.5e-4]), np.array([0.01, 0.05, 0.02])
    system = koh_system(speed, start)
    initial = np.concatenate([resting() + q, track.ravel(), rate, velocity.ravel()])
    history = system.run(TIMES, initial=initial, rtol=1e-7)
    result, vehicle = koh_run(speed, start, tb.State(q, rate, track, velocity))
    load = 9.81 * 4100.0
    assert holds("force at t = 0, of the load", abs(result.contact_force[0, 0, 0] - history.force[0, 0]) / load, 1e-9)
    # As above; the state is far out of balance, begins with eight times the load and leaves the rail at once.
    assert len(history.lost) == 1
    error = np.abs(result.contact_force[0, :, 0] - history.force[:, 0]).max()
    assert holds("force, of the peak", error / history.force.max(), 4e-4)
    assert holds("vehicle", np.abs(vehicle - history.vehicle).max() / np.abs(q).max(), 1e-4)


def test_the_static_state_is_an_equilibrium_of_the_independent_system(holds):
    result, vehicle = koh_run(30.0, 14.55, "static")
    history = koh_system(30.0, 14.55).run(TIMES, rtol=1e-7)
    # Newton's method on either side, to round-off.
    assert holds(
        "vehicle at t = 0", np.abs(vehicle[0] - history.vehicle[0]).max() / np.abs(history.vehicle[0]).max(), 1e-11
    )
    # No blow here: the wheel merely begins to roll.
    assert holds(
        "force, of the load", np.abs(result.contact_force[0, :, 0] - history.force[:, 0]).max() / (9.81 * 4100), 1e-4
    )
