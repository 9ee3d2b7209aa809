"""`parallel_map` over processes of this machine."""

import contextlib
import itertools
import os
import pickle
import signal
import threading
import time
from pathlib import Path

import pytest

from brushgs.core.threads import num_threads_or_default
from brushgs.errors import SceneError, SceneWarning
from brushgs.pipeline.parallel import parallel_map
from tests.kit.commands import is_alive
from tests.kit.for_each import for_each
from tests.parallel import work
from tests.parallel.conftest import NUM_FRAMES, run_script


def children():
    """Process ids of the processes that this one has started and not yet waited for."""
    found = []
    for status in Path("/proc").glob("[0-9]*/status"):
        with contextlib.suppress(OSError):
            if f"\nPPid:\t{os.getpid()}\n" in status.read_text():
                found.append(int(status.parent.name))
    return found


def test_a_process_killed_midway_loses_no_frame(painter, frames, tmp_path):
    painter = work.Painter(painter.strokes, painter.texture, kills=4, marker=tmp_path / "killed")
    assert list(parallel_map(painter, range(NUM_FRAMES), jobs=2)) == frames
    assert painter.marker.exists()


@for_each("jobs", [1, 2])
def test_results_come_in_the_order_of_the_items(jobs):
    assert list(parallel_map(work.square, range(50), jobs=jobs)) == [x * x for x in range(50)]


def test_nothing_starts_before_the_first_request_and_few_items_are_in_flight():
    taken = []
    results = parallel_map(work.square, (taken.append(x) or x for x in itertools.count()), jobs=2)
    assert taken == []
    assert next(results) == 0
    assert len(taken) <= 4
    assert [next(results) for _ in range(5)] == [1, 4, 9, 16, 25]
    assert len(taken) <= 9
    results.close()


def test_closing_kills_the_processes():
    results = parallel_map(work.process_id, itertools.count(), jobs=2)
    started = {next(results) for _ in range(6)}
    assert started <= set(children())
    results.close()
    assert not started & set(children())


def test_an_error_of_the_work_arrives_as_it_is_and_in_its_turn():
    results = parallel_map(work.fail_at_3, range(9), jobs=2)
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(SceneError, match=r"^a\.ply: is bad") as caught:
        next(results)
    assert (str(caught.value), caught.value.path) == ("a.ply: is bad", Path("a.ply"))
    assert "fail_at_3" in caught.value.__notes__[0]


def test_a_warning_of_the_work_is_issued_here():
    with pytest.warns(SceneWarning, match="item 7 is odd"):
        assert list(parallel_map(work.warn, [7], jobs=2)) == [7]


def test_an_item_that_always_kills_its_process_is_named():
    sentence = r"item 0 killed its process 3 times, the last one by SIGKILL; .*fewer jobs"
    with pytest.raises(ChildProcessError, match=sentence):
        list(parallel_map(work.die, range(3), jobs=2))


def test_processes_share_the_processors():
    threads = set(parallel_map(work.num_threads, range(4), jobs=2))
    assert threads == {max(1, num_threads_or_default(None) // 2)}


@for_each(
    ("error", "match", "options"),
    [
        (ValueError, "jobs must be at least 1, got 0", {"jobs": 0}),
        (TypeError, "integer", {"jobs": 1.5}),
        (ValueError, "must not be given together with a scheduler", {"jobs": 2, "scheduler": "tcp://a:1"}),
        (ValueError, "an address such as tcp://host:8786, got 'a:1'", {"scheduler": "a:1"}),
        (ValueError, "an address such as tcp://host:8786, got 'tcp://a:b'", {"scheduler": "tcp://a:b"}),
    ],
)
def test_impossible_options_are_refused_at_once(error, match, options):
    with pytest.raises(error, match=match):
        parallel_map(work.square, [1], **options)


def test_work_that_cannot_be_pickled_is_refused():
    with pytest.raises(TypeError, match="work must be picklable"):
        list(parallel_map(lambda x: x, [1], jobs=2))
    with pytest.raises(TypeError, match="item 0 must be picklable"):
        list(parallel_map(work.identity, [threading.Lock()], jobs=2))


def test_a_script_without_a_main_guard_runs_once(tmp_path):
    script = run_script(
        tmp_path / "script.py",
        """
        from brushgs.pipeline.parallel import parallel_map
        from tests.parallel.work import square
        print("once", list(parallel_map(square, range(5), jobs=2)))
        import sys
        print({"dask", "distributed", "multiprocessing", "numpy"} & set(sys.modules))
        def own(x): return x
        try:
            list(parallel_map(own, range(5), jobs=2))
        except ValueError as error:
            print(error)
        """,
    )
    out, err = script.communicate(timeout=60)
    assert err == ""
    lines = out.splitlines()
    assert lines[0] == "once [0, 1, 4, 9, 16]"
    assert lines[1] == "set()", "what plain work does not need is loaded"
    assert lines[2].startswith("parallel_map: own must be defined in a module")
    assert len(lines) == 3


ENDLESS = """
    import itertools
    from brushgs.pipeline.parallel import parallel_map
    from tests.parallel.work import process_id
    for pid in parallel_map(process_id, itertools.count(), jobs=2):
        print(pid, flush=True)
    """


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_leaves_no_process_and_no_output_of_theirs(tmp_path, number):
    script = run_script(tmp_path / "endless.py", ENDLESS, start_new_session=True)
    workers = {int(script.stdout.readline()) for _ in range(200)}
    if number == signal.SIGINT:
        os.killpg(script.pid, number)  # as a terminal sends Ctrl-C: to all of them
    else:
        script.send_signal(number)
    _, err = script.communicate(timeout=60)
    if number == signal.SIGINT:
        assert err.count("Traceback") == 1, err
        assert err.endswith("KeyboardInterrupt\n")
    else:
        assert err == ""
    limit = time.monotonic() + 60
    while any(is_alive(pid) for pid in workers):
        assert time.monotonic() < limit, "the processes outlive the one that started them"
        time.sleep(0.01)


class Runs:
    """Calls a function where it is unpickled."""

    def __reduce__(self):
        return print, ("called",)


def test_a_reply_of_a_process_that_may_do_anything_runs_nothing(capsys):
    # By their modules as they are now: another test may have loaded these anew.
    from brushgs.core.messages import Done, Failed, opened, reply_bytes
    from brushgs.errors import SceneError
    from brushgs.formats.usd import RefusedError

    plain = Done({"a": [1, 2.5, "b"]}, [("odd", UserWarning, "file", 3)])
    assert opened(reply_bytes(plain), errors=()) == plain
    assert isinstance(opened(reply_bytes(Failed(ValueError("a"), "")), errors=()).error, ValueError)
    for other in (Done(Runs(), []), Failed(SceneError("a", "b"), ""), [1]):
        with pytest.raises(pickle.UnpicklingError):
            opened(reply_bytes(other), errors=())
    refused = Failed(RefusedError("a"), "")
    assert opened(reply_bytes(refused), errors=(RefusedError,)).error.args == ("a",)
    assert capsys.readouterr().out == ""
