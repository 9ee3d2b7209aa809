"""Files made to harm: each gives one sentence, at once and without the memory it asks for.

The fuzzer in `tests/fuzz` looks for more of them; what it and a reading of the code found is kept here.
"""

import json
import os
import struct
from functools import partial

import numpy as np
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
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

HEAD = b"ply\nformat binary_little_endian 1.0\n"


def manifest(path):
    return Manifest.read(NumberedFiles(path.parent, path.name.removeprefix(".").removesuffix(".json")))


def background(path):
    return open_background(str(path), 8, 8)


READERS = {
    "scene": ("a.ply", load),
    "cameras": ("a.json", load_cameras),
    "COLMAP": ("images.bin", load_cameras),
    "picture": ("a.png", read_image),
    "stroke": ("a.png", StrokeTexture.open),
    "background": ("a.png", background),
    "manifest": (".%05d.png.json", manifest),
}
NO_FILE = "is a pipe or device|neither a file nor a|must be white, black|Too many levels|no such file"


@for_each("name", READERS)
def test_what_is_no_plain_file_is_not_read(name, tmp_path):
    folder = tmp_path / name
    folder.mkdir()
    if name == "COLMAP":
        test_colmap.write(folder, "bin")
    file, read = READERS[name]
    path = folder / file
    for target in (None, "/dev/zero", "/dev/stdin", file):  # a pipe, devices, a link to itself
        path.unlink(missing_ok=True)
        path.symlink_to(target) if target else os.mkfifo(path)
        with pytest.raises(ValueError, match=NO_FILE) as caught:
            read(path)
        assert str(folder) in str(caught.value)
        assert str(caught.value).isprintable()


@for_each("name", ["a\0b", "a" * 300])
@for_each("read", [load, load_cameras, read_image, StrokeTexture.open])
def test_a_name_that_no_file_can_have_is_refused(tmp_path, name, read):
    with pytest.raises(SceneError, match=r"no such|File name too long|neither a file"):
        read(tmp_path / name)


def test_a_file_larger_than_its_reader_holds_is_not_read(tmp_path):
    for name, limit, read in (("a.json", 32, load_cameras), (".%05d.png.json", 8, manifest)):
        with (tmp_path / name).open("wb") as file:
            file.truncate((limit << 20) + 1)  # zeros that take no place on the disk
        refuse(tmp_path / name, f"a file must have at most {limit} MiB, got {limit}; split it", read)


# ---- scenes


@for_each(
    "lines, sentence",
    [
        (b"comment up axis" + b" " * 1_000_000 + b"z\n", "no element 'vertex' among: none"),
        (b"element \x1b[2J" + b"x" * 100_000 + b" 1\n", r"no element 'vertex' among: \?\[2Jxxx"),
        (b"property uchar p%d\n", "must name at most 1000 properties of an element"),
        (b"property list uchar int p%d\n", "must name at most 1000 list properties"),
        (b"element e%d 0\n", "must name at most 100 elements"),
    ],
)
def test_a_header_without_measure_is_refused(tmp_path, lines, sentence):
    if b"%d" in lines:
        lines = b"element vertex 1\n" + b"".join(lines % number for number in range(20_000))
    refuse_bytes(tmp_path / "a.ply", HEAD + lines + b"end_header\n", sentence)


def test_a_line_of_text_without_end_is_refused(tmp_path):
    path = write_scene(tmp_path / "a.ply", scene_columns(50), "ascii")
    path.write_bytes(path.read_bytes() + b"1 " * 200_000)
    assert len(load(path)) == 50  # what follows the rows is not looked at
    content = path.read_bytes().replace(b"vertex 50", b"vertex 51")
    refuse_bytes(path, content, "has a line of more than 65536 bytes among its rows; it is damaged: export")


def test_rows_of_bytes_must_not_fill_the_memory(tmp_path):
    packed = dict.fromkeys(test_compressed_ply.PACKED, np.zeros(1))
    ranges = [f"{end}_{axis}" for end in ("min", "max") for axis in (*"xyz", "scale_x", "scale_y", "scale_z")]
    chunk = element_bytes("chunk", dict.fromkeys(ranges, np.zeros(1)), types=dict.fromkeys(ranges, "char"))
    vertex = element_bytes("vertex", packed, types=dict.fromkeys(packed, "uchar"))
    path = write_ply_file(tmp_path / "a.ply", [chunk, vertex])
    content = path.read_bytes().replace(b"vertex 1", b"vertex 25600000").replace(b"chunk 1", b"chunk 100000")
    path.write_bytes(content)
    os.truncate(path, 4 * 25_600_000 + 12 * 100_000 + len(content))
    refuse(path, "25600000 Gaussians take 1367 MiB in memory and 98 MiB in the file, too little")
    elements = [(b"element chunk 999999999999999999\n", b""), vertex]
    refuse(write_ply_file(tmp_path / "a.ply", elements), "no property 'min_x' in element 'chunk'")


# ---- cameras


@for_each("field", ["position", "fx"])
@for_each("depth", [10, 900, 985, 1006, 100_000])
def test_json_that_goes_deep_is_refused_at_every_depth(tmp_path, field, depth):
    frame = json.dumps([test_cameras.INRIA | {field: "HERE"}])
    content = frame.replace('"HERE"', "[" * depth + "]" * depth).encode()
    refuse_bytes(tmp_path / "a.json", content, rf"\.{field}(\[0\])* must|nested too deeply", load_cameras)


@for_each("unit", [b"[],", b'{"a":1},'])
def test_json_that_swells_is_refused_before_it_is_parsed(tmp_path, unit):
    content = b"[" + unit * (12_000_000 // len(unit)) + b"0]"
    sentence = "would take [0-9]+ MiB of memory for 11.4 MiB of text; split"
    refuse_bytes(tmp_path / "a.json", content, sentence, load_cameras)


def test_names_in_any_script_are_no_trap(tmp_path):
    path, frame = tmp_path / "cameras.json", test_cameras.INRIA | {"img_name": "Стул 椅子 🪑" * 5000}
    path.write_text(json.dumps([frame], ensure_ascii=False))
    assert len(load_cameras(path)) == 1
    content = path.read_bytes()
    refuse_bytes(path, content[:-3] + b"\xff" + content[-3:], "is not JSON .*utf-8", load_cameras)


INRIA, PATH, KEY = test_cameras.INRIA, test_cameras.CAMERA_PATH, test_cameras.KEYFRAME


@for_each(
    "content, sentence",
    [
        ([INRIA | {"width": 1e99}], "the size must be that of a picture, got more than 1048576"),
        ([INRIA | {"width": 40_000}], "the size must be 1x1 to 32767x32767 pixels, got 40000x480"),
        ([INRIA | {"fx": 5e-324}], "the focal length must be 0.001 to 1e.09 pixels"),
        ([INRIA | {"position": [1e308, 1e308, 0]}], "the position must lie within 1e.15 of"),
        ([INRIA | {"rotation": [[1e200] * 3] * 3}], "must not scale or mirror, got an entry of"),
        (test_cameras.BLENDER | {"camera_angle_x": 5e-324}, "camera_angle_x must be above 1e-06 and below"),
        (PATH | {"seconds": 1e-320}, "seconds must be a number above 1e-06"),
        (PATH | {"keyframes": [KEY | {"matrix": "[" * 10**5}]}, r"\.matrix must be 4x4"),
        (test_cameras.NERFSTUDIO | {"cx": 1e300}, "the principal point must lie within 1e.09 pixels"),
        ([INRIA | {"fx": "x" * 10**6}], r'\.fx must be a number above 0, got "xxx'),
        ([INRIA | {"fx": {"a": [1]}}], r'\.fx must be a number above 0, got {"a": ...}'),
    ],
)
def test_numbers_no_camera_has_are_refused(tmp_path, content, sentence):
    refuse_bytes(tmp_path / "cameras.json", json.dumps(content).encode(), sentence, load_cameras)


def test_a_camera_model_that_is_no_name_is_not_quoted(tmp_path):
    content = test_cameras.NERFSTUDIO | {"camera_model": ["\x1b"] * 1000, "k1": 0.5}
    content["frames"] = [test_cameras.NERFSTUDIO["frames"][0] | {"camera_model": "PINHOLE"}]
    with pytest.warns(SceneWarning, match=r"distortion of camera model PINHOLE was ignored \(k1 = 0.5\)"):
        load_cameras(test_cameras.write(tmp_path, content))


@for_each("form", test_colmap.FORMS)
def test_sizes_poses_and_lenses_no_camera_has_are_refused(tmp_path, form):
    def fails(sentence, **model):
        refuse(test_colmap.write(tmp_path / form, form, **model), sentence, load_cameras)

    fails("the position must lie within", images=[test_colmap.Image(translation=(1e300, 0, 0))])
    fails("the focal length must be 0.001", cameras=[(1, "PINHOLE", 64, 48, (1e-300, 5.0, 3.0, 2.0))])
    for width in (2**20 + 1, 2**63, *([10**400, 10**4000] if form == "txt" else [])):
        lens = (1, "PINHOLE", width, 9, (5.0, 5.0, 3.0, 2.0))
        fails("the size must be that of a picture", cameras=[lens])


def test_more_views_than_any_capture_has_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("brushgs.formats.cameras.colmap._MAX_ENTRIES", 3)
    images = [test_colmap.Image(f"{i}.jpg") for i in range(4)]
    assert len(load_cameras(test_colmap.write(tmp_path, "bin", images=images[:3]))) == 3
    refuse(test_colmap.write(tmp_path, "bin", images=images), "must hold at most 3 entries", load_cameras)


def test_a_line_of_a_model_without_end_is_refused_and_points_may_be_many(tmp_path):
    folder = test_colmap.write(tmp_path / "a", "txt", images=[test_colmap.IMAGE, test_colmap.Image("b.jpg")])
    first, points = (folder / "images.txt").read_text().split("a.jpg\n")[0], "1.5 2.5 7 " * 90_000
    (folder / "images.txt").write_text(f"{first}a.jpg\n{points}\n2 1 0 0 0 1 2 3 1 b.jpg\n\n")
    assert len(load_cameras(folder)) == 2
    (folder / "images.txt").write_text(f"{first}a.jpg\n\n{points}\n")
    refuse(folder, "line 6: must have at most 131072 bytes; export the model as text again", load_cameras)


# ---- pictures


# Where a decoder has a rule of its own, it may be first.
HUGE = r"must have at most 33554432 pixels, got 60000x60000; scale it down|cannot be read as a picture \(.*MB"
SIDE = 60_000


def tiff(*tags):
    """Its only directory."""
    entries = b"".join(struct.pack("<HHII", tag, form, 1, value) for tag, form, value in tags)
    return struct.pack("<2sHIH", b"II", 42, 8, len(tags)) + entries + b"\0" * 99


COMMON_TAGS = (258, 3, 8), (259, 3, 1), (262, 3, 1)
BOMBS = {
    "png": png(SIDE, SIDE, 8, 6, b"\0" * 100),
    "bmp": struct.pack("<2sIHHIIiiHHIIiiII", b"BM", 54, 0, 0, 54, 40, SIDE, SIDE, 1, 24, *[0] * 6),
    "hdr": f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {SIDE} +X {SIDE}\n".encode() + b"\0" * 99,
    "tif": tiff((256, 4, SIDE), (257, 4, SIDE), *COMMON_TAGS, (273, 4, 8), (279, 4, 9)),
    "webp": b"RIFF\x1e\0\0\0WEBPVP8X\x0a\0\0\0\x10\0\0\0" + (SIDE - 1).to_bytes(3, "little") * 2 + b"VP8L",
}
BOMBS["webp"] += b"\0" * 40


@for_each("kind", BOMBS)
def test_a_small_file_that_claims_to_be_a_huge_picture_is_refused_by_its_header(tmp_path, kind):
    for read in (read_image, StrokeTexture.open, background):
        refuse_bytes(tmp_path / f"a.{kind}", BOMBS[kind], HUGE, read)


def test_a_huge_exr_is_refused_by_its_header(tmp_path):
    path = write_raw(tmp_path / "a.exr", np.zeros((16, 16, 3), np.float32))
    content = bytearray(path.read_bytes())
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        place = content.index(name) + len(name) + 4
        content[place : place + 16] = struct.pack("<4i", 0, 0, SIDE - 1, SIDE - 1)
    refuse_bytes(path, content, HUGE, read_image)


def test_channels_and_tiles_are_refused_by_what_they_would_take(tmp_path, monkeypatch):
    path = write_raw(tmp_path / "a.tif", np.zeros((16, 16, 9), np.uint8))
    assert read_image(path).shape == (16, 16, 4)
    monkeypatch.setattr(images, "MAX_PIXELS", 500)
    refuse(path, "holds 9 channels in 16x16 pixels and tiles of 0x0, which is too much", read_image)
    tiles = (322, 4, 1 << 16), (323, 4, 1 << 16), (324, 4, 8), (325, 4, 9)
    content = tiff((256, 4, 9), (257, 4, 9), *COMMON_TAGS, *tiles)
    refuse_bytes(path, content, "tiles of 65536x65536, which is too much|cannot be read as", read_image)


def test_a_chain_of_directories_is_not_followed(tmp_path):
    (tmp_path / "a.tif").write_bytes(many_directories(20_000))
    assert read_image(tmp_path / "a.tif").shape == (1, 1, 1)


@for_each("marker", [0xC0, 0xC2])
@for_each("between", [b"", b"junk\xff", b"\xff\xff", b"\xff\xfe\0\x06\xff\xda\xff\xc0"])
def test_a_jpeg_is_refused_by_its_size_before_a_decoder_sees_it(tmp_path, marker, between):
    # A progressive one takes two bytes for each pixel as soon as it is opened.
    frame = bytes([0xFF, marker]) + struct.pack(">HBHHB3B", 11, 8, 65500, 65500, 1, 1, 0x11, 0)
    content = b"\xff\xd8\xff\xd0" + between + frame + b"\xff\xda" + bytes(20)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("OpenImageIO.ImageInput.open", lambda *_: pytest.fail("a decoder saw it"))
        sentence = "must have at most 33554432 pixels, got 65500x65500"
        refuse_bytes(tmp_path / "a.jpg", content, sentence, read_image)


def test_a_jpeg_of_very_many_segments_or_scans_is_refused(tmp_path):
    path = tmp_path / "a.jpg"
    content = b"\xff\xd8" + b"\xff\xfe\0\x02" * 20_000
    refuse_bytes(path, content, "states no size in its first 10000 segments", read_image)
    write_raw(path, np.zeros((64, 48, 3), np.uint8), **{"jpeg:progressive": 1})
    assert read_image(path).shape == (64, 48, 3)
    smaller = partial(read_image, max_pixels=64 * 48 - 1)
    refuse(path, "must have at most 3071 pixels, got 48x64", smaller)
    content = path.read_bytes()
    scans = content[content.rindex(b"\xff\xda") : -2] * 1000
    sentence = "must be stored in at most 100 scans, got 10[0-9]*; save it again as a plain"
    refuse_bytes(path, content[:-2] + scans + content[-2:], sentence, read_image)


def test_the_content_of_a_picture_chooses_its_decoder(tmp_path):
    for name in ("a.tga", "a", "a.PNG", "a.png.null"):
        (tmp_path / name).write_bytes(png(2, 2, 8, 0, b"\0\x10\x20\0\x30\x40"))
        assert read_image(tmp_path / name).shape == (2, 2, 1)
    for name in ("a.gif", "a.tga", "a.null", "a.psd", "a.term"):  # which the library would decode
        sentence = r"is not PNG, JPEG, TIFF, .*Radiance HDR\); convert it to PNG"
        refuse_bytes(tmp_path / name, b"GIF89a" + b"\0" * 100, sentence, read_image)


def test_pictures_far_larger_than_strokes_and_backgrounds_are_scaled_down(tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(png(1, 40_009, 8, 0, b"".join(bytes([0, value]) for value in [9] * 9 + [200] * 40_000)))
    assert StrokeTexture.open(path).coverage.shape[0] <= 256
    np.testing.assert_allclose(background(path), np.full((8, 8, 3), 200 / 255), atol=1e-6)
    pixels = np.zeros((400, 500, 3), np.uint8)
    pixels[:, :250, 0], pixels[:200, :, 1] = 255, 255
    ground = background(write_raw(path, pixels))
    assert ground[1, 1].tolist() == pytest.approx([1, 1, 0], abs=0.01)
    assert ground[6, 6].tolist() == pytest.approx([0, 0, 0], abs=0.01)
    assert ground.mean() == pytest.approx(1 / 3, abs=0.01)
