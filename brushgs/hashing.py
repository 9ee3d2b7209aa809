"""Numbers as if at random that belong to what they are made of: the same on every machine, in any order."""

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F64

GOLDEN = 0x9E3779B97F4A7C15  # 2^64 over the golden ratio: its multiples are distributed evenly


def uniform(states: NDArray[np.uint64]) -> F64:
    """Even numbers from 0 to below 1 for 64-bit states, of any shape; near states give unlike numbers.

    Source: the finaliser of splitmix64 (Steele, Lea and Flood 2014).
    """
    bits = (states ^ (states >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(((bits ^ (bits >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53)
