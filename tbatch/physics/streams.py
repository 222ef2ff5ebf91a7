"""Streams: random numbers that belong to a sample and a purpose, whatever else is drawn and in which order."""

import hashlib

import numpy as np

_LARGEST = 2**64 - 1


def stream(seed: int, sample: int, name: str) -> np.random.Generator:
    """The generator of one purpose within one sample.

    Philox is counter-based: its key is (seed, sample), and the top word of its counter is a hash of the name. Streams
    of different names therefore start 2**192 draws apart, and adding a stream changes no other.

    Args:
        seed: the campaign's seed, 0 ... 2**64 - 1.
        sample: the sample's number, 0 ... 2**64 - 1.
        name: what the numbers are for, such as ``"irregularity/china-trunk-line"``.
    """
    for field, value in (("seed", seed), ("sample", sample)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 <= value <= _LARGEST:
            raise ValueError(f"{field} = {value!r}: accepted is a whole number from 0 to 2**64 - 1")
    word = int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little")
    key = np.array([seed, sample], dtype=np.uint64)
    counter = np.array([0, 0, 0, word], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))
