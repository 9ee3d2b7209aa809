"""Files made to harm: each gives one sentence, at once and without the memory it asks for.

The fuzzer in `tests/fuzz` looks for more of them; what it and a reading of the code found is kept here.
"""

import json
import os
import struct
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

from brushgs import SceneError, SceneWarning, StrokeTexture
from brushgs.formats import load, load_cameras
from brushgs.formats.pictures import images
from brushgs.formats.pictures.images import read_image
from brushgs.formats.pictures.numbered import Manifest, NumberedFiles
from brushgs.pipeline.background import open_background
from tests.fuzz.corpus import many_directories
from tests.io import test_cameras, test_colmap, test_compressed_ply
from tests.io.ply_maker import element_bytes, scene_columns, write_ply_file, write_scene
from tests.io.test_images import png, write_raw

HEAD = b"ply\nformat binary_little_endian 1.0\n"


def manifest(path: Path) -> object:
    return Manifest.read(NumberedFiles(path.parent, path.name.removeprefix(".").removesuffix(".json")))


READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "scene": ("a.ply", load),
    "cameras": ("a.json", load_cameras),
    "COLMAP": ("images.bin", load_cameras),
    "picture": ("a.png", read_image),
    "stroke": ("a.png", StrokeTexture.open),
    "background": ("a.png", lambda path: open_background(str(path), 8, 8)),
    "manifest": (".%05d.png.json", manifest),
}


def refuse(read: Callable[[Path], object], path: Path, sentence: str) -> str:
    """Reading must fail with one printable sentence that names a file and is not long."""
    with pytest.raises(ValueError, match=sentence) as caught:
        read(path)
    message = str(caught.value)
    assert str(path.parent) in message
    assert len(message) < 1200
    assert message.isprintable()
    return message


# ---- what is no plain file


@pytest.fixture(params=READERS, ids=READERS)
def reader(request, tmp_path):
    """The path where a reader looks, and the reader."""
    name, read = READERS[request.param]
    if request.param == "COLMAP":
        test_colmap.write(tmp_path, "bin")
        (tmp_path / name).unlink()
    return tmp_path / name, read


def test_a_pipe_is_not_waited_for(reader):
    path, read = reader
    os.mkfifo(path)
    refuse(read, path, r"is a pipe or device|neither a file nor a built-in|must be white, black")


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/stdin", "/dev/full"])
def test_a_device_is_not_read(reader, device):
    path, read = reader
    path.symlink_to(device)
    refuse(read, path, r"is a pipe or device|neither a file nor a built-in|must be white, black")


def test_a_link_to_itself_is_refused(reader):
    path, read = reader
    path.symlink_to(path.name)
    refuse(read, path, r"Too many levels|neither a file nor a built-in|must be white, black|no such file")


@pytest.mark.parametrize("name", ["a\0b", "a" * 300])
@pytest.mark.parametrize("read", [load, load_cameras, read_image, StrokeTexture.open])
def test_a_name_that_no_file_can_have_is_refused(tmp_path, name, read):
    with pytest.raises(SceneError, match=r"no such|File name too long|neither a file"):
        read(tmp_path / name)


def test_a_file_larger_than_its_reader_holds_is_not_read(tmp_path):
    for name, limit, read in (("a.json", 32, load_cameras), (".%05d.png.json", 8, manifest)):
        with (tmp_path / name).open("wb") as file:
            file.truncate((limit << 20) + 1)  # zeros that take no place on the disk
        refuse(read, tmp_path / name, f"a file must have at most {limit} MiB, got {limit}; split it")


# ---- scenes


def test_blanks_in_a_comment_take_no_time(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(HEAD + b"comment up axis" + b" " * 1_000_000 + b"z\nend_header\n")
    refuse(load, path, "no element 'vertex' among: none")


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (b"property uchar p%d\n", "must name at most 1000 properties of an element"),
        (b"property list uchar int p%d\n", "must name at most 1000 list properties"),
        (b"element e%d 0\n", "must name at most 100 elements"),
    ],
)
def test_a_header_of_a_hundred_thousand_lines_is_refused(tmp_path, line, sentence):
    path = tmp_path / "a.ply"
    lines = b"".join(line % number for number in range(20_000))
    path.write_bytes(HEAD + b"element vertex 1\n" + lines + b"end_header\n")
    refuse(load, path, sentence)


def test_what_a_header_says_is_quoted_short_and_without_control_characters(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(HEAD + b"element \x1b[2J" + b"x" * 100_000 + b" 1\nend_header\n")
    assert "among: ?[2Jxxx" in refuse(load, path, "no element 'vertex'")


def test_a_line_of_text_without_end_is_refused(tmp_path):
    path = write_scene(tmp_path / "a.ply", scene_columns(50), "ascii")
    path.write_bytes(path.read_bytes() + b"1 " * 200_000)
    assert len(load(path)) == 50  # what follows the rows is not looked at
    path.write_bytes(path.read_bytes().replace(b"vertex 50", b"vertex 51"))
    refuse(load, path, "has a line of more than 65536 bytes among its rows; it is damaged: export it again")


def test_rows_of_bytes_must_not_fill_the_memory(tmp_path):
    packed = dict.fromkeys(test_compressed_ply.PACKED, np.zeros(1))
    ranges = [f"{end}_{axis}" for end in ("min", "max") for axis in (*"xyz", "scale_x", "scale_y", "scale_z")]
    chunk = element_bytes("chunk", dict.fromkeys(ranges, np.zeros(1)), types=dict.fromkeys(ranges, "char"))
    vertex = element_bytes("vertex", packed, types=dict.fromkeys(packed, "uchar"))
    path = write_ply_file(tmp_path / "a.ply", [chunk, vertex])
    content = path.read_bytes().replace(b"vertex 1", b"vertex 25600000").replace(b"chunk 1", b"chunk 100000")
    path.write_bytes(content)
    os.truncate(path, 4 * 25_600_000 + 12 * 100_000 + len(content))
    refuse(load, path, "25600000 Gaussians take 1367 MiB in memory and 98 MiB in the file, too little")


def test_chunks_without_columns_are_refused_whatever_their_number(tmp_path):
    packed = dict.fromkeys(test_compressed_ply.PACKED, np.zeros(3))
    elements = [(b"element chunk 999999999999999999\n", b""), element_bytes("vertex", packed)]
    refuse(load, write_ply_file(tmp_path / "a.ply", elements), "no property 'min_x' in element 'chunk'")


# ---- cameras


def cameras_file(tmp_path: Path, text: str | bytes) -> Path:
    path = tmp_path / "cameras.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize("field", ["width", "position", "rotation", "fx"])
def test_json_that_goes_deep_is_refused_at_every_depth(tmp_path, field):
    for depth in (*range(10, 1000, 45), *range(900, 1010, 3), 100_000):
        frame = json.dumps([test_cameras.INRIA | {field: "HERE"}])
        path = cameras_file(tmp_path, frame.replace('"HERE"', "[" * depth + "]" * depth))
        refuse(load_cameras, path, rf"\.{field}(\[0\])* must|nested too deeply")


@pytest.mark.parametrize("unit", ["[],", "{},", "[0],", '"ab",', '{"a":1},', "1,"])
def test_json_that_swells_is_refused_before_it_is_parsed(tmp_path, unit):
    path = cameras_file(tmp_path, "[" + unit * (12_000_000 // len(unit)) + "0]")
    refuse(load_cameras, path, "would take [0-9]+ MiB of memory for 11.4 MiB of text; split it")


def test_forty_thousand_views_are_no_trap(tmp_path):
    frame = json.dumps({"camera_to_world": np.linspace(0, 1, 16).tolist(), "fov": 50.0, "aspect": 1.7})
    content = '{"camera_path": [' + ",".join([frame] * 40_000) + "]}"
    refuse(
        load_cameras,
        cameras_file(tmp_path, content),
        r"camera_path\[0\]\.render_width is missing, it must be a number",
    )


def test_names_in_any_script_are_no_trap(tmp_path):
    content = json.dumps([test_cameras.INRIA | {"img_name": "Стул 椅子 🪑" * 5000}], ensure_ascii=False)
    assert len(load_cameras(cameras_file(tmp_path, content))) == 1
    broken = content.encode()[:-3] + b"\xff" + content.encode()[-3:]
    refuse(load_cameras, cameras_file(tmp_path, broken), "is not JSON .*utf-8")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ([test_cameras.INRIA | {"width": 1e99}], "the size must be that of a picture, got more than 1048576"),
        (
            [test_cameras.INRIA | {"width": 40_000}],
            "the size must be 1x1 to 32767x32767 pixels, got 40000x480",
        ),
        ([test_cameras.INRIA | {"fx": 1e308}], "the focal length must be 0.001 to 1e.09 pixels"),
        ([test_cameras.INRIA | {"fx": 5e-324}], "the focal length must be 0.001 to 1e.09 pixels"),
        ([test_cameras.INRIA | {"position": [1e308, 1e308, 0]}], "the position must lie within 1e.15 of"),
        ([test_cameras.INRIA | {"rotation": [[1e200] * 3] * 3}], "must not scale or mirror, got an entry of"),
        (test_cameras.BLENDER | {"camera_angle_x": 5e-324}, "camera_angle_x must be above 1e-06 and below"),
        (test_cameras.CAMERA_PATH | {"seconds": 1e-320}, "seconds must be a number above 1e-06"),
        (
            test_cameras.CAMERA_PATH | {"keyframes": [test_cameras.KEYFRAME | {"matrix": "[" * 10**5}]},
            r"\.matrix must be 4x4",
        ),
        (
            test_cameras.CAMERA_PATH | {"keyframes": [test_cameras.KEYFRAME | {"matrix": '{"a":1}'}]},
            r"\.matrix must be 4x4",
        ),
        (test_cameras.NERFSTUDIO | {"cx": 1e300}, "the principal point must lie within 1e.09 pixels"),
        ([test_cameras.INRIA | {"fx": "x" * 10**6}], r'\.fx must be a number above 0, got "xxx'),
        ([test_cameras.INRIA | {"fx": {"a": [1]}}], r'\.fx must be a number above 0, got {"a": ...}'),
    ],
)
def test_numbers_no_camera_has_are_refused(tmp_path, content, sentence):
    refuse(load_cameras, cameras_file(tmp_path, json.dumps(content)), sentence)


def test_a_camera_model_that_is_no_name_is_not_quoted(tmp_path):
    content = test_cameras.NERFSTUDIO | {"camera_model": ["\x1b"] * 1000, "k1": 0.5}
    content["frames"] = [test_cameras.NERFSTUDIO["frames"][0] | {"camera_model": "PINHOLE"}]
    with pytest.warns(SceneWarning, match=r"distortion of camera model PINHOLE was ignored \(k1 = 0.5\)"):
        load_cameras(cameras_file(tmp_path, json.dumps(content)))


# ---- COLMAP


@pytest.mark.parametrize("width", [2**20 + 1, 2**63, 10**400, 10**4000])
def test_a_size_no_picture_has_is_refused(tmp_path, width):
    if width < 2**64:
        test_colmap.write(tmp_path / "bin", "bin", cameras=[(1, "PINHOLE", width, 9, (5.0, 5.0, 3.0, 2.0))])
        refuse(load_cameras, tmp_path / "bin", "the size must be that of a picture")
    test_colmap.write(tmp_path / "txt", "txt", cameras=[(1, "PINHOLE", width, 9, (5.0, 5.0, 3.0, 2.0))])
    refuse(load_cameras, tmp_path / "txt", "the size must be that of a picture")


@pytest.mark.parametrize("form", test_colmap.FORMS)
def test_poses_and_lenses_no_camera_has_are_refused(tmp_path, form):
    far = [test_colmap.Image(translation=(1e300, 0, 0))]
    refuse(load_cameras, test_colmap.write(tmp_path, form, images=far), "the position must lie within")
    lens = (1, "PINHOLE", 64, 48, (1e-300, 5.0, 3.0, 2.0))
    refuse(load_cameras, test_colmap.write(tmp_path, form, cameras=[lens]), "the focal length must be 0.001")


def test_more_views_than_any_capture_has_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("brushgs.formats.cameras.colmap._MAX_ENTRIES", 3)
    images = [test_colmap.Image(f"{i}.jpg") for i in range(4)]
    assert len(load_cameras(test_colmap.write(tmp_path, "bin", images=images[:3]))) == 3
    refuse(load_cameras, test_colmap.write(tmp_path, "bin", images=images), "must hold at most 3 entries")


def test_a_line_of_a_model_without_end_is_refused_and_points_may_be_many(tmp_path):
    folder = test_colmap.write(tmp_path, "txt", images=[test_colmap.IMAGE, test_colmap.Image("b.jpg")])
    first, points, rest = (folder / "images.txt").read_text().split("a.jpg\n")[0], "1.5 2.5 7 " * 90_000, ""
    second = f"2 1 0 0 0 1 2 3 1 b.jpg\n{rest}\n"
    (folder / "images.txt").write_text(f"{first}a.jpg\n{points}\n{second}")
    assert len(load_cameras(folder)) == 2
    (folder / "images.txt").write_text(f"{first}a.jpg\n\n{points}\n")
    refuse(load_cameras, folder, "line 6: must have at most 131072 bytes; export the model as text again")


# ---- manifests


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff\xfe", b"[" * 100_000, b'{"painting": ' + b"[" * 100_000, b'{"painting": 1}', b"\0" * 100],
)
def test_what_is_no_manifest_is_refused(tmp_path, content):
    (tmp_path / ".%05d.png.json").write_bytes(content)
    refuse(manifest, tmp_path / ".%05d.png.json", "is no manifest of frames; remove it")


def test_lines_of_a_manifest_that_make_no_sense_are_skipped(tmp_path):
    lines = [
        '{"painting": {}}',
        '{"frame": 1e999, "bytes": 1}',
        "[" * 10_000,
        '{"frame": 2, "bytes": 7}',
        "\xff",
    ]
    (tmp_path / ".%05d.png.json").write_bytes("\n".join(lines).encode("latin-1"))
    assert manifest(tmp_path / ".%05d.png.json").sizes == {2: 7}


# ---- pictures


# Where a decoder has a rule of its own, it may be first.
HUGE = r"must have at most 33554432 pixels, got 60000x60000; scale it down|cannot be read as a picture \(.*MB"


def bomb(kind: str, side: int) -> bytes:
    """A small file that claims to be a picture of side x side pixels."""
    if kind == "png":
        return png(side, side, 8, 6, b"\0" * 100)
    if kind == "bmp":
        return struct.pack("<2sIHHIIiiHHIIiiII", b"BM", 54, 0, 0, 54, 40, side, side, 1, 24, *[0] * 6)
    if kind == "hdr":
        return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {side} +X {side}\n".encode() + b"\0" * 99
    if kind == "tif":
        tags = (
            (256, 4, side),
            (257, 4, side),
            (258, 3, 8),
            (259, 3, 8),
            (262, 3, 1),
            (273, 4, 8),
            (279, 4, 9),
        )
        entries = b"".join(struct.pack("<HHII", tag, form, 1, value) for tag, form, value in tags)
        return struct.pack("<2sHIH", b"II", 42, 8, len(tags)) + entries + b"\0" * 99
    assert kind == "webp"
    size = (side - 1).to_bytes(3, "little")
    return b"RIFF\x1e\0\0\0WEBPVP8X\x0a\0\0\0\x10\0\0\0" + size * 2 + b"VP8L" + b"\0" * 40


@pytest.mark.parametrize("kind", ["png", "bmp", "hdr", "tif", "webp"])
def test_a_small_file_that_claims_to_be_a_huge_picture_is_refused_by_its_header(tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    path.write_bytes(bomb(kind, 60_000))
    for read in (read_image, StrokeTexture.open, lambda path: open_background(str(path), 8, 8)):
        refuse(read, path, HUGE)


def test_a_huge_jpeg_and_exr_are_refused_by_their_headers(tmp_path):
    path = write_raw(tmp_path / "a.jpg", np.zeros((16, 16, 3), np.uint8))
    content, side = bytearray(path.read_bytes()), struct.pack(">HH", 60_000, 60_000)
    place = content.index(b"\xff\xc0") + 5
    content[place : place + 4] = side
    path.write_bytes(content)
    refuse(read_image, path, HUGE)
    path = write_raw(tmp_path / "a.exr", np.zeros((16, 16, 3), np.float32))
    content = bytearray(path.read_bytes())
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        place = content.index(name) + len(name) + 4
        content[place : place + 16] = struct.pack("<4i", 0, 0, 59_999, 59_999)
    path.write_bytes(content)
    refuse(read_image, path, HUGE)


def test_a_picture_of_many_channels_is_refused_by_what_it_would_take(tmp_path, monkeypatch):
    path = write_raw(tmp_path / "a.tif", np.zeros((16, 16, 9), np.uint8))
    assert read_image(path).shape == (16, 16, 4)
    monkeypatch.setattr(images, "MAX_PIXELS", 500)
    refuse(read_image, path, "holds 9 channels in 16x16 pixels and tiles of 0x0, which is too much")


def test_tiles_far_larger_than_their_picture_are_refused(tmp_path):
    path = tmp_path / "a.tif"
    tags = ((256, 4, 9), (257, 4, 9), (258, 3, 8), (259, 3, 1), (262, 3, 1))
    tags += ((322, 4, 1 << 16), (323, 4, 1 << 16), (324, 4, 8), (325, 4, 9))
    entries = b"".join(struct.pack("<HHII", tag, form, 1, value) for tag, form, value in tags)
    path.write_bytes(struct.pack("<2sHIH", b"II", 42, 8, len(tags)) + entries + b"\0" * 99)
    refuse(read_image, path, "tiles of 65536x65536, which is too much; save it|cannot be read as a picture")


def test_a_picture_that_is_only_depth_is_refused(tmp_path):
    spec = OpenImageIO.ImageSpec(4, 4, 1, "float")
    spec.channelnames = ("Z",)
    out = OpenImageIO.ImageOutput.create("openexr")
    assert out.open(str(tmp_path / "a.exr"), spec)
    assert out.write_image(np.zeros((4, 4, 1), np.float32))
    out.close()
    refuse(read_image, tmp_path / "a.exr", "holds no colours, only alpha or depth")


def test_a_chain_of_directories_is_not_followed(tmp_path):
    (tmp_path / "a.tif").write_bytes(many_directories(20_000))
    assert read_image(tmp_path / "a.tif").shape == (1, 1, 1)


@pytest.mark.parametrize("marker", [0xC0, 0xC2])
@pytest.mark.parametrize("between", [b"", b"junk\xff", b"\xff\xff", b"\xff\xfe\0\x06\xff\xda\xff\xc0"])
def test_a_jpeg_is_refused_by_its_size_before_a_decoder_sees_it(tmp_path, monkeypatch, marker, between):
    # A progressive one takes two bytes for each pixel as soon as it is opened.
    frame = bytes([0xFF, marker]) + struct.pack(">HBHHB3B", 11, 8, 65500, 65500, 1, 1, 0x11, 0)
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff\xd0" + between + frame + b"\xff\xda" + bytes(20))
    monkeypatch.setattr("OpenImageIO.ImageInput.open", lambda *_: pytest.fail("a decoder saw it"))
    refuse(read_image, tmp_path / "a.jpg", "must have at most 33554432 pixels, got 65500x65500")


def test_a_jpeg_of_very_many_segments_is_refused(tmp_path):
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8" + b"\xff\xfe\0\x02" * 20_000)
    refuse(read_image, tmp_path / "a.jpg", "states no size in its first 10000 segments")


@pytest.mark.parametrize("progressive", [0, 1])
def test_the_size_of_a_jpeg_is_found_where_its_writer_put_it(tmp_path, progressive):
    path = write_raw(tmp_path / "a.jpg", np.zeros((64, 48, 3), np.uint8), **{"jpeg:progressive": progressive})
    assert read_image(path).shape == (64, 48, 3)
    refuse(partial(read_image, max_pixels=64 * 48 - 1), path, "must have at most 3071 pixels, got 48x64")


def test_a_jpeg_of_a_thousand_scans_is_refused(tmp_path):
    path = write_raw(tmp_path / "a.jpg", np.zeros((64, 64, 3), np.uint8), **{"jpeg:progressive": 1})
    content = path.read_bytes()
    last = content[content.rindex(b"\xff\xda") : -2]
    assert read_image(path).shape == (64, 64, 3)
    path.write_bytes(content[:-2] + last * 1000 + content[-2:])
    refuse(read_image, path, "must be stored in at most 100 scans, got 10[0-9]*; save it again as a plain")


@pytest.mark.parametrize("name", ["a.tga", "a", "a.dpx", "a.PNG", "a.png.null"])
def test_the_content_of_a_picture_chooses_its_decoder(tmp_path, name):
    content = png(2, 2, 8, 0, b"\0\x10\x20\0\x30\x40")
    (tmp_path / name).write_bytes(content)
    assert read_image(tmp_path / name).shape == (2, 2, 1)


@pytest.mark.parametrize("name", ["a.gif", "a.tga", "a.null", "a.dpx", "a.psd", "a.term"])
def test_other_formats_of_the_decoder_library_are_not_tried(tmp_path, name):
    (tmp_path / name).write_bytes(b"GIF89a" + b"\0" * 100)
    refuse(read_image, tmp_path / name, r"is not PNG, JPEG, TIFF, .*Radiance HDR\); convert it to PNG")


def test_a_line_of_pixels_is_a_stroke_and_a_background(tmp_path):
    rows = zlib.decompress(
        zlib.compress(b"".join(b"\0" + bytes([value]) for value in [9] * 9 + [200] * 40_000))
    )
    (tmp_path / "a.png").write_bytes(png(1, 40_009, 8, 0, rows))
    assert StrokeTexture.open(tmp_path / "a.png").coverage.shape[0] <= 256
    ground = open_background(str(tmp_path / "a.png"), 64, 48)
    assert ground.shape == (48, 64, 3)
    np.testing.assert_allclose(ground, 200 / 255, atol=1e-6)


def test_a_background_far_larger_than_the_picture_keeps_its_colours(tmp_path):
    pixels = np.zeros((400, 500, 3), np.uint8)
    pixels[:, :250, 0], pixels[:200, :, 1] = 255, 255
    ground = open_background(str(write_raw(tmp_path / "a.png", pixels)), 10, 8)
    assert ground[1, 1].tolist() == pytest.approx([1, 1, 0], abs=0.01)
    assert ground[6, 8].tolist() == pytest.approx([0, 0, 0], abs=0.01)
    assert ground.mean() == pytest.approx(1 / 3, abs=0.01)
