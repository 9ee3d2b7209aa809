"""Numbers that belong to what they are made of."""

import numpy as np

from brushgs.values.hashing import hash_32


def mixed(bits: int) -> int:
    """lowbias32 in whole numbers of Python."""
    bits ^= bits >> 16
    bits = bits * 0x7FEB352D % 2**32
    bits ^= bits >> 15
    bits = bits * 0x846CA68B % 2**32
    return bits ^ bits >> 16


def test_a_hash_is_that_of_whole_numbers_which_stay_as_they_are():
    numbers = [0, 1, 2, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 123456789]
    states = np.array(numbers, np.uint32)
    assert hash_32(states).tolist() == [mixed(number) for number in numbers]
    assert states.tolist() == numbers
