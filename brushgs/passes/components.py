"""Connected components, by the compiled core: SciPy's import takes longer than the work here."""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.values.arrays import Rows


def components(num_rows: int, a: Rows, b: Rows) -> NDArray[np.int32]:
    """The connected component of each row, [num_rows], numbered from 0 in the order of their first rows.

    Args:
        num_rows: N.
        a: [M] rows, 0 to N - 1, each linked to one of `b`.
        b: [M].
    """
    found = np.empty(num_rows, np.int32)
    _core.components(np.ascontiguousarray(a, np.int64), np.ascontiguousarray(b, np.int64), found)
    return found
