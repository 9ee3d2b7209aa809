"""Work side by side comes back in order, with the core in one thread each, and its errors come through."""

import threading

import pytest

from brushgs.core import threads
from tests.kit.for_each import for_each


@for_each("num_threads", [1, 2, 16])
def test_results_come_in_the_order_of_the_items(num_threads):
    with threads.at_most(num_threads):
        assert threads.side_by_side(lambda item: 2 * item, range(20)) == list(range(0, 40, 2))
        assert threads.side_by_side(str, []) == []


def test_several_items_are_worked_on_at_once_each_in_one_thread():
    meeting = threading.Barrier(2, timeout=30)

    def meet(item):
        meeting.wait()
        return threads.num_threads_or_default(None)

    with threads.at_most(2):
        assert threads.side_by_side(meet, range(4)) == [1, 1, 1, 1]
        assert threads.num_threads_or_default(None) == 2


def test_an_error_of_one_item_comes_through():
    with threads.at_most(2), pytest.raises(ZeroDivisionError):
        threads.side_by_side(lambda item: 1 // item, [1, 0, 1])


def test_no_more_items_are_worked_on_than_were_allowed_and_results_do_not_pile_up():
    begun, lock, at_once, most = [], threading.Lock(), 0, 0

    def count(item):
        nonlocal at_once, most
        with lock:
            begun.append(item)
            at_once += 1
            most = max(most, at_once)
        with lock:
            at_once -= 1
        return item

    with threads.at_most(16):
        results = threads.in_turn(count, range(20), at_once=2)
        assert next(results) == 0
        assert len(begun) <= 4  # two workers, one result that waits, one that was taken
        assert list(results) == list(range(1, 20))
    assert most <= 2
