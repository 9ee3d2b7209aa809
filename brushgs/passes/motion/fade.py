"""Strokes come and go over a stated time: a limit on how fast opacity changes."""

import numpy as np

from brushgs.values.arrays import F32, F64

FADE = 0.25  # seconds in which a stroke appears or disappears


def faded(opacities: F32, times: F64, fade: float = FADE) -> F32:
    """Opacities that change by at most 1 in `fade` seconds and are nowhere below those given.

    At each moment it is the largest of all (opacity at another moment - distance in time / fade). So what is
    born comes over what it replaces, and what goes stays until it is covered: between the two no gap opens.

    Args:
        opacities: [T, m] of m strokes at T moments, >= 0.
        times: [T] seconds, ascending.
        fade: seconds, >= 0; 0 returns the opacities as they are.
    """
    if not fade > 0:
        return opacities
    falls = (np.diff(times) / fade).astype(np.float32)
    limited = opacities.copy()
    # The distance along time adds up from step to step: one pass forwards and one back find the largest.
    for at in range(1, len(limited)):
        np.maximum(limited[at], limited[at - 1] - falls[at - 1], out=limited[at])
    for at in range(len(limited) - 2, -1, -1):
        np.maximum(limited[at], limited[at + 1] - falls[at], out=limited[at])
    return limited
