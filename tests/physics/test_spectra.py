import math
import warnings

import numpy as np
import pytest
from scipy.integrate import quad

from tbatch.physics.catalogue.spectra import SPECTRA
from tbatch.physics.irregularity import Irregularity
from tbatch.physics.spectra import Density, wave_amplitudes


@pytest.mark.parametrize(
    ("name", "wavelengths", "rms"),
    [
        ("china-ballastless", (1.0, 30.0), 0.3134e-3),
        ("china-ballastless", (2.0, 80.0), 0.5072e-3),
        ("german-low", (1.0, 30.0), 1.1283e-3),
        ("german-low", (2.0, 80.0), 2.0734e-3),
    ],
)
def test_rms_of_published_check_values(name, wavelengths, rms):
    # Check values are given to four digits.
    assert math.sqrt(Density(name).variance(wavelengths)) == pytest.approx(rms, abs=0.6e-7)


def test_bands_of_iso3095_carry_their_levels():
    density = Density("iso3095")
    edges = np.sort(density.breaks)
    levels = 10.0 * np.log10(density.integral(edges) / 1e-12)
    assert levels[0] == pytest.approx(17.1, abs=1e-9)  # 40 cm is the longest wave, the lowest wavenumber
    assert levels[-1] == pytest.approx(-11.0, abs=1e-9)
    assert math.sqrt(density.integral(edges).sum()) == pytest.approx(11.74e-6, abs=0.005e-6)
    assert density(1.0 / 0.4) == pytest.approx(8.9e-11, rel=0.01)
    with pytest.raises(ValueError, match="bands reach from"):
        density(1.0)


def test_the_joint_at_0_4_m_of_the_long_wave_spectra():
    # Two digits are given: 6.7e-4 and 1.7e-5 mm²/(1/m).
    assert Irregularity.density("china-trunk-line", 2.5, tail=3) == pytest.approx(6.7e-10, rel=0.01)
    assert Irregularity.density("china-ballastless", 2.5) == pytest.approx(1.7e-11, rel=0.02)


def test_a_power_law_integrates_to_its_closed_form():
    parts = SPECTRA["china-ballastless"].parameters["parts"]
    low, high = 1.0 / 120.0, 1.0 / 1.7
    expected, start = 0.0, low
    for a, n, upper in parts:
        end = min(upper, high)
        if start < end:
            expected += 1e-6 * a / (1.0 - n) * (end ** (1.0 - n) - start ** (1.0 - n))
            start = end
    assert Density("china-ballastless").variance((1.7, 120.0)) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("name", [name for name in SPECTRA if name != "iso3095"])
def test_variance_of_the_waves_is_the_integral_of_the_density(name):
    density = Density(name, 3.0)
    band, period = (0.7, 40.0), 97.0
    _, amplitude = wave_amplitudes(density, band, period)
    breaks = [f for f in density.breaks if 1.0 / band[1] < f < 1.0 / band[0]]
    expected, _ = quad(
        density, 1.0 / band[1], 1.0 / band[0], points=breaks or None, limit=500, epsabs=0.0, epsrel=1e-12
    )
    # Two quadratures of about 1e-13 each; bins of 0.01 cycle/m hold the density's breaks and its steepest part.
    assert 0.5 * np.sum(amplitude**2) == pytest.approx(expected, rel=1e-11)


def test_bin_centres_would_lose_variance_that_the_integrals_keep():
    density, band, period = Density("china-ballastless"), (2.0, 200.0), 200.0
    centre, amplitude = wave_amplitudes(density, band, period)
    width = (1.0 / band[0] - 1.0 / band[1]) / centre.size
    assert 0.5 * np.sum(amplitude**2) == pytest.approx(density.variance(band), rel=1e-12)
    assert np.sum(density(centre) * width) < 0.9 * density.variance(band)


def test_bins_fill_the_band_and_are_no_wider_than_one_over_the_period():
    centre, _ = wave_amplitudes(Density("german-low"), (1.0, 40.0), 333.0)
    width = np.diff(centre)
    assert np.ptp(width) < 1e-14
    assert width[0] <= 1.0 / 333.0
    assert centre[0] - width[0] / 2 == pytest.approx(1.0 / 40.0, rel=1e-12)
    assert centre[-1] + width[0] / 2 == pytest.approx(1.0, rel=1e-12)


def test_densities_per_radian_become_densities_per_cycle():
    for name in ("german-low", "german-high"):
        p = SPECTRA[name].parameters

        def per_radian(omega, p=p):
            c2, r2 = p["Omega_c"] ** 2, p["Omega_r"] ** 2
            return p["A"] * c2 / ((omega**2 + r2) * (omega**2 + c2))

        expected, _ = quad(per_radian, 2.0 * math.pi / 30.0, 2.0 * math.pi, epsabs=0.0, epsrel=1e-12)
        assert Density(name).variance((1.0, 30.0)) == pytest.approx(expected, rel=1e-11)
    p = SPECTRA["fra-6"].parameters

    def fra(omega):
        return 1e-4 * p["k"] * p["A"] * p["Omega_c"] ** 2 / (omega**2 * (omega**2 + p["Omega_c"] ** 2))

    expected, _ = quad(fra, 2.0 * math.pi / 100.0, 2.0 * math.pi / 2.0, epsabs=0.0, epsrel=1e-12)
    assert Density("fra-6").variance((2.0, 100.0)) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("name", ["china-trunk-line", "china-trunk-line-right"])
def test_the_trunk_line_formula_turns_up_where_its_tail_goes_on_falling(name):
    f = np.array([0.70, 0.80, 0.83, 1.0, 1.25])
    formula, tailed = Irregularity.density(name, f), Irregularity.density(name, f, tail=3)
    assert formula[1] < formula[0]
    assert np.all(np.diff(formula[2:]) > 0.0)
    assert np.all(np.diff(tailed) < 0.0)
    np.testing.assert_array_equal(tailed[:2], formula[:2])


def test_a_tail_is_continuous_and_has_its_exponent():
    for name, start in (("china-trunk-line", 0.8), ("china-ballastless", 0.5), ("german-low", 1.0)):
        at, above, twice = Irregularity.density(name, [start, start * (1.0 + 1e-9), 2.0 * start], tail=3)
        assert above == pytest.approx(at, rel=1e-8)
        assert twice == pytest.approx(at / 8.0, rel=1e-13)
        assert at == pytest.approx(Irregularity.density(name, start), rel=1e-13)
    low, high = Irregularity.density("german-low", [0.3, 0.6], tail=2, tail_from=0.25)
    assert low / high == pytest.approx(4.0, rel=1e-13)


def test_densities_keep_the_shape_and_are_positive():
    f = np.geomspace(1.0 / 40.0, 1.0 / 2.0, 30).reshape(5, 6)
    for name in SPECTRA:
        if name != "iso3095":
            density = Irregularity.density(name, f)
            assert density.shape == f.shape
            assert np.all(density > 0.0)


def test_entries_name_their_source_and_band():
    for name, entry in SPECTRA.items():
        assert entry.source, name
        assert 0.0 < entry.band[0] < entry.band[1], name
        assert entry.default_tail_from > 0.0, name


def test_leaving_the_valid_band_warns_unless_a_tail_states_the_rule():
    def build(**options):
        return Irregularity.spectrum("china-ballastless", seed=1, period=100.0, **options)

    with pytest.warns(UserWarning, match="2 to 200 m; continue it by tail"):
        build(wavelengths=(0.5, 50.0))
    with pytest.warns(UserWarning, match="2 to 200 m; continue it by tail"):
        build(wavelengths=(0.5, 50.0), tail=3, tail_from=1.0)
    with pytest.warns(UserWarning, match="valid band of china-ballastless, 2 to 200 m"):
        build(wavelengths=(2.0, 300.0), tail=3)
    with pytest.warns(UserWarning, match="contact filter"):
        build(wavelengths=(0.010, 50.0), tail=3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        build(wavelengths=(2.0, 200.0))
        build(wavelengths=(0.3, 200.0), tail=3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("china-trunkline", 1.0), "did you mean 'china-trunk-line'"),
        (("nowhere", 1.0), "accepted are china-ballastless"),
        (("german-low", 0.0), "above 0 cycle/m"),
        (("german-low", [1.0, -2.0]), r"wavenumber = .*-2"),
        (("german-low", 1.0, -1.0), "tail = -1.0"),
        (("german-low", 1.0, None, 0.5), "without tail"),
        (("german-low", 1.0, 3.0, 0.0), "tail_from = 0.0"),
    ],
)
def test_mistakes_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        Irregularity.density(*arguments)
