"""Fade strokes in and out: limit how fast opacity changes."""

import numpy as np

from brushgs.values.arrays import F32, F64

FADE = 0.25  # seconds in which a stroke appears or disappears


def faded(opacities: F32, times: F64, fade: float = FADE) -> F32:
    """The smallest opacities not below the given ones that change by at most 1 in `fade` seconds.

    Each is the maximum over all moments of (opacity there - distance in time / fade). New strokes appear
    before the ones they replace vanish, so no gap opens between them.

    Args:
        opacities: [T, m] of m strokes at T moments, >= 0.
        times: [T] seconds, ascending.
        fade: seconds, >= 0; 0 returns the opacities as they are.
    """
    if not fade > 0:
        return opacities
    falls = (np.diff(times) / fade).astype(np.float32)
    limited = opacities.copy()
    # Distances in time add up over steps: one forward and one backward pass find the maximum.
    for at in range(1, len(limited)):
        np.maximum(limited[at], limited[at - 1] - falls[at - 1], out=limited[at])
    for at in range(len(limited) - 2, -1, -1):
        np.maximum(limited[at], limited[at + 1] - falls[at], out=limited[at])
    return limited
