"""Sizes on paper, and what has a size on it."""

import pytest

from brushgs.options.output import OutputConfig, read_crop
from brushgs.options.painting import ClusterConfig, PaintConfig, ViewConfig, chosen_size
from brushgs.options.paper import SHEETS, PaperSize
from brushgs.options.stroke_target import StrokeSize
from tests.kit.for_each import for_each


@for_each(
    ("text", "pixels"),
    [
        ("A3@300", (4961, 3508)),
        ("a3@300", (4961, 3508)),
        ("A3-portrait@300", (3508, 4961)),
        ("A0-landscape@300", (14043, 9933)),
        ("letter@100", (1100, 850)),
        ("40x30cm@254", (4000, 3000)),
        ("300x400mm@25.4", (300, 400)),
        ("8x10in@72", (576, 720)),
        ("7680x4320@300", (7680, 4320)),
        ("641x479px@93.7", (641, 479)),
    ],
)
def test_paper_has_so_many_pixels(text, pixels):
    view = ViewConfig(size=chosen_size(text))
    assert view.fixed_size == pixels
    assert view.dpi == pytest.approx(float(text.split("@")[1]))
    assert chosen_size(str(view.size)) == view.size


@for_each("name", SHEETS)
def test_sheets_turn_unless_they_say_how_they_lie(name):
    free = PaperSize.of(f"{name}@50")
    across, upright = free.turns
    assert free.pixels == across.pixels == upright.pixels[::-1]
    assert across.pixels[0] > across.pixels[1]
    assert across.turns == (across,)
    assert ViewConfig(size=free).is_composable
    assert not ViewConfig(size=upright).is_composable


EXAMPLES = "must be a size on paper such as A3@300, A4-portrait@300"


@for_each(
    ("text", "sentence"),
    [
        *((text, EXAMPLES) for text in ("A7@300", "A3@", "A3@x", "A3-square@300", "40x30ft@200", "@300")),
        *((text, f"must name the pixels per inch too, {text}@300") for text in ("A3", "letter", "40x30cm")),
        ("A3@5", "10 to 2400 dpi"),
        ("A0@2400", "268 million pixels, .*; take fewer dpi than A0@2400"),
    ],
)
def test_what_is_no_paper_is_answered_by_examples(text, sentence):
    with pytest.raises(ValueError, match=sentence):
        chosen_size(text)


def test_strokes_in_millimetres_need_paper():
    cluster = ClusterConfig(StrokeSize(8, is_mm=True))
    on_paper = PaintConfig(cluster=cluster, view=ViewConfig(size=chosen_size("A4@254")))
    assert on_paper.in_pixels.cluster.strokes == StrokeSize(80)
    with pytest.raises(ValueError, match="stroke-size must be in px without a size on paper, got 8mm"):
        PaintConfig(cluster=cluster).in_pixels  # noqa: B018
    assert str(cluster.strokes) == "8mm"


@for_each("text", ["1,2,3", "1,2,3,4,5", "-1,0,4,4", "a,b,c,d", ""])
def test_a_part_is_four_whole_numbers(text):
    with pytest.raises(ValueError, match="must be X,Y,W,H in pixels"):
        read_crop(text)
    assert OutputConfig(crop=read_crop("0, 1, 20,30")).crop == (0, 1, 20, 30)
    with pytest.raises(ValueError, match=r"crop must be X,Y,W,H .* got 0,0,0,4"):
        OutputConfig(crop=(0, 0, 0, 4))
