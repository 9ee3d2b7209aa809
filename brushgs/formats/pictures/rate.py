"""Frame rates as the fractions that they stand for."""

from fractions import Fraction
from math import isclose


def frame_rate(fps: float) -> Fraction:
    """Frames a second as a fraction: 23.976, 29.97 and their like mean 24000/1001, 30000/1001.

    Args:
        fps: > 0. Those of television are within 0.0015 of their fractions.
    """
    if fps != round(fps) and isclose(fps, round(fps * 1.001) / 1.001, abs_tol=0.0015):
        return Fraction(round(fps * 1.001) * 1000, 1001)
    return Fraction(fps).limit_denominator(1001)
