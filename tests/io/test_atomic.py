import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from brushgs import SceneError
from brushgs.formats.files import filling, noting_written, replacing
from tests.kit.for_each import for_each


def test_the_file_appears_whole_and_nothing_else_is_left(tmp_path):
    target = tmp_path / "a.png"
    with replacing(target) as temporary:
        temporary.write_text("new")
        assert not target.exists()
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".png")
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@for_each("error", [ValueError, KeyboardInterrupt])
def test_after_a_failure_the_old_file_stands_and_nothing_else(tmp_path, error):
    target = tmp_path / "a.png"
    target.write_text("old")

    def fail() -> None:
        with replacing(target) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(error):
        fail()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real.png").write_text("old")
    (tmp_path / "link.png").symlink_to(tmp_path / "real.png")
    with replacing(tmp_path / "link.png") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.png").is_symlink()
    assert (tmp_path / "real.png").read_text() == "new"


@pytest.mark.parametrize("name", [".", os.devnull])
def test_folders_and_devices_are_not_replaced(tmp_path, name):
    with pytest.raises(SceneError, match="is not a regular file and cannot be replaced; choose another name"):
        replacing(tmp_path / name).__enter__()


def test_missing_folders_are_made_with_the_first_file_and_go_with_it(tmp_path):
    path = tmp_path / "a" / "b" / "c.png"
    with pytest.raises(RuntimeError), replacing(path):
        raise RuntimeError("painting failed")
    assert list(tmp_path.iterdir()) == []
    with replacing(path) as temporary:
        temporary.write_text("whole")
    assert path.read_text() == "whole"
    with pytest.raises(RuntimeError), replacing(path.with_name("d.png")):
        raise RuntimeError("painting failed")
    assert path.read_text() == "whole"


def test_ctrl_c_while_the_file_is_made_leaves_nothing(tmp_path, monkeypatch):
    def stop(descriptor):
        raise KeyboardInterrupt

    monkeypatch.setattr("brushgs.formats.files.os.close", stop)
    with pytest.raises(KeyboardInterrupt):
        replacing(tmp_path / "a.mp4").__enter__()
    assert list(tmp_path.iterdir()) == []


def test_what_is_written_whole_is_noted_in_every_thread_and_what_fails_is_not(tmp_path):
    def write(name: str) -> None:
        with replacing(tmp_path / name) as temporary:
            temporary.write_text("new")
            if name == "c.png":
                raise ValueError("full")

    with noting_written() as written, noting_written() as within:
        write("a.png")
        with ThreadPoolExecutor(1) as thread:
            thread.submit(write, "b.png").result()
        with pytest.raises(ValueError, match="full"):
            write("c.png")
        with filling(tmp_path / "folder", lambda path: False) as temporary:
            (temporary / "d.npy").write_text("new")
    write("e.png")
    assert written == within == {tmp_path / name for name in ("a.png", "b.png", "folder/d.npy")}
