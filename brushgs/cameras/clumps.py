"""Find the heaviest of several clumps that are so far apart that each is a dot seen from the other.

No view shows both, and a frame around both shows neither.
"""

import numpy as np

from brushgs.core.native import core as _core
from brushgs.values.arrays import Array, Mask

# Share of the weight at each end of an axis that may be strays, which framing ignores.
TAIL: float = _core.CLUMP_TAIL


def heaviest_clump(means: Array, weights: Array, sample: slice = slice(None)) -> Mask | None:
    """Mask [N] of the heaviest clump; None if there is only one, apart from strays.

    Splits at gaps along the axes until there is none. Strays weigh at most `TAIL` at each end.

    Args:
        means: [N, 3] positions, world units.
        weights: [N] such as opacities, >= 0.
        sample: rows to search for gaps.
    """
    points, masses = (np.ascontiguousarray(column[sample], np.float64) for column in (means, weights))
    found = _core.heaviest_clump(points, masses)
    if found is None:
        return None
    low, high = np.array(found)
    return np.asarray(((means >= low) & (means <= high)).all(axis=1))
