"""Brushes that a style file holds, named "monet.style:2"."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError
from brushgs.brushes.brush_set import name_of
from brushgs.formats.styles import write_style
from brushgs.options.painting import DrawConfig, PaintConfig
from brushgs.pipeline.outputs import input_files
from brushgs.values.style import Style, StyleMarks
from tests.kit.for_each import for_each

IMAGES = tuple(np.random.default_rng(k).integers(0, 256, (12 + k, 40), dtype=np.uint8) for k in range(3))
MARKS = StyleMarks(0.1, 3.0, np.zeros((4, 6, 2), np.float32), brushes=IMAGES)


@pytest.fixture
def style(tmp_path):
    path = tmp_path / "monet.style"
    write_style(Style("monet", marks=MARKS), path)
    return path


@for_each("number", [1, 2, 3])
def test_a_brush_of_a_style_is_opened_by_its_number(style, number):
    texture = bg.StrokeTexture.open(f"{style}:{number}")
    np.testing.assert_array_equal(texture.coverage, IMAGES[number - 1])
    assert (texture.kind, texture.name, texture.height) == ("image", f"monet_{number}", None)
    np.testing.assert_array_equal(bg.StrokeTexture.open(Path(f"{style}:{number}")).coverage, texture.coverage)


def test_sets_and_kits_take_them_beside_others(style):
    brushes = bg.BrushSet.open(f"flat,{style}:1,{style}:3")
    assert brushes.names[1:] == ("monet_1", "monet_3")
    kit = bg.BrushKit.of([f"{style}:2", "flat"])
    assert f"{style}:2" in kit.images
    assert "monet_2" in kit.open().names
    assert name_of(f"{style}:2") == "monet_2"
    assert bg.StrokeTexture.open(f"{style}:1", size=20).coverage.shape == (6, 20)
    config = replace(PaintConfig(), draw=DrawConfig(stroke=f"{style}:2"))
    assert style in input_files(None, config)  # and so never overwritten


@for_each(
    ("name", "message"),
    [
        ("monet.style:4", r"the style has 3 brushes; name one of them, such as .*monet\.style:1"),
        ("monet.style:0", "the style has 3 brushes"),
        ("monet.style", "the style has 3 brushes"),
        ("plain.style:1", "the style has no brushes; choose a stroke that comes with"),
        ("missing.style:1", r"missing\.style"),
    ],
)
def test_what_is_no_brush_of_a_style_is_refused(style, name, message):
    write_style(Style("plain", marks=replace(MARKS, brushes=())), style.parent / "plain.style")
    with pytest.raises(SceneError, match=message):
        bg.StrokeTexture.open(f"{style.parent / name}")
