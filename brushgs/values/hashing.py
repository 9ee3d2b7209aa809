"""Pseudo-random numbers as hashes of indices: the same on every machine and in any order.

The 32-bit hash can be reproduced in shaders and in JavaScript.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, F64, U32

GOLDEN = 0x9E3779B97F4A7C15  # 2^64 / golden ratio: its multiples are evenly distributed modulo 2^64
GOLDEN_32 = 0x9E3779B1  # a prime close to 2^32 / golden ratio


def uniform(states: NDArray[np.uint64]) -> F64:
    """Uniform numbers in [0, 1) from 64-bit states of any shape; nearby states are decorrelated.

    Source: the finaliser of splitmix64 (Steele, Lea and Flood 2014).
    """
    bits = (states ^ (states >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(((bits ^ (bits >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53)


def hash_32(states: U32) -> U32:
    """Hash 32-bit states of any shape; nearby states are decorrelated.

    Source: lowbias32 of hash-prospector (Wellons 2018).
    """
    bits = states ^ (states >> np.uint32(16))
    for factor, shift in ((0x7FEB352D, 15), (0x846CA68B, 16)):
        bits *= np.uint32(factor)
        bits ^= bits >> np.uint32(shift)
    return bits


def lattice(stream: int, *axes: U32) -> F32:
    """Uniform numbers in [-1, 1) on a lattice, from the indices of its points along each axis.

    Multiples of 2^-23: with h the stream, h = `hash_32`(h + index x `GOLDEN_32`) for each axis, the last one
    first; the upper 24 bits of h are the number.

    Args:
        stream: seed, 0 to 2^32 - 1.
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
