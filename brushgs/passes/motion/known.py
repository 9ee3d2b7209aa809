"""Find the nearest moments at which values are known."""

import numpy as np

from brushgs.values.arrays import F64, Mask, Rows


def known_around(is_known: Mask) -> tuple[Rows, Rows]:
    """The known moments before and after each moment; the moment itself where it is known.

    Args:
        is_known: [T, m] whether a column is known at a moment.

    Returns:
        [T, m] the last known moment up to each, -1 if none; and the first from each on, T if none.
    """
    num = len(is_known)
    at = np.arange(num)[:, None]
    before = np.maximum.accumulate(np.where(is_known, at, -1), axis=0)
    after = np.minimum.accumulate(np.where(is_known, at, num)[::-1], axis=0)[::-1]
    return before, after


def nearest_known(is_known: Mask, times: F64) -> Rows:
    """The known moment nearest in time to each, [T, m]; of two equally near ones the earlier.

    Args:
        is_known: [T, m] see `known_around`; columns that are never known get -1.
        times: [T] ascending.
    """
    before, after = known_around(is_known)
    to_before = np.where(before >= 0, times[:, None] - times[before], np.inf)
    to_after = np.where(after < len(times), times[np.minimum(after, len(times) - 1)] - times[:, None], np.inf)
    return np.asarray(np.where(to_before <= to_after, before, after))
