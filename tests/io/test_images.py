import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import OpenImageIO
import pytest

import brushgs as bg
from brushgs import Frame, SceneError
from brushgs.core.threads import at_most
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.pictures.oiio import Strips, pixels_of
from brushgs.formats.registry import function_of, holds_depth
from brushgs.formats.table import FORMATS, VIDEO_CODECS
from brushgs.options.choices import Codec
from brushgs.values.colors import srgb_from_linear
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes


def make_frame(height: int = 5, width: int = 7, *, depth: bool = False) -> Frame:
    """A frame with every kind of alpha: none, full and between."""
    rng = np.random.default_rng(7)
    alpha = rng.random((height, width)).astype(np.float32)
    alpha[0], alpha[1] = 0, 1
    rgb = (rng.random((height, width, 3)) * alpha[..., None]).astype(np.float32)
    return Frame(rgb, alpha, 1 + alpha if depth else None)


def straight(frame: Frame) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(frame.rgb / frame.alpha[..., None])


def chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(width: int, height: int, depth: int, kind: int, rows: bytes, extra: bytes = b"") -> bytes:
    """A PNG made by hand; `rows` begin with a filter byte each."""
    head = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
    pixels = chunk(b"IDAT", zlib.compress(rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + extra + pixels + chunk(b"IEND", b"")


# ---- writing


@for_each(("suffix", "largest"), [(".png", 255), (".tif", 65535), (".tiff", 65535)])
def test_a_frame_keeps_its_straight_colors_and_alpha(tmp_path, suffix, largest):
    frame = make_frame()
    write_frame(frame, tmp_path / f"a{suffix}")
    pixels = read_image(tmp_path / f"a{suffix}")
    assert pixels.shape == (5, 7, 4)
    np.testing.assert_allclose(pixels[..., 3], frame.alpha, atol=0.5001 / largest)
    np.testing.assert_allclose(pixels[..., :3], straight(frame), atol=0.5001 / largest)


@for_each("suffix", [".png", ".tif"])
@for_each("background", [None, (0.2, 0.4, 0.6)])
def test_sixteen_bits_are_rounded_once_from_float(tmp_path, suffix, background):
    values = np.linspace(0.3, 0.31, 5 * 7 * 3, dtype=np.float32).reshape(5, 7, 3)  # 3 levels of 8 bits
    frame = Frame(values, np.ones((5, 7), np.float32))
    path = tmp_path / f"a{suffix}"
    write_frame(frame, path, background, bits=16)
    stored = OpenImageIO.ImageInput.open(str(path))
    assert stored.spec().format == OpenImageIO.UINT16
    pixels = stored.read_image(0, 0, 0, stored.spec().nchannels, OpenImageIO.UINT16)
    np.testing.assert_array_equal(pixels[..., :3], np.floor(values.astype(float) * 65535 + 0.5))
    assert len(np.unique(pixels[..., :3])) == values.size


@for_each("suffix", [".png", ".tif", ".webp"])
def test_a_frame_on_a_background_has_no_alpha(tmp_path, suffix):
    frame = make_frame(depth=True)
    ground = np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)
    for background in ((1.0, 0.5, 0.0), ground):
        write_frame(frame, tmp_path / f"a{suffix}", background=background)
        pixels = read_image(tmp_path / f"a{suffix}")
        assert pixels.shape == (5, 7, 3)
        np.testing.assert_allclose(pixels, frame.over(background), atol=0.5001 / 255)


def test_colors_beyond_white_survive_in_exr_and_are_clipped_elsewhere(tmp_path):
    frame = Frame(np.full((2, 2, 3), 1.5, np.float32), np.ones((2, 2), np.float32))
    write_frame(frame, tmp_path / "a.png")
    assert read_image(tmp_path / "a.png").max() == 1
    write_frame(frame, tmp_path / "a.exr")
    source = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr"))
    expected = ((1.5 + 0.055) / 1.055) ** 2.4
    assert source.read_image(OpenImageIO.FLOAT)[0, 0, 0] == pytest.approx(expected, rel=2**-11)


def test_a_jpeg_holds_the_picture_on_its_background_with_full_color_resolution(tmp_path):
    height, width = 48, 64
    y, x = np.mgrid[:height, :width] / height
    rgb = np.stack([0.5 + 0.4 * np.sin(9 * x), 0.5 + 0.4 * np.cos(7 * y), x * y / 2], -1).astype(np.float32)
    alpha = (x < 0.9).astype(np.float32)
    frame = Frame(rgb * alpha[..., None], alpha)
    for name in ("a", "b"):
        write_frame(frame, tmp_path / f"{name}.jpg", background=(0.0, 0.0, 1.0))
    content = (tmp_path / "a.jpg").read_bytes()
    assert (tmp_path / "b.jpg").read_bytes() == content
    at = content.index(b"\xff\xc0")  # header of a baseline JPEG: size, then a sampling for each channel
    assert content[at + 5 : at + 10] == bytes([0, height, 0, width, 3])
    assert [content[at + 11 + 3 * channel] for channel in range(3)] == [0x11] * 3  # 4:4:4
    shown = read_image(tmp_path / "a.jpg")
    assert shown.shape == (height, width, 3)
    assert np.sqrt(np.mean((shown - frame.over((0.0, 0.0, 1.0))) ** 2)) < 2.5 / 255


@for_each(
    "name, options, sentence",
    [
        ("a.bmp", {}, r"must end in one of \.png, \.jpg, .*, \.exr, \.webp, \.avif, got '.*a\.bmp'; change"),
        ("a.jpg", {}, r"a JPEG holds no transparency, got '.*a\.jpg'; give a background"),
        ("a.jpg", {"bits": 16, "background": (1, 1, 1)}, r"bits must be 8 for \.jpg, got 16"),
        ("a.png", {"bits": 10}, r"bits must be 8 or 16 for \.png, got 10"),
        ("a.png", {"background": np.zeros((2, 2, 3))}, r"shape \[3\] or \[5, 7, 3\], got \[2, 2, 3\]"),
    ],
)
def test_what_a_format_does_not_hold_is_refused_and_nothing_is_written(tmp_path, name, options, sentence):
    with pytest.raises(ValueError, match=sentence):
        write_frame(make_frame(), tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_save_puts_a_frame_on_a_background(tmp_path):
    frame = make_frame()
    bg.save(frame, tmp_path / "a.png", background="#336699")
    write_frame(frame, tmp_path / "b.png", background=(0.2, 0.4, 0.6))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    bg.save(frame, tmp_path / "c.png", background="transparent")
    assert read_image(tmp_path / "c.png").shape[2] == 4
    bg.save(frame, tmp_path / "a.jpg")
    assert read_image(tmp_path / "a.jpg")[0].min() > 0.9  # nothing is painted there: white
    with pytest.raises(ValueError, match="mauvish"):
        bg.save(frame, tmp_path / "d.png", background="mauvish")


@pytest.mark.parametrize(("suffix", "is_opened"), [("tif", False), ("exr", True)])
def test_a_failed_write_is_reported_and_leaves_nothing(tmp_path, monkeypatch, suffix, is_opened):
    broken = SimpleNamespace(open=lambda *_: is_opened, write_scanlines=lambda *_: False, close=lambda: True)
    broken.geterror = lambda: "disk full\nmore"
    monkeypatch.setattr(OpenImageIO.ImageOutput, "create", lambda name: broken)
    with pytest.raises(SceneError, match=rf"a\.{suffix}: cannot be written \(disk full\); check the disk"):
        write_frame(make_frame(), tmp_path / f"a.{suffix}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit of a file's size")
def test_a_png_that_the_disk_cannot_hold_is_reported_and_leaves_nothing(tmp_path, monkeypatch):
    import resource

    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # it would be cut off too, and stay so
    frame = noise(200, 300)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, limits[1]))
    try:
        with pytest.raises(SceneError, match=r"a\.png: cannot be written .*; check the disk"):
            write_frame(frame, tmp_path / "a.png", background=(0, 0, 0))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []


def noise(height: int, width: int) -> Frame:
    values = np.random.default_rng(height).random((height, width, 4), np.float32)
    return Frame(values[..., :3] * values[..., 3:], values[..., 3])


@for_each(("height", "width"), [(1, 1), (3, 1), (1, 5), (700, 900)])  # the last in several bands
@for_each("bits", [8, 16])
@for_each("background", [None, (0.2, 0.4, 0.6)])
def test_bands_of_a_png_are_one_stream_of_the_same_pixels(tmp_path, height, width, bits, background):
    frame = noise(height, width)
    path = tmp_path / "a.png"
    write_frame(frame, path, background=background, bits=bits)
    expected = pixels_of(frame, background, bits)
    np.testing.assert_array_equal(np.rint(read_image(path) * np.float32(2**bits - 1)), expected)
    stream = b"".join(content for kind, content in chunks(path) if kind == b"IDAT")
    assert len(zlib.decompress(stream)) == height * (1 + expected[0].nbytes)  # checks the sum over all bands
    with at_most(1):
        write_frame(frame, tmp_path / "b.png", background=background, bits=bits)
    assert (tmp_path / "b.png").read_bytes() == path.read_bytes()
    half = height // 2
    parts = [Frame(frame.rgb[rows], frame.alpha[rows]) for rows in (slice(half), slice(half, None))]
    strips = Strips(height, width, lambda: iter(parts[not half :]))
    write_frame(strips, tmp_path / "c.png", background=background, bits=bits)
    np.testing.assert_array_equal(read_image(tmp_path / "c.png"), read_image(path))


def chunks(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of each chunk of a PNG; their checksums hold."""
    content, start = path.read_bytes(), 8
    while start < len(content):
        end = start + 8 + int.from_bytes(content[start : start + 4], "big")
        assert zlib.crc32(content[start + 4 : end]) == int.from_bytes(content[end : end + 4], "big")
        yield content[start + 4 : start + 8], content[start + 8 : end]
        start = end + 4


# ---- reading


@for_each(("kind", "num_channels"), [(0, 1), (4, 2), (2, 3), (6, 4)])  # grey, RGB, with and without alpha
@for_each("depth", [8, 16])
def test_png_of_every_kind_and_depth(tmp_path, kind, num_channels, depth):
    largest = 2**depth - 1
    values = np.random.default_rng(3).integers(0, largest + 1, (3, 5, num_channels))
    rows = b"".join(b"\0" + row.astype(">u2" if depth == 16 else "u1").tobytes() for row in values)
    (tmp_path / "a.png").write_bytes(png(5, 3, depth, kind, rows))
    pixels = read_image(tmp_path / "a.png")
    assert pixels.shape == (3, 5, num_channels)
    np.testing.assert_allclose(pixels, values / largest, atol=1e-6)


def write_raw(path: Path, pixels: np.ndarray, *, names="", tile=0, origin=(0, 0), **attributes) -> Path:
    """A file written by OpenImageIO with its own defaults; of its channels, the side of tiles, its corner."""
    height, width, num_channels = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, num_channels, pixels.dtype.name.replace("float32", "float"))
    spec.channelnames = tuple(names[:num_channels]) or spec.channelnames
    spec.tile_width = spec.tile_height = tile
    spec.x, spec.y = origin
    for name, value in attributes.items():
        spec.attribute(name, value)
    out = OpenImageIO.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    is_written = out.write_tiles(0, width, 0, height, 0, 1, pixels) if tile else out.write_image(pixels)
    assert is_written, out.geterror()
    assert out.close(), out.geterror()
    return path


def test_jpeg_is_read_and_turned_upright(tmp_path):
    pixels = np.zeros((16, 32, 3), np.uint8)
    pixels[:, :16] = 255  # the left half is white
    upright = {1: "left", 3: "right", 6: "top", 8: "bottom", 2: "right", 5: "top"}
    for orientation, side in upright.items():
        image = read_image(write_raw(tmp_path / "a.jpg", pixels, Orientation=orientation))
        assert image.shape == ((32, 16, 3) if side in ("top", "bottom") else (16, 32, 3)), orientation
        height, width, _ = image.shape
        white = {"left": image[:, : width // 2], "right": image[:, width // 2 :]}
        white |= {"top": image[: height // 2], "bottom": image[height // 2 :]}
        assert white[side].mean() > 0.95, orientation
        assert image.mean() < 0.55


def test_pictures_that_cannot_be_used_are_refused(tmp_path):
    noise = np.random.default_rng(4).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    content = write_raw(tmp_path / "a.png", noise).read_bytes()
    half = content[: len(content) // 2]
    refuse_bytes(tmp_path / "a.png", half, r"is damaged \(.*\); get it again", read_image)
    write_raw(tmp_path / "a.exr", np.full((2, 2, 3), np.nan, np.float32))
    refuse(tmp_path / "a.exr", "holds NaN or infinity; write it again with finite values", read_image)
    pixels = np.full((2, 2, 4), 0.25, np.float32)
    pixels[..., 3] = 0.5  # associated alpha is taken out
    write_raw(tmp_path / "a.tif", pixels)
    np.testing.assert_allclose(read_image(tmp_path / "a.tif")[0, 0], [0.5] * 4, atol=1e-6)


# ---- linear light


@for_each(("origin", "tile"), [((0, 0), 0), ((5, 200), 0), ((-3, -7), 0), ((0, 0), 16)])
def test_a_picture_is_whole_wherever_its_pixels_begin(tmp_path, origin, tile):
    pixels = np.random.default_rng(3).random((150, 40, 3)).astype(np.float32)
    write_raw(tmp_path / "a.exr", pixels, tile=tile, origin=origin)
    np.testing.assert_allclose(read_image(tmp_path / "a.exr"), srgb_from_linear(pixels), atol=1e-6)


def test_every_format_of_the_tables_has_its_modules():
    for row in FORMATS:
        for reference in (row.read, row.write):
            assert not reference or callable(function_of(reference))
    for codec in VIDEO_CODECS.values():
        assert callable(function_of(codec.write))
    assert {name for row in FORMATS for name in row.codecs} == set(VIDEO_CODECS)
    assert {*get_args(Codec), "gif"} == set(VIDEO_CODECS)
    assert holds_depth("a.EXR")
    assert not holds_depth("a.png")
