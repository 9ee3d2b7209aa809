import numpy as np

from brushgs.core.threads import at_most
from brushgs.passes import row_blocks
from tests.kit.for_each import for_each


@for_each("num", [0, 1, row_blocks.ROWS, 3 * row_blocks.ROWS + 5])
@for_each("num_threads", [1, 3])
def test_blocks_hold_every_row_once(num, num_threads):
    counts = np.zeros(num, int)

    def count(rows):
        counts[rows] += 1

    with at_most(num_threads):
        row_blocks.for_blocks(count, num)
    assert (counts == 1).all()
