"""Workers where no process inherits sockets, nor hears a mask of signals (Windows): over pipes."""

import signal

import pytest

from brushgs.core import streams
from brushgs.pipeline.parallel import parallel_map
from tests.parallel import work
from tests.parallel.conftest import NUM_FRAMES


@pytest.fixture(autouse=True)
def pipes(monkeypatch):
    monkeypatch.setattr(streams, "INHERITS_SOCKETS", False)
    monkeypatch.delattr(signal, "pthread_sigmask")


def test_a_process_killed_midway_loses_no_frame(painter, frames, tmp_path):
    painter = work.Painter(painter.strokes, painter.texture, kills=4, marker=tmp_path / "killed")
    assert list(parallel_map(painter, range(NUM_FRAMES), jobs=2)) == frames
    assert painter.marker.exists()


def test_what_work_prints_comes_between_no_messages(capfd):
    assert list(parallel_map(print, ["one", "two"], jobs=2)) == [None, None]
    out, err = capfd.readouterr()
    assert (out, sorted(err.split())) == ("", ["one", "two"])
