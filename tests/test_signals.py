"""What asks a program to stop is heard after work that must not stop midway, and never aborts it."""

import signal
from concurrent.futures import ThreadPoolExecutor

import pytest

from brushgs.core.signals import STOP_SIGNALS, defer_stop
from tests.kit.programs import ran


class HeardError(Exception):
    """What the handler of a test raises."""


@pytest.fixture(params=STOP_SIGNALS, ids=lambda number: number.name)
def number(request):
    """A signal that raises `HeardError`."""

    def hear(number, frame):
        raise HeardError

    before = signal.signal(request.param, hear)
    yield request.param
    signal.signal(request.param, before)


def test_a_signal_waits_for_the_end_of_the_block_and_is_heard_then(number):
    steps, handler = [], signal.getsignal(number)

    def work():
        with defer_stop():
            signal.raise_signal(number)
            steps.append("went on")
        steps.append("not reached")

    with pytest.raises(HeardError):
        work()
    assert steps == ["went on"]
    assert signal.getsignal(number) is handler


def test_signals_are_heard_as_before_where_none_came_and_in_other_threads():
    before = [signal.getsignal(number) for number in STOP_SIGNALS]
    with defer_stop():
        pass
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(lambda: defer_stop().__enter__() is None).result()
    assert [signal.getsignal(number) for number in STOP_SIGNALS] == before


def test_an_ignored_signal_stays_ignored():
    """As under `nohup`."""
    number = STOP_SIGNALS[-1]
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with defer_stop():
            signal.raise_signal(number)
        assert signal.getsignal(number) == signal.SIG_IGN
    finally:
        signal.signal(number, before)


@pytest.mark.parametrize("place", [1, 40, 400])
def test_ctrl_c_while_the_core_is_imported_is_heard_after_it(place):
    """Nanobind aborts the process where an exception reaches the set-up of its enumerations."""
    code = f"""
import signal, sys
left = {place}

def trace(frame, event, arg):
    global left
    if "brushgs.core.native" in sys.modules and frame.f_code.co_filename.endswith("enum.py"):
        left -= 1
        if left == 0:
            signal.raise_signal(signal.SIGINT)
    return trace

sys.settrace(trace)
try:
    import brushgs.core.native
except KeyboardInterrupt:
    print("heard", left <= 0, "brushgs._core" in sys.modules)
"""
    assert ran("-c", code) == (0, "heard True True\n", "")
