"""Work in lanes: one task at a time, in order; where the latest wins, all others are left."""

import threading

import pytest

from brushgs.outlets.studio.work import AbandonedError, Lane, Progress, Task, WatchedReport
from brushgs.pipeline.report import Stopwatch

SECONDS = 30


@pytest.fixture
def lanes():
    made = []

    def lane(**options):
        made.append(Lane("test", **options))
        return made[-1]

    yield lane
    assert all(one.close(SECONDS) for one in made)


class Held:
    """A task that runs until it is let go, and notes what became of it."""

    def __init__(self, ran):
        self.began, self.goes_on = threading.Event(), threading.Event()
        self._ran = ran

    def __call__(self, task):
        self.began.set()
        assert self.goes_on.wait(SECONDS)
        task.check()
        self._ran.append(self)


def test_a_lane_that_is_closed_leaves_its_work(lanes):
    lane, ran = lanes(), []
    running, waiting = Held(ran), Held(ran)
    task = lane.submit(running)
    later = lane.submit(waiting)
    assert running.began.wait(SECONDS)
    waiter = Task(lambda task: None)
    waiter.abandon()
    with pytest.raises(AbandonedError):
        lane.wait(waiter)
    assert not lane.wait(seconds=0)
    assert not lane.close(0)  # it still runs
    assert task.is_abandoned
    assert later.is_abandoned
    running.goes_on.set()
    assert lane.close(SECONDS)
    assert ran == []
    assert not waiting.began.is_set()
    assert lane.submit(running).is_abandoned


def test_a_watched_report_tells_stages_and_frames_and_can_be_left_between_them():
    told = []

    def watch(progress):
        told.append(progress)
        if progress == Progress("paint", 2, 3):
            raise AbandonedError

    report = WatchedReport(watch=watch)
    with report.stage("prune", apart=Stopwatch()) as stage:
        stage.did = "nothing"
    with report.stage("paint", total=3):
        report.advance()
        with pytest.raises(AbandonedError):
            report.advance()
    assert told == [Progress("prune"), *(Progress("paint", done, 3) for done in range(3))]
    assert [stage.name for stage in report.stages] == ["prune", "paint"]
