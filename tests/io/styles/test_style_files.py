"""Styles travel as files that people can edit; wrong ones are refused by name."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.packed import pack
from brushgs.formats.styles import MAX_BYTES, read_style, write_style
from brushgs.values.style import Style, StyleStage
from tests.io.styles import example
from tests.kit.for_each import for_each
from tests.kit.json_changes import with_value
from tests.kit.refusals import refuse, refuse_bytes

HALF = 2.0**-11  # relative rounding of float16


@pytest.fixture
def path(tmp_path):
    return tmp_path / "evening.style"


def edited(path, changes, style=None):
    """The file of a style after changes of its JSON, by their places."""
    write_style(style or example.painting(), path)
    value = json.loads(path.read_text())
    for place, new in changes.items():
        value = with_value(value, place, new)
    path.write_text(json.dumps(value))
    return path


def test_a_painting_survives_writing_and_reading(path):
    style = example.painting()
    write_style(style, path)
    read = read_style(path)
    assert (read.name, read.kind, read.edit) == ("evening", "painting", None)
    assert [color.name for color in read.palette.colors] == [color.name for color in style.palette.colors]
    for color, other in zip(read.palette.colors, style.palette.colors, strict=True):
        np.testing.assert_array_equal(color.rgb, other.rgb)
        assert color.share == pytest.approx(other.share, abs=1e-6)
        np.testing.assert_allclose(color.offsets, other.offsets, rtol=HALF, atol=1e-7)
    for name in ("length", "aspect", "broken_lightness", "broken_chroma", "relief"):
        assert getattr(read.marks, name) == getattr(style.marks, name)
    np.testing.assert_array_equal(read.marks.ground, style.marks.ground)
    np.testing.assert_allclose(read.marks.directions, style.marks.directions, atol=0.5 / 127 + 1e-6)
    assert len(read.marks.brushes) == 2
    for brush, other in zip(read.marks.brushes, style.marks.brushes, strict=True):
        np.testing.assert_array_equal(brush, other)
    np.testing.assert_allclose(read.stage.colors, style.stage.colors, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(read.stage.directions, style.stage.directions, atol=0.5 / 127 + 1e-6)
    assert (read.lines.share, read.lines.width) == (style.lines.share, style.lines.width)
    np.testing.assert_allclose(read.lines.rgb, style.lines.rgb)


def test_an_edit_survives_writing_and_reading(path):
    style = example.edit()
    write_style(style, path)
    read = read_style(path)
    assert (read.kind, read.palette, read.marks) == ("edit", None, None)
    np.testing.assert_array_equal(read.edit.affine, style.edit.affine)
    assert read.edit.log_size == style.edit.log_size
    own, other = read.edit.residual, style.edit.residual
    assert (own.features, own.width) == (other.features, other.width)
    for name in ("centers", "weights", "slopes", "offset", "scale"):
        np.testing.assert_array_equal(getattr(own, name), getattr(other, name))


def test_an_artist_who_edits_a_hex_moves_all_colors_around_it(path):
    before = example.painting().palette

    assert '"#1f3a6b"' in edited(path, {}).read_text()
    after = read_style(edited(path, {"palette/0/color": "#8b1f2a"})).palette
    shift = (np.array([0x8B, 0x1F, 0x2A]) - (0x1F, 0x3A, 0x6B)) / 255
    np.testing.assert_allclose(after.samples[:20], before.samples[:20] + shift, atol=1e-4)
    np.testing.assert_allclose(after.samples[20:], before.samples[20:], atol=1e-4)


def test_shares_are_scaled_and_a_color_needs_no_offsets(path):
    value = json.loads(edited(path, {"palette/0/share": 2}).read_text())
    value["palette"].append({"name": "new", "color": "#FF0000", "share": 1.5})
    path.write_text(json.dumps(value))
    palette = read_style(path).palette
    assert palette.colors[0].share == pytest.approx(0.5)
    assert sum(color.share for color in palette.colors) == palette.weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(palette.samples[-1], [1, 0, 0])


BAD = [
    ("brushgs", "scene", "is no style file"),
    ("version", 2, "is of version 2, and this brushgs reads up to version 1; update brushgs"),
    ("version", "1", "'version' must be 1"),
    ("name", "a\x1b[31m", "name must be text of 1 to 80 printable characters"),
    ("palette/0/offsets", [[0, 0, 9]], "must be finite numbers of at most 2, got 9"),
    ("palette/0/offsets", [[0, 0, 0], [0]], "must be an array of shape \\[any, 3\\]"),
    ("palette/0/offsets/shape", [20, 4], "must be 80 numbers of 2 bytes, .* got 120 bytes"),
    ("stage/colors", pack(np.zeros((3, 600, 3)), "uint8"), "must be 2 to 512 a side"),
    ("stage/colors", [[[0, 0, -0.5]] * 2] * 2, "stage.colors must be 0 to 1, got -0.5"),
    ("stage/colors", [[[0, 0, 1.5]] * 2] * 2, "at most 1, got 1.5"),
    ("stage/directions", pack(np.zeros((6, 14, 2)), "int8"), r"shape \[6, 15, 2\], got shape"),
    ("marks/directions", [[0, 1]], "marks.directions must be an array of shape \\[any, any, 2\\]"),
    ("marks/directions", pack(np.zeros((1, 300, 2)), "int8"), "must be at most 256 a side"),
    ("marks/brushes/1/data", "AAAA", r"brushes\[1\]\.data must be a PNG of 8 bits of grey"),
]
BAD_EDITS = [
    ("edit/affine", [[1, 0, 0]], "edit.affine must be an array of shape \\[3, 4\\]"),
    ("edit/residual/scale", [1, 0], "edit.residual.scale must be numbers above 0"),
    ("edit/residual/features", ["a"], "edit.residual.offset must be an array of shape \\[1\\]"),
    ("edit/residual/weights", [[1, 2, 3]], "weights must be an array of shape \\[7, any\\]"),
    ("edit/residual/slopes", [[[1]]], "residual.slopes must be an array of shape \\[7, 3, 3\\]"),
]


@for_each(
    "place, value, sentence, style",
    [(*row, example.painting()) for row in BAD] + [(*row, example.edit()) for row in BAD_EDITS],
)
def test_a_wrong_field_is_named(path, place, value, sentence, style):
    assert ";" in refuse(edited(path, {place: value}, style), sentence, read_style)


def test_brushes_must_be_small_and_grey(path, tmp_path):
    import brushgs as bg

    colored = bg.Frame(np.zeros((8, 8, 3), np.float32), np.ones((8, 8), np.float32), None)
    bg.save(colored, tmp_path / "a.png")
    data = base64.b64encode((tmp_path / "a.png").read_bytes()).decode()
    with pytest.raises(SceneError, match=r"marks\.brushes\[0\]\.data .* got 4 channels in 8x8"):
        read_style(edited(path, {"marks/brushes/0/data": data}))
    with pytest.raises(ValueError, match="at most 256 texels a side, got 1 channels in 300x150"):
        write_style(example.painting(1, side=300), tmp_path / "b.style")


def test_what_is_no_json_or_too_large_is_refused(path):
    refuse(path, "there is no such file", read_style)
    for content, sentence in (
        (b"\x89PNG", "is no style file; where it is a painting, `brushgs style learn"),
        (b'{"brushgs": ', "is not JSON .* give a file that `brushgs style learn` wrote"),
        (b'{"brushgs": "style", "version": 1, "name": "a", "\\ud800": 1}', "surrogates not allowed"),
        (b"{" + b" " * MAX_BYTES, "at most 3 MB"),
    ):
        refuse_bytes(path, content, sentence, read_style)


def test_a_style_too_large_or_wrong_is_not_written(path):
    wide = StyleStage(np.zeros((512, 512, 3), np.float32), np.zeros((512, 512, 2), np.float32))
    with pytest.raises(ValueError, match=r"at most 3 MB, got .*; keep fewer or smaller brushes"):
        write_style(replace(example.painting(64, side=250), stage=wide), path)
    with pytest.raises(ValueError, match=r"at most 3 MB, got .*; learn a smaller residual"):
        write_style(example.edit(40_000), path)
    style = example.painting()
    with pytest.raises(ValueError, match=r"cannot be written: .*marks.aspect must be .* 1 to 20, got 30"):
        write_style(replace(style, marks=replace(style.marks, aspect=30.0)), path)
    with pytest.raises(ValueError, match="holds neither"):
        write_style(Style("nothing"), path)
    with pytest.raises(ValueError, match=r"must be written to a file \*.style"):
        write_style(style, path.with_suffix(".json"))
    assert list(path.parent.iterdir()) == []
