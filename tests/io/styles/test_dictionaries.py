"""The marks of a painting in a style file: they survive; hostile ones are refused undecoded."""

import base64
import json
import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.packed import pack
from brushgs.formats.styles import read_style
from brushgs.formats.styles_write import write_style
from brushgs.values.style import MarkDictionary, MarkSpectrum
from tests.io.styles import example
from tests.kit.for_each import for_each


def with_dictionary(num=21, height=6, width=10):
    g = np.random.default_rng(0)
    texels = g.integers(0, 256, (num, height, width, 4)).astype(np.uint8)
    colors = g.uniform(0, 0.5, (num, 3)).astype(np.float16).astype(np.float32)
    found = MarkDictionary(colors, np.full(num, 0.03125, np.float32), texels)
    style = example.painting()
    coherent = MarkSpectrum(0.75, (0.01, 0.02, 0.04), (0.004, 0.005, 0.006))
    return replace(style, marks=replace(style.marks, dictionary=found, coherent=coherent))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "marks.style"


def edited(path, change):
    write_style(with_dictionary(), path)
    value = json.loads(path.read_text())
    change(value["marks"])
    path.write_text(json.dumps(value))
    return path


def test_a_dictionary_survives_writing_and_reading(path):
    style = with_dictionary()
    write_style(style, path)
    read = read_style(path).marks
    for name in ("colors", "shares", "texels"):
        np.testing.assert_array_equal(getattr(read.dictionary, name), getattr(style.marks.dictionary, name))
    assert read.coherent == style.marks.coherent
    assert read.incoherent is None


def png_of(width, height, data=b""):
    """A PNG whose header promises so many pixels."""

    def chunk(kind, content):
        return (
            struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    whole = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    return base64.b64encode(whole).decode()


def bomb(marks):
    marks["dictionary"]["atlas"]["data"] = png_of(40_000, 40_000, zlib.compress(bytes(1000)))


def halve(marks):
    """The true atlas, cut off in the middle."""
    whole = base64.b64decode(marks["dictionary"]["atlas"]["data"])
    marks["dictionary"]["atlas"]["data"] = base64.b64encode(whole[: len(whole) // 2]).decode()


CASES = {
    "a bomb": (bomb, "pixels, got one of 40000x40000"),
    "a little too large": (
        lambda m: m["dictionary"]["atlas"].update(data=png_of(2001, 2000, zlib.compress(bytes(1000)))),
        "pixels, got one of 2001x2000",
    ),
    "no base64": (lambda m: m["dictionary"]["atlas"].update(data="iVBOR?*"), "dictionary.atlas.data"),
    "half of a picture": (halve, "dictionary.atlas.data"),
    "more marks than the picture has": (
        lambda m: m["dictionary"].update(
            colors=pack(np.zeros((40, 3)), "float16"), shares=pack(np.zeros(40), "float16")
        ),
        "160x18 pixels, got 160x12",
    ),
    "cut off": (lambda m: m["dictionary"]["atlas"].update(data=png_of(160, 12)), "dictionary.atlas"),
    "another size": (
        lambda m: m["dictionary"]["atlas"].update(data=png_of(8, 8, zlib.compress(bytes(33 * 8)))),
        "160x12 pixels",
    ),
    "no picture": (lambda m: m["dictionary"]["atlas"].update(data="AAAA"), "got another file"),
    "too many marks": (
        lambda m: m["dictionary"].update(
            colors=pack(np.zeros((600, 3)), "float16"), shares=pack(np.zeros(600), "float16")
        ),
        "at most 512 marks",
    ),
    "too many texels": (
        lambda m: m["dictionary"].update(
            size=[128, 128], colors=pack(np.zeros((500, 3)), "float16"), shares=pack(np.zeros(500), "float16")
        ),
        "4000000 pixels",
    ),
    "a side of nothing": (lambda m: m["dictionary"].update(size=[0, 6]), "size"),
    "shares of others": (lambda m: m["dictionary"].update(shares=[0.5]), "marks.dictionary.shares"),
    "no number": (lambda m: m["dictionary"].update(colors=[[float("nan")] * 3]), "colors"),
    "an unknown field": (lambda m: m["dictionary"].update(sizes=3), "sizes"),
    "sizes that fall": (lambda m: m["coherent"].update(lengths=[0.3, 0.2, 0.1]), "ascending"),
    "a size beyond": (lambda m: m["coherent"].update(widths=[0.3, 0.2, 7]), "widths"),
}


@for_each("case", CASES)
def test_hostile_ones_are_refused_by_name(path, case):
    change, words = CASES[case]
    hostile = edited(path, change)
    with pytest.raises(SceneError) as error:
        read_style(hostile)
    sentence = str(error.value)
    assert words in sentence
    assert str(hostile) in sentence
    assert "\n" not in sentence
    assert ". " not in sentence.removeprefix(str(hostile))  # one sentence
