import numpy as np
import pytest

from tbatch.physics.streams import stream


def test_a_stream_is_the_same_every_time_and_its_own():
    def draw(*key):
        return stream(*key).random(4).tolist()

    assert draw(1, 2, "a") == draw(1, 2, "a")
    others = [draw(1, 2, "a"), draw(1, 2, "b"), draw(1, 3, "a"), draw(2, 2, "a"), draw(2, 1, "a")]
    assert len({tuple(values) for values in others}) == len(others)


def test_streams_of_neighbouring_samples_are_uncorrelated():
    values = np.array([stream(7, sample, "phase").random(2000) for sample in range(40)])
    correlation = np.corrcoef(values)[np.triu_indices(40, 1)]
    # 780 coefficients of standard deviation 1/√2000 = 0.022: 4.5 of them is never reached by chance.
    assert np.abs(correlation).max() < 0.1


def test_a_stream_is_the_same_in_every_version():
    # Stored on purpose: a campaign made with one version must be reproduced by the next, on any machine.
    numbers = stream(1, 0, "irregularity/china-trunk-line/phase").integers(0, 2**32, 3)
    assert numbers.tolist() == [2746835299, 3383961927, 2946245424]


@pytest.mark.parametrize("value", [-1, 2**64, 1.5, True, "1"])
def test_keys_are_whole_numbers_of_64_bits(value):
    with pytest.raises(ValueError, match=r"seed = .* 0 to 2\*\*64 - 1"):
        stream(value, 0, "a")
    with pytest.raises(ValueError, match="sample"):
        stream(0, value, "a")
