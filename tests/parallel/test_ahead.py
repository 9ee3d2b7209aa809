"""One result is made while the one before is used."""

import threading

import pytest

from brushgs.pipeline.parallel.ahead import one_ahead
from brushgs.pipeline.report import Stopwatch


def test_the_next_result_is_made_while_the_caller_has_this_one():
    second = threading.Event()

    def make():
        yield 1
        second.set()
        yield 2

    results = one_ahead(make(), Stopwatch())
    assert next(results) == 1
    assert second.wait(10)  # nobody has asked for it
    assert list(results) == [2]


def test_at_most_one_result_is_made_before_it_is_requested():
    made = []
    results = one_ahead((made.append(i) or i for i in range(100)), Stopwatch())
    assert made == []
    assert next(results) == 0
    assert next(results) == 1
    results.close()  # waits for what is being made
    assert made == [0, 1, 2]


def test_an_error_comes_in_the_turn_of_its_result():
    def make():
        yield 1
        raise ValueError("no second result")

    results = one_ahead(make(), Stopwatch())
    assert next(results) == 1
    with pytest.raises(ValueError, match="no second result"):
        next(results)


def test_the_maker_is_closed_with_the_results():
    is_closed = threading.Event()

    def make():
        try:
            while True:
                yield 0
        finally:
            is_closed.set()

    results = one_ahead(make(), Stopwatch())
    next(results)
    results.close()
    assert is_closed.is_set()
