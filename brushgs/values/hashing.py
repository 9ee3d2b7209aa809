"""Numbers as if at random that belong to what they are made of: the same on every machine, in any order.

Those of 32 bits can be repeated where integers have no more: in shaders, and in JavaScript.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64

GOLDEN = 0x9E3779B97F4A7C15  # 2^64 over the golden ratio: its multiples are distributed evenly
GOLDEN_32 = 0x9E3779B1  # a prime beside 2^32 over it


def uniform(states: NDArray[np.uint64]) -> F64:
    """Even numbers from 0 to below 1 for 64-bit states, of any shape; near states give unlike numbers.

    Source: the finaliser of splitmix64 (Steele, Lea and Flood 2014).
    """
    bits = (states ^ (states >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(((bits ^ (bits >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53)


def hash_32(states: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Each 32-bit state mixed to another one, of any shape; near states give unlike numbers.

    Source: lowbias32 of hash-prospector (Wellons 2018).
    """
    bits = states ^ (states >> np.uint32(16))
    for factor, shift in ((0x7FEB352D, 15), (0x846CA68B, 16)):
        bits *= np.uint32(factor)
        bits ^= bits >> np.uint32(shift)
    return bits


def lattice(stream: int, *axes: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Even numbers from -1 to below 1 on a lattice, by the indices of its points along each axis.

    Multiples of 2^-23: with h the stream, h = `hash_32`(h + index x `GOLDEN_32`) for each axis, the last one
    first; the upper 24 bits of h are the number.

    Args:
        stream: 0 to 2^32 - 1; another one gives other numbers.
        axes: [n], [m], ... indices; the result has the shape [n, m, ...].
    """
    bits = np.full((1,) * len(axes), stream, np.uint32)
    for i in reversed(range(len(axes))):
        steps = (axes[i] * np.uint32(GOLDEN_32)).reshape(-1, *(1,) * (len(axes) - 1 - i))
        bits = hash_32(bits + steps)
    bits >>= np.uint32(8)
    numbers = bits.astype(np.float32)
    numbers *= np.float32(2.0**-23)
    numbers -= np.float32(1)
    return numbers
