"""The metadata of a picture, in every format that is written."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.encoding import choose_encoding
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.pictures.metadata import is_painted_by, metadata_text, read_metadata
from brushgs.formats.pictures.oiio import video_pixels
from brushgs.formats.pictures.video import open_video
from brushgs.formats.registry import PICTURE_SUFFIXES, VIDEO_SUFFIXES, find_written
from brushgs.values.shot import Origin, Shot
from brushgs.version import __version__

ORIGIN = Origin("brushgs render 'größe 1.ply' --look ink", "digest 0a")
CAMERA = bg.Camera(np.eye(4), np.array([[20.0, 0, 16], [0, 20, 12], [0, 0, 1]]), 32, 24)
SHOT = Shot(CAMERA, origin=ORIGIN)
EPOCH = b"1970:01:01 00:00:00"  # no file holds the time of day
FORMATS = [*PICTURE_SUFFIXES, *VIDEO_SUFFIXES]


def picture(seed: int = 0) -> bg.Frame:
    rgb = np.random.default_rng(seed).random((24, 32, 3)).astype(np.float32)
    return bg.Frame(rgb, np.ones((24, 32), np.float32))


def write(path: Path, shot: Shot | None) -> Path:
    if path.suffix in PICTURE_SUFFIXES:
        write_frame(picture(), path, (1.0, 1.0, 1.0), shot=shot)
        return path
    bits = choose_encoding(path).bits
    with open_video(path, choose_encoding(path), width=32, height=24, fps=8) as video:
        if text := metadata_text(shot):
            video.describe(text)
        for seed in range(3):
            video.add(video_pixels(picture(seed), (1.0, 1.0, 1.0), bits))
    return path


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_says_how_it_was_painted_and_stays_the_same(tmp_path, suffix):
    path, again = write(tmp_path / f"a{suffix}", SHOT), write(tmp_path / f"b{suffix}", SHOT)
    plain = write(tmp_path / f"c{suffix}", replace(SHOT, origin=None))
    assert path.read_bytes() == again.read_bytes()
    assert set(re.findall(rb"\d{4}[:-]\d\d[:-]\d\d[ T]\d\d:\d\d:\d\d", path.read_bytes())) <= {EPOCH}
    row = find_written("picture", path) or find_written("video", path)
    assert b"brushgs render" not in plain.read_bytes()
    if not row.holds_metadata:
        assert path.read_bytes() == plain.read_bytes()
        return
    found = read_metadata(path)
    assert (found.brushgs, found.command, found.inputs) == (__version__, ORIGIN.command, ORIGIN.inputs)
    assert (found.camera.width, found.camera.K[0]) == (32, 20.0)
    assert is_painted_by(path, ORIGIN)
    assert not is_painted_by(path, replace(ORIGIN, inputs="digest 0b"))
    assert read_metadata(plain) is None
    if suffix in PICTURE_SUFFIXES:
        np.testing.assert_array_equal(read_image(path), read_image(plain))


@pytest.mark.parametrize("name", ["missing.mp4", "words.png", "words.mp4"])
def test_what_is_no_picture_is_refused_and_never_the_same_painting(tmp_path, name):
    (tmp_path / "words.png").write_text("words")
    (tmp_path / "words.mp4").write_text("words")
    with pytest.raises(bg.SceneError, match=name):
        read_metadata(tmp_path / name)
    assert not is_painted_by(tmp_path / name, ORIGIN)
