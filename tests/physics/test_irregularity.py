import pickle
import warnings

import numpy as np
import pytest

from tbatch.physics.irregularity import Irregularity
from tbatch.physics.partition import Piece
from tbatch.physics.profile import Profile
from tbatch.physics.spectra import Density
from tbatch.physics.waves import Waves

DEPTH, LENGTH = 2.15e-3, 0.150


def trunk_line(sample=0, **options):
    options = {"wavelengths": (0.3, 50.0), "tail": 3, "seed": 1, "period": 200.0, **options}
    return Irregularity.spectrum("china-trunk-line", sample=sample, **options)


def haversine(x, at):
    s = (x - at) / LENGTH
    return np.where((s > 0.0) & (s < 1.0), 0.5 * DEPTH * (1.0 - np.cos(2.0 * np.pi * s)), 0.0)


# --- waves ------------------------------------------------------------------------------------------------------------


def test_cosines_are_the_sum_they_say():
    f, a, phase = [0.1, 0.37], [1e-3, 2e-4], [0.3, -1.0]
    x = np.linspace(-5.0, 40.0, 500)
    expected = 1e-3 * np.cos(2.0 * np.pi * 0.1 * x + 0.3) + 2e-4 * np.cos(2.0 * np.pi * 0.37 * x - 1.0)
    rough = Irregularity.cosines(f, a, phase)
    np.testing.assert_allclose(rough(x), expected, rtol=0.0, atol=1e-17)
    assert rough.shortest_wavelength == pytest.approx(1.0 / 0.37)
    assert rough.period == np.inf


@pytest.mark.parametrize("amplitude", [1e-6, 1e-3, 0.1])
def test_the_spline_of_cosines_errs_by_a_nanometre_at_most(amplitude):
    rough = Irregularity.cosines([0.02, 0.5, 3.0], [amplitude, 0.1 * amplitude, 0.01 * amplitude], [0.1, 0.2, 0.3])
    x = np.random.default_rng(0).uniform(0.0, 60.0, 20_000)
    assert np.abs(rough.profile(0.0, 60.0)(x) - rough(x)).max() < 1.02e-9


def test_a_wave_without_length_is_a_constant():
    rough = Irregularity.cosines(0.0, 1e-3)
    # Round-off of the spline's solve.
    np.testing.assert_allclose(rough.profile(0.0, 10.0)(np.linspace(0.0, 10.0, 50)), 1e-3, rtol=1e-14)
    assert rough.shortest_wavelength == np.inf


def test_twenty_knots_a_wave_keep_its_curvature_to_0_8_percent():
    wavelength, amplitude = 0.3, 1e-4
    wave = Waves(np.array([1.0 / wavelength]), np.array([amplitude]), np.array([0.7]), spacing=wavelength / 20.0)
    profile = Irregularity((wave,)).profile(0.0, 12.0)
    h = 1.0 / profile.inverse_spacing[0]
    c = profile.coefficient
    curvature = (c[:-2] - 2.0 * c[1:-1] + c[2:]) / h**2
    exact = -((2.0 * np.pi / wavelength) ** 2) * wave(profile.start[0] + h * np.arange(curvature.size))
    scale = amplitude * (2.0 * np.pi / wavelength) ** 2
    # (2π/20)²/12 = 0.82 %, up to the very ends.
    assert np.abs(curvature - exact).max() / scale < 0.0083


def test_fast_synthesis_equals_the_direct_sum():
    (wave,) = trunk_line(period=1000.0).terms
    for low, width, count in ((0.0, 0.015, 8000), (37.123, 0.00371, 700), (-3.0, 0.5, 40)):
        direct = wave(low + width * np.arange(count + 1))
        # The chirp's phases reach a thousand turns, so they are known to 1e-12 rad: times 3 mm.
        assert np.abs(wave.on_grid(low, width, count) - direct).max() < 1e-14


def test_equidistant_cosines_take_the_fast_way_to_the_same_values():
    rng = np.random.default_rng(5)
    a, phase = rng.normal(size=300) * 1e-4, rng.uniform(0.0, 6.0, 300)
    for f in (0.02 + 0.01 * np.arange(300), np.linspace(0.02, 3.0, 300), np.sort(rng.uniform(0.02, 3.0, 300))):
        (wave,) = Irregularity.cosines(f, a, phase).terms
        grid = wave.on_grid(900.0, 0.02, 500)
        assert np.abs(grid - wave(900.0 + 0.02 * np.arange(501))).max() < 1e-14


# --- spectra ----------------------------------------------------------------------------------------------------------


def test_every_fixed_sample_has_the_variance_of_the_density():
    expected = Density("china-trunk-line", 3.0).variance((0.3, 50.0))
    for sample in range(3):
        (wave,) = trunk_line(sample).terms
        assert 0.5 * np.sum(wave.amplitude**2) == pytest.approx(expected, rel=1e-12)


def test_rayleigh_amplitudes_have_it_on_the_average():
    expected = Density("china-trunk-line", 3.0).variance((0.3, 50.0))
    variances = []
    for sample in range(400):
        (wave,) = trunk_line(sample, amplitudes="rayleigh").terms
        variances.append(0.5 * np.sum(wave.amplitude**2))
    deviation = np.std(variances)
    assert deviation > 0.05 * expected
    # Four standard errors.
    assert np.mean(variances) == pytest.approx(expected, abs=4.0 * deviation / 20.0)


def test_scale_multiplies_the_level_not_the_density():
    x = np.linspace(0.0, 100.0, 50)
    np.testing.assert_allclose(trunk_line(scale=2.5)(x), 2.5 * trunk_line()(x), rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("amplitudes", ["fixed", "rayleigh"])
def test_samples_have_the_density_they_were_drawn_from(amplitudes):
    length, count, samples = 500.0, 4096, 40
    x = length / count * np.arange(count)
    window = np.hanning(count)
    power = np.zeros(count // 2 + 1)
    for sample in range(samples):
        rough = trunk_line(sample, period=600.0, wavelengths=(1.0, 50.0), amplitudes=amplitudes)
        power += np.abs(np.fft.rfft(window * rough.profile(0.0, length)(x))) ** 2
    estimate = 2.0 * power * (length / count) / (count * np.mean(window**2)) / samples
    f = np.arange(estimate.size) / length
    for low, high in ((0.03, 0.06), (0.06, 0.12), (0.12, 0.25), (0.25, 0.5), (0.5, 0.95)):
        inside = (f >= low) & (f < high)
        expected = Irregularity.density("china-trunk-line", f[inside], tail=3)
        # At least 15 periodogram values of 40 samples each: standard error at most 1/√600, Hann's overlap makes it 5 %.
        assert np.mean(estimate[inside] / expected) == pytest.approx(1.0, abs=0.15)


def test_a_sample_depends_on_seed_and_number_alone():
    x = np.linspace(0.0, 150.0, 4000)
    first = trunk_line(3)
    other = trunk_line(4)
    assert first.profile(0.0, 150.0)(x).tobytes() == trunk_line(3).profile(0.0, 150.0)(x).tobytes()
    # Independent phases: the correlation of (0.3-1 m) waves over 150 m has a standard deviation of a few per cent.
    short = {"wavelengths": (0.3, 1.0)}
    pairs = [(trunk_line(i, **short)(x), trunk_line(i + 1, **short)(x)) for i in range(3)]
    assert all(abs(np.corrcoef(a, b)[0, 1]) < 0.3 for a, b in pairs)
    assert not np.array_equal(first(x), other(x))
    assert not np.array_equal(first(x), trunk_line(3, seed=2)(x))


def test_left_and_right_rail_of_one_sample_are_drawn_apart():
    left = trunk_line().terms[0]
    right = Irregularity.spectrum(
        "china-trunk-line-right", wavelengths=(0.3, 50.0), tail=3, seed=1, period=200.0
    ).terms[0]
    assert abs(np.corrcoef(np.cos(left.phase), np.cos(right.phase))[0, 1]) < 0.2


def test_the_spline_of_a_spectrum_is_close_and_its_knots_do_not_depend_on_the_range():
    rough = trunk_line()
    x = np.random.default_rng(2).uniform(20.0, 60.0, 5000)
    wide, narrow = rough.profile(0.0, 120.0), rough.profile(19.3, 61.7)
    assert np.abs(wide(x) - rough(x)).max() < 1e-8
    # Same knots: what remains is round-off, as the effect of the end slopes decays by 0.27 a knot.
    assert np.abs(wide(x) - narrow(x))[(x > 21.0) & (x < 60.0)].max() < 1e-14
    assert wide.segment_count == 1
    assert 1.0 / wide.inverse_spacing[0] <= 0.3 / 20.0 * (1.0 + 1e-9)


def test_a_span_longer_than_the_period_is_refused():
    with pytest.raises(ValueError, match=r"span of 250 m .* period = 200 m"):
        trunk_line().profile(0.0, 250.0)
    with pytest.raises(ValueError, match="period = 200 m"):
        (trunk_line().taper(0.0, 5.0) + np.sin).profile(0.0, 250.0)


# --- flats, callables, sums -------------------------------------------------------------------------------------------


def test_a_flat_in_a_rough_rail_is_right_to_0_1_micrometre_everywhere():
    rough = trunk_line() + Irregularity.flat(depth=DEPTH, length=LENGTH, at=50.003)
    profile = rough.profile(0.0, 120.0)
    x = np.concatenate([np.linspace(0.0, 120.0, 3001), np.linspace(49.9, 50.3, 4001)])
    exact = trunk_line()(x) + haversine(x, 50.003)
    assert np.abs(profile(x) - exact).max() < 1e-8
    # The fine knots are where the flat is, not all along the line.
    assert profile.coefficient.size < 8200


def test_flats_add_up_where_they_overlap():
    rough = Irregularity.flat(DEPTH, LENGTH, 1.0) + Irregularity.flat(DEPTH, LENGTH, 1.1)
    x = np.linspace(0.9, 1.4, 2001)
    assert np.abs(rough.profile(0.9, 1.4)(x) - haversine(x, 1.0) - haversine(x, 1.1)).max() < 2e-9


def test_a_flat_may_lie_across_the_end_of_the_range():
    rough = Irregularity.flat(DEPTH, LENGTH, 1.0)
    for low, high in ((0.0, 1.07), (1.05, 2.0), (1.02, 1.1), (2.0, 3.0)):
        x = np.linspace(low, high, 501)
        assert np.abs(rough.profile(low, high)(x) - haversine(x, 1.0)).max() < 2e-9


def test_a_smooth_callable_is_followed():
    def wavy(x):
        return 2e-3 * np.sin(2.0 * np.pi * x / 3.0) * np.exp(-((x - 30.0) ** 2) / 200.0)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        profile = Irregularity.of(wavy).profile(0.0, 60.0)
    x = np.linspace(0.0, 60.0, 7001)
    assert np.abs(profile(x) - wavy(x)).max() < 1e-8
    assert profile.segment_count == 1


def test_a_flat_hidden_in_a_callable_is_found():
    rough = trunk_line() + (lambda x: haversine(x, 50.003))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        profile = rough.profile(0.0, 120.0)
    x = np.concatenate([np.linspace(0.0, 120.0, 2001), np.linspace(49.9, 50.3, 4001)])
    assert np.abs(profile(x) - trunk_line()(x) - haversine(x, 50.003)).max() < 2e-8
    assert profile.segment_count < 20


def test_a_cusp_is_a_knot_when_it_is_named_and_told_when_it_is_not():
    def cusp(x):
        return 1e-3 * np.abs(x - 5.0 * np.sqrt(2.0))

    x = np.linspace(0.0, 10.0, 10_001)
    with pytest.warns(UserWarning, match=r"not smooth near x = 7\.07\d+ m"):
        blind = Irregularity.of(cusp).profile(0.0, 10.0)
    assert np.abs(blind(x) - cusp(x)).max() < 1e-7
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = Irregularity.of(cusp, breaks=[5.0 * np.sqrt(2.0)]).profile(0.0, 10.0)
    assert np.abs(told(x) - cusp(x)).max() < 1e-12
    assert told.segment_count == 2


def test_callables_are_checked():
    with pytest.raises(ValueError, match="gives shape"):
        Irregularity.of(lambda x: x[:2])(np.zeros(5))
    with pytest.raises(ValueError, match=r"not finite at x = 3 m"):
        Irregularity.of(lambda x: np.where(x == 3.0, np.nan, 0.0)).profile(0.0, 10.0)
    with pytest.raises(ValueError, match="accepted is an Irregularity or a callable"):
        Irregularity.of(3.0)
    assert not np.any(Irregularity.of(lambda x: 0.0).profile(0.0, 1.0)(np.linspace(0.0, 1.0, 9)))


def test_sums_are_associative_and_take_callables_on_either_side():
    a, b, c = trunk_line(), Irregularity.cosines(0.2, 1e-3), Irregularity.flat(DEPTH, LENGTH, 10.0)
    x = np.linspace(0.0, 40.0, 3001)
    left, right = (a + b) + c, a + (b + c)
    assert left(x).tobytes() == right(x).tobytes() == sum([a, b, c])(x).tobytes()
    assert left.profile(0.0, 40.0)(x).tobytes() == right.profile(0.0, 40.0)(x).tobytes()
    np.testing.assert_allclose((np.sin + b)(x), np.sin(x) + b(x), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose((b + np.sin)(x), np.sin(x) + b(x), rtol=0.0, atol=1e-15)
    with pytest.raises(TypeError):
        a + 1.0


def test_zero_is_zero():
    rough = Irregularity.zero()
    assert not rough(np.linspace(0.0, 9.0, 5)).any()
    assert not rough.profile(0.0, 9.0)(np.linspace(0.0, 9.0, 5)).any()
    assert (rough.period, rough.shortest_wavelength) == (np.inf, np.inf)
    assert (rough + trunk_line()).terms[0].shortest_wavelength == pytest.approx(0.3, rel=1e-3)


# --- taper ------------------------------------------------------------------------------------------------------------


def test_a_taper_is_zero_then_rises_with_continuous_slope_to_all_of_it():
    start, length = 30.0, 5.0
    rough = trunk_line() + Irregularity.flat(DEPTH, LENGTH, 33.0) + Irregularity.cosines(0.02, 1e-3)
    faded = rough.taper(start, length)
    profile = faded.profile(0.0, 120.0)
    before, after = np.linspace(0.0, 30.0, 500, endpoint=False), np.linspace(35.0, 120.0, 2000)
    during = np.linspace(30.0, 35.0, 2000)
    s = (during - start) / length
    assert not faded(before).any()
    assert not profile(before).any()
    np.testing.assert_array_equal(faded(after), rough(after))
    np.testing.assert_allclose(faded(during), rough(during) * (3.0 * s**2 - 2.0 * s**3), rtol=0.0, atol=1e-17)
    for x in (before, during, after):
        assert np.abs(profile(x) - faded(x)).max() < 1e-8
    for place in (start, start + length):
        h = 1e-5
        left = (profile(place) - profile(place - h)) / h
        right = (profile(place + h) - profile(place)) / h
        # Slopes are a few 1e-3; differences over h miss by h times the curvature (up to 0.1 1/m).
        assert left == pytest.approx(right, abs=3e-6)


def test_a_taper_adds_no_error_to_a_long_wave():
    rough = Irregularity.cosines(1.0 / 50.0, 5e-3, 0.4).taper(10.0, 2.0)
    x = np.linspace(5.0, 20.0, 3001)
    assert np.abs(rough.profile(0.0, 40.0)(x) - rough(x)).max() < 2e-9


def test_the_range_may_begin_or_end_within_the_taper():
    rough = Irregularity.cosines(0.2, 1e-3, 0.4).taper(10.0, 2.0)
    for low, high in ((0.0, 5.0), (0.0, 10.0), (0.0, 11.0), (11.0, 30.0), (12.0, 30.0), (15.0, 30.0), (10.5, 11.5)):
        x = np.linspace(low, high, 401)
        assert np.abs(rough.profile(low, high)(x) - rough(x)).max() < 2e-9


# --- being an object --------------------------------------------------------------------------------------------------


def test_profiles_are_kept():
    rough = trunk_line()
    first = rough.profile(0.0, 100.0)
    assert rough.profile(0, 100) is first
    for high in range(101, 115):
        rough.profile(0.0, high)
    again = rough.profile(0.0, 100.0)
    assert again is not first
    assert again.coefficient.tobytes() == first.coefficient.tobytes()


def test_irregularities_survive_pickling_without_their_profiles():
    x = np.linspace(0.0, 40.0, 500)
    for rough in (Irregularity.zero(), trunk_line().taper(3.0, 2.0) + Irregularity.flat(DEPTH, LENGTH, 9.0) + np.sin):
        size = len(pickle.dumps(rough))
        rough.profile(0.0, 40.0)
        assert len(pickle.dumps(rough)) == size
        copy = pickle.loads(pickle.dumps(rough))
        assert copy.profile(0.0, 40.0)(x).tobytes() == rough.profile(0.0, 40.0)(x).tobytes()


def test_irregularities_are_equal_only_to_themselves_and_do_not_change():
    rough = trunk_line()
    assert rough != trunk_line()
    assert len({rough, rough, trunk_line()}) == 2
    with pytest.raises(AttributeError):
        rough.terms = ()  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        rough.terms[0].amplitude[0] = 1.0  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="read-only"):
        rough.profile(0.0, 10.0).coefficient[0] = 1.0


def test_exact_values_keep_the_shape():
    rough = trunk_line() + Irregularity.flat(DEPTH, LENGTH, 9.0)
    assert np.ndim(rough(3.0)) == 0
    assert rough(np.zeros((2, 3))).shape == (2, 3)
    assert rough(np.zeros(0)).shape == (0,)
    assert rough.taper(0.0, 1.0)(np.ones((2, 3))).shape == (2, 3)


def test_a_profile_matches_one_made_of_the_exact_values():
    rough = trunk_line()
    own = Profile.from_pieces([Piece(0.0, 30.0, 0.015)], lambda low, width, n: rough(low + width * np.arange(n + 1)))
    x = np.linspace(0.0, 30.0, 1001)
    assert np.abs(own(x) - rough.profile(0.0, 30.0)(x)).max() < 1e-15


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: trunk_line(wavelengths=(50.0, 0.3)), r"wavelengths = \(50.0, 0.3\).* shortest first"),
        (lambda: trunk_line(wavelengths=3.0), "wavelengths = 3.0"),
        (lambda: trunk_line(wavelengths=(0.0, 3.0)), "above 0 m"),
        (lambda: trunk_line(period=0.0), "period = 0.0"),
        (lambda: trunk_line(scale=-1.0), "scale = -1.0"),
        (lambda: trunk_line(amplitudes="random"), "'fixed' and 'rayleigh'"),
        (lambda: trunk_line(sample=-1), "sample = -1"),
        (lambda: Irregularity.cosines([1.0, 2.0], [1.0, 2.0, 3.0]), "unequal shapes"),
        (lambda: Irregularity.cosines([[1.0]], 1.0), "scalars and vectors"),
        (lambda: Irregularity.cosines([1.0, -2.0], 1.0), "wavenumber = -2"),
        (lambda: Irregularity.cosines([1.0, 2.0], [1.0, np.inf]), r"amplitude\[1\] = inf"),
        (lambda: Irregularity.flat(1e-3, 0.0, 1.0), "length = 0.0"),
        (lambda: Irregularity.flat(np.nan, 0.1, 1.0), "depth = nan"),
        (lambda: trunk_line().taper(1.0, 0.0), "length = 0.0"),
        (lambda: trunk_line().taper(np.inf, 1.0), "start = inf"),
        (lambda: trunk_line().profile(3.0, 3.0), "rising order"),
        (lambda: trunk_line().profile(0.0, np.inf), "rising order"),
    ],
)
def test_mistakes_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize("kind", ["chord_flat", "joint", "weld", "settlement", "corrugation"])
def test_later_defects_are_known_and_refused(kind):
    with pytest.raises(ValueError, match=f"{kind} is not yet"):
        getattr(Irregularity, kind)(depth=1e-3, at=1.0)
