import numpy as np
import pytest

from brushgs.passes import row_blocks


@pytest.mark.parametrize("num", [0, 1, row_blocks.ROWS, 3 * row_blocks.ROWS + 5])
@pytest.mark.parametrize("threads", [1, 3])
def test_blocks_hold_every_row_once(num, threads, monkeypatch):
    monkeypatch.setattr(row_blocks, "num_threads_or_default", lambda _: threads)
    counts = np.zeros(num, int)

    def count(rows):
        counts[rows] += 1

    row_blocks.for_blocks(count, num)
    assert (counts == 1).all()


@pytest.mark.parametrize("threads", [1, 3])
def test_results_come_in_the_order_of_the_items(threads):
    assert list(row_blocks.in_order(lambda item: item * item, range(50), threads)) == [
        i * i for i in range(50)
    ]


def test_a_fault_in_a_thread_is_raised():
    with pytest.raises(ZeroDivisionError):
        list(row_blocks.in_order(lambda item: 1 / item, [1, 0], 2))
