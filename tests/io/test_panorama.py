"""Marks by which players know spheres and pictures of two eyes."""

import av
import numpy as np
import OpenImageIO
import pytest

from brushgs.formats.pictures.encoding import choose_encoding
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.pictures.panorama import mark_video
from brushgs.formats.pictures.video import open_video
from brushgs.values.frame import Frame
from brushgs.values.shot import Panorama, Shot
from tests.kit.for_each import for_each

SPHERE, HALVES = Panorama(360), Panorama(180, "side")
SIZES = {"CroppedAreaImageWidthPixels": 64, "FullPanoWidthPixels": 64, "FullPanoHeightPixels": 32}


def frame_of(width=64, height=32):
    rgb = np.random.default_rng(0).random((height, width, 3)).astype(np.float32)
    return Frame(rgb, np.ones((height, width), np.float32))


@for_each("suffix", [".png", ".jpg"])
def test_pictures_have_the_tags_of_photo_spheres(suffix, tmp_path):
    marked, plain = tmp_path / f"marked{suffix}", tmp_path / f"plain{suffix}"
    write_frame(frame_of(), marked, (1, 1, 1), shot=Shot(panorama=SPHERE))
    write_frame(frame_of(), plain, (1, 1, 1), shot=Shot(panorama=HALVES))
    spec = OpenImageIO.ImageInput.open(str(marked)).spec()
    assert spec.get_string_attribute("GPano:ProjectionType") == "equirectangular"
    for name, value in SIZES.items():
        assert int(spec.getattribute(f"GPano:{name}")) == value
    assert b"http://ns.google.com/photos/1.0/panorama/" in marked.read_bytes()
    assert b"GPano" not in plain.read_bytes()  # they know no two eyes
    np.testing.assert_array_equal(read_image(marked), read_image(plain))


def test_open_exr_files_are_environment_maps(tmp_path):
    marked, plain = tmp_path / "marked.exr", tmp_path / "plain.exr"
    write_frame(frame_of(), marked, shot=Shot(panorama=SPHERE))
    write_frame(frame_of(), plain, shot=Shot())
    assert b"envmap\0envmap\0\1\0\0\0\0" in marked.read_bytes()
    spec = OpenImageIO.ImageInput.open(str(marked)).spec()
    assert spec.get_string_attribute("textureformat") == "LatLong Environment"
    np.testing.assert_array_equal(read_image(marked), read_image(plain))


def video(path, panorama, **options):
    rng = np.random.default_rng(0)
    encoding = choose_encoding(path, **options)
    with open_video(path, encoding, width=64, height=32, fps=12, panorama=panorama) as reel:
        reel.describe("a comment")
        for _ in range(5):
            reel.add(rng.integers(0, 255, (32, 64, 3), dtype=np.uint8))
    return path


def frames_and_marks(path):
    with av.open(str(path)) as container:
        assert container.metadata.get("comment", container.metadata.get("COMMENT")) == "a comment"
        frames = list(container.decode(video=0))
    planes = [[bytes(plane) for plane in frame.planes] for frame in frames]
    return planes, {one.type.name for one in frames[0].side_data}


@for_each("name, codec", [("a.mp4", None), ("a.mp4", "h265"), ("a.mov", None), ("a.mov", "h264")])
@for_each("panorama", [SPHERE, HALVES, Panorama(None, "top")])
def test_videos_are_marked_and_play_as_before(panorama, name, codec, tmp_path):
    plain, plain_marks = frames_and_marks(video(tmp_path / f"plain-{name}", None, codec=codec))
    marked, found = frames_and_marks(video(tmp_path / name, panorama, codec=codec))
    assert found - plain_marks == {"STEREO3D"} | ({"SPHERICAL"} if panorama.degrees else set())
    assert len(marked) == len(plain) == 5
    assert marked == plain


@for_each("name", ["a.mkv", "a.webm"])
def test_matroska_says_where_the_eyes_are(name, tmp_path):
    path = video(tmp_path / name, Panorama(None, "side"))
    with av.open(str(path)) as container:
        assert container.streams.video[0].metadata["stereo_mode"] == "left_right"


@for_each("content", [b"", b"\0\0\0\10free", b"\0\0\0\20moov\0\0\0\10udta", b"\0\0\0\20moov\0\0\0\2trak"])
def test_a_file_without_a_video_is_refused_and_kept(content, tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(content)
    with pytest.raises(ValueError, match="mark_video: "):
        mark_video(path, SPHERE)
    assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]
