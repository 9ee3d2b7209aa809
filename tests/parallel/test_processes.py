"""`spread` over processes of this machine."""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

from brushgs.errors import SceneError, SceneWarning
from brushgs.painting.parallel import spread
from brushgs.threads import num_threads_or_default
from tests.parallel import work
from tests.parallel.conftest import NUM_FRAMES, ROOT


def children():
    """Process ids of the processes that this one has started and not yet seen off."""
    found = []
    for status in Path("/proc").glob("[0-9]*/status"):
        with contextlib.suppress(OSError):
            if f"\nPPid:\t{os.getpid()}\n" in status.read_text():
                found.append(int(status.parent.name))
    return found


def test_frames_are_the_same_bits_in_two_processes(painter, frames):
    assert list(spread(painter, range(NUM_FRAMES), jobs=2)) == frames


def test_a_process_killed_midway_loses_no_frame(painter, frames, tmp_path):
    painter = work.Painter(painter.strokes, painter.texture, kills=4, marker=tmp_path / "killed")
    assert list(spread(painter, range(NUM_FRAMES), jobs=2)) == frames
    assert painter.marker.exists()


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_items(jobs):
    assert list(spread(work.square, range(50), jobs=jobs)) == [x * x for x in range(50)]


def test_one_job_works_in_this_process_and_two_in_others():
    assert set(spread(work.process_id, range(3))) == {os.getpid()}
    others = set(spread(work.process_id, range(20), jobs=2))
    assert len(others) == 2
    assert os.getpid() not in others


def test_nothing_starts_before_it_is_asked_for_and_few_items_are_under_way():
    taken = []
    results = spread(work.square, (taken.append(x) or x for x in itertools.count()), jobs=2)
    assert taken == []
    assert next(results) == 0
    assert len(taken) <= 4
    assert [next(results) for _ in range(5)] == [1, 4, 9, 16, 25]
    assert len(taken) <= 9
    results.close()


def test_closing_ends_the_processes():
    results = spread(work.process_id, itertools.count(), jobs=2)
    started = {next(results) for _ in range(6)}
    assert started <= set(children())
    results.close()
    assert not started & set(children())


def test_fewer_items_than_jobs_start_no_more_processes_than_items():
    before = len(children())
    results = spread(work.square, [3, 4], jobs=8)
    next(results)
    assert len(children()) - before <= 2
    assert list(results) == [16]


def test_an_error_of_the_work_arrives_as_it_is_and_in_its_turn():
    results = spread(work.fail_at_3, range(9), jobs=2)
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(SceneError, match=r"^a\.ply: is bad") as caught:
        next(results)
    assert (str(caught.value), caught.value.path) == ("a.ply: is bad", Path("a.ply"))
    assert "fail_at_3" in caught.value.__notes__[0]


def test_an_error_that_cannot_be_read_back_arrives_as_its_sentence():
    with pytest.raises(RuntimeError, match="UnreadableError: 0 and more"):
        list(spread(work.fail_unreadably, [0], jobs=2))


def test_work_that_does_not_arrive_is_told_why():
    with pytest.raises(OSError, match="no room here"):
        list(spread(work.Unwilling(), [0], jobs=2))


def test_a_warning_of_the_work_is_given_here():
    with pytest.warns(SceneWarning, match="item 7 is odd"):
        assert list(spread(work.warn, [7], jobs=2)) == [7]


def test_an_item_that_always_ends_its_process_is_named():
    with pytest.raises(
        ChildProcessError, match=r"item 0 ended its process 3 times, at last by SIGKILL; .*fewer jobs"
    ):
        list(spread(work.die, range(3), jobs=2))


def test_an_item_is_taken_as_it_was_when_its_turn_came():
    def reused():
        item = [0]
        for value in range(20):
            item[0] = value
            yield item

    assert list(spread(work.identity, reused(), jobs=2)) == [[value] for value in range(20)]


def test_processes_share_the_processors():
    threads = set(spread(work.num_threads, range(4), jobs=2))
    assert threads == {max(1, num_threads_or_default(None) // 2)}


def test_large_results_pass_whole():
    items = [bytes([value]) * 20_000_000 for value in range(4)]
    assert list(spread(work.identity, items, jobs=2)) == items


@pytest.mark.parametrize(
    ("error", "match", "options"),
    [
        (ValueError, "jobs must be at least 1, got 0", {"jobs": 0}),
        (TypeError, "integer", {"jobs": 1.5}),
        (
            ValueError,
            "jobs must be left out beside a scheduler, got 2",
            {"jobs": 2, "scheduler": "tcp://a:1"},
        ),
        (ValueError, "an address like tcp://host:8786, got 'a:1'", {"scheduler": "a:1"}),
        (ValueError, "an address like tcp://host:8786, got 'tcp://a'", {"scheduler": "tcp://a"}),
        (ValueError, "an address like tcp://host:8786, got 'tcp://a:b'", {"scheduler": "tcp://a:b"}),
    ],
)
def test_impossible_options_are_refused_at_once(error, match, options):
    with pytest.raises(error, match=match):
        spread(work.square, [1], **options)


def test_work_that_cannot_be_pickled_is_refused():
    with pytest.raises(TypeError, match="work must be picklable"):
        list(spread(lambda x: x, [1], jobs=2))
    with pytest.raises(TypeError, match="item 0 must be picklable"):
        list(spread(work.identity, [threading.Lock()], jobs=2))


def run_script(path, code, **options):
    path.write_text(textwrap.dedent(code))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, path],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def test_a_script_without_a_main_guard_runs_once(tmp_path):
    script = run_script(
        tmp_path / "script.py",
        """
        from brushgs.painting.parallel import spread
        from tests.parallel.work import square
        print("once", list(spread(square, range(5), jobs=2)))
        import sys
        print({"dask", "distributed", "multiprocessing", "numpy"} & set(sys.modules))
        def own(x): return x
        try:
            list(spread(own, range(5), jobs=2))
        except ValueError as error:
            print(error)
        """,
    )
    out, err = script.communicate(timeout=60)
    assert err == ""
    lines = out.splitlines()
    assert lines[0] == "once [0, 1, 4, 9, 16]"
    assert lines[1] == "set()", "what plain work does not need is loaded"
    assert lines[2].startswith("spread: own must be in a module of its own")
    assert len(lines) == 3


ENDLESS = """
    import itertools
    from brushgs.painting.parallel import spread
    from tests.parallel.work import process_id
    for pid in spread(process_id, itertools.count(), jobs=2):
        print(pid, flush=True)
    """


def is_alive(pid):
    """Whether a process runs: one that has ended and waits to be seen off does not."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_leaves_no_process_and_no_word_of_theirs(tmp_path, number):
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
