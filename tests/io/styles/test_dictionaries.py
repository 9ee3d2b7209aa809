"""The marks of a painting in a style file: they survive; hostile ones are refused undecoded."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from brushgs.formats.packed import pack
from brushgs.formats.styles import read_style, write_style
from brushgs.values.style import MarkDictionary, MarkSpectrum
from tests.io.styles import example
from tests.io.test_images import png
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse


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


def test_a_dictionary_survives_writing_and_reading(path):
    style = with_dictionary()
    write_style(style, path)
    read = read_style(path).marks
    for name in ("colors", "shares", "texels"):
        np.testing.assert_array_equal(getattr(read.dictionary, name), getattr(style.marks.dictionary, name))
    assert read.coherent == style.marks.coherent
    assert read.incoherent is None


def atlas(data):
    text = data if isinstance(data, str) else base64.b64encode(data).decode()
    return {"dictionary": {"atlas": {"data": text}}}


def png_of(width, height, data=bytes(1000)):
    """A PNG whose header promises so many pixels."""
    return atlas(png(width, height, 8, 6, data))


def rows(count, **fields):
    """Colors and shares of so many marks."""
    shares = pack(np.zeros(count), "float16")
    return {"dictionary": {"colors": pack(np.zeros((count, 3)), "float16"), "shares": shares, **fields}}


CASES = [
    (png_of(40_000, 40_000), "pixels, got one of 40000x40000"),
    (png_of(2001, 2000), "pixels, got one of 2001x2000"),
    (atlas("iVBOR?*"), "dictionary.atlas.data"),
    (rows(40), "160x18 pixels, got 160x12"),
    (png_of(160, 12, b""), "dictionary.atlas"),
    (png_of(8, 8, bytes(33 * 8)), "160x12 pixels"),
    (atlas("AAAA"), "got another file"),
    (rows(600), "at most 512 marks"),
    (rows(500, size=[128, 128]), "4000000 pixels"),
    ({"dictionary": {"size": [0, 6]}}, "size"),
    ({"dictionary": {"shares": [0.5]}}, "marks.dictionary.shares"),
    ({"dictionary": {"colors": [[float("nan")] * 3]}}, "colors"),
    ({"dictionary": {"sizes": 3}}, "sizes"),
    ({"coherent": {"lengths": [0.3, 0.2, 0.1]}}, "ascending"),
    ({"coherent": {"widths": [0.3, 0.2, 7]}}, "widths"),
]


def update(value, changes):
    for key, change in changes.items():
        if isinstance(change, dict) and "shape" not in change:
            update(value[key], change)
        else:
            value[key] = change


@for_each("changes, words", CASES)
def test_hostile_ones_are_refused_by_name(path, changes, words):
    write_style(with_dictionary(), path)
    value = json.loads(path.read_text())
    update(value["marks"], changes)
    path.write_text(json.dumps(value))
    sentence = refuse(path, words, read_style)
    assert ". " not in sentence.removeprefix(str(path))  # one sentence
