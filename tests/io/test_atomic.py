import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from brushgs import SceneError
from brushgs.formats.files import filling, noting_written, replacing


def test_the_file_appears_whole_and_nothing_else_is_left(tmp_path):
    target = tmp_path / "a.png"
    with replacing(target) as temporary:
        temporary.write_text("new")
        assert not target.exists()
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".png")
    (tmp_path / "plain").write_text("")
    rights = [stat.S_IMODE(path.stat().st_mode) for path in (target, tmp_path / "plain")]
    assert rights[0] == rights[1]
    for error in (ValueError, KeyboardInterrupt):
        with pytest.raises(error), replacing(target):
            raise error
    (tmp_path / "link.png").symlink_to(target)
    with replacing(tmp_path / "link.png") as temporary:
        temporary.write_text("newer")
    assert target.read_text() == "newer"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "link.png", "plain"]
    for path in (tmp_path, Path(os.devnull)):
        sentence = "is not a regular file and cannot be replaced; choose another name"
        with pytest.raises(SceneError, match=sentence):
            replacing(path).__enter__()


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
