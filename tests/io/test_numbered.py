import json
from pathlib import Path

import pytest

from brushgs import SceneError
from brushgs.formats.pictures.numbered import Manifest, NumberedFiles
from tests.kit.for_each import for_each

SUFFIXES = (".png", ".exr")


def files(folder: Path, name: str = "%05d.png") -> NumberedFiles:
    return NumberedFiles.of(folder / name, SUFFIXES)


def started(folder: Path, painting: dict[str, object] | None = None) -> Manifest:
    manifest = Manifest(files(folder), painting or {"stroke": "swirl", "seed": 3})
    manifest.begin()
    return manifest


@for_each(
    ("name", "first"),
    [("%05d.png", "00007.png"), ("frame-%04d.exr", "frame-0007.exr"), ("a%d.PNG", "a7.PNG")],
)
def test_the_number_takes_its_place(tmp_path, name, first):
    found = files(tmp_path, name)
    assert found.path(7) == tmp_path / first
    assert found.number(tmp_path / first) == 7
    assert found.number(tmp_path / f"x{first}") is None


@for_each(
    "name",
    ["a.png", "%d-%d.png", "%5d.png", "%s.png", "%f.png", "100%%-%d.png", "%.png", "%-5d.png", "%00d.png"],
)
def test_a_name_of_another_form_is_refused(tmp_path, name):
    with pytest.raises(ValueError, match=r"must hold one number such as %05d, got .*; write .*%05d\.png"):
        files(tmp_path, name)
    with pytest.raises(ValueError, match=r"numbered frames must end in \.png, \.exr, got"):
        files(tmp_path, "%05d.jpg")
    with pytest.raises(ValueError, match="the number must be in the name of the file, not of its folder"):
        files(tmp_path / "take%02d", "a.png")


def test_a_manifest_reads_back_what_was_written_and_knows_what_is_done(tmp_path):
    manifest = started(tmp_path / "new")
    for index, content in ((0, b"abc"), (5, b"abcde"), (6, b"abc")):
        manifest.add(index, content)
    found = Manifest.read(files(tmp_path / "new"))
    assert (found.painting, found.sizes) == ({"stroke": "swirl", "seed": 3}, {0: 3, 5: 5, 6: 3})
    manifest.files.path(0).unlink()
    manifest.files.path(6).write_bytes(b"ab")
    assert [found.is_done(index) for index in (0, 1, 5, 6)] == [False, False, True, False]
    assert files(tmp_path / "new").path(5).read_bytes() == b"abcde"
    started(tmp_path / "new", {"stroke": "flat"})  # a new painting has no part of what lay there before
    assert not Manifest.read(files(tmp_path / "new")).is_done(5)
    assert Manifest.read(files(tmp_path / "new", "other-%03d.png")) is None


def test_lines_that_were_cut_off_or_make_no_sense_cost_their_frames_alone(tmp_path):
    manifest = started(tmp_path)
    for index in range(3):
        manifest.add(index, b"abc")
    path = manifest.files.manifest
    path.write_bytes(path.read_bytes()[:-4])
    found = Manifest.read(manifest.files)
    assert found.sizes == {0: 3, 1: 3}
    found.begin()
    found.add(2, b"abc")
    assert Manifest.read(manifest.files).sizes == {0: 3, 1: 3, 2: 3}
    lines = ['{"frame": 1e999, "bytes": 1}', "[" * 10_000, "\xff", '{"frame": 7, "bytes": 7}']
    path.write_bytes(path.read_bytes() + "\n".join(lines).encode("latin-1"))
    assert Manifest.read(manifest.files).sizes == {0: 3, 1: 3, 2: 3, 7: 7}


@for_each("content", ["", "{", "[]\n", '{"painting": 3}\n', json.dumps({"a": 1}), "\xff\n", "[" * 100_000])
def test_another_file_in_the_place_of_a_manifest_is_reported(tmp_path, content):
    files(tmp_path).manifest.write_bytes(content.encode("latin-1"))
    with pytest.raises(SceneError, match=r"\.%05d\.png\.json: is no manifest of frames; remove it, or omit"):
        Manifest.read(files(tmp_path))


def test_a_manifest_that_cannot_be_made_or_extended_is_reported(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(SceneError, match=r"file cannot be made \(.*exists\)"):
        started(tmp_path / "file")
    manifest = started(tmp_path)
    manifest.files.manifest.unlink()
    manifest.files.manifest.mkdir()
    with pytest.raises(SceneError, match=r"\.json: cannot be written \(Is a directory\); check the disk"):
        manifest.add(0, b"abc")
    with pytest.raises(SceneError, match=r"\.json: is a folder; name the file inside it"):
        Manifest.read(manifest.files)
