"""Numbers that belong to what they are made of."""

import numpy as np

from brushgs.values.hashing import GOLDEN_32, hash_32, lattice


def mixed(bits: int) -> int:
    """lowbias32 in whole numbers of Python."""
    bits ^= bits >> 16
    bits = bits * 0x7FEB352D % 2**32
    bits ^= bits >> 15
    bits = bits * 0x846CA68B % 2**32
    return bits ^ bits >> 16


def indices(*numbers: int) -> np.ndarray:
    return np.array(numbers, np.uint32)


def test_a_hash_is_that_of_whole_numbers():
    states = [0, 1, 2, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 123456789]
    assert hash_32(indices(*states)).tolist() == [mixed(state) for state in states]
    kept = indices(*states)
    hash_32(kept)
    assert kept.tolist() == states


def test_a_lattice_is_by_its_places_alone():
    numbers = lattice(77, np.arange(50, dtype=np.uint32), np.arange(70, dtype=np.uint32))
    assert numbers.shape == (50, 70)
    assert numbers.dtype == np.float32
    for y, x in ((0, 0), (3, 5), (49, 69)):
        bits = mixed((77 + x * GOLDEN_32) % 2**32)
        bits = mixed((bits + y * GOLDEN_32) % 2**32)
        assert numbers[y, x] == (bits >> 8) / 2**23 - 1
    part = lattice(77, indices(7, 49), indices(3, 10, 69))
    np.testing.assert_array_equal(part, numbers[np.ix_([7, 49], [3, 10, 69])])
    assert not np.array_equal(lattice(78, *(np.arange(n, dtype=np.uint32) for n in (50, 70))), numbers)
