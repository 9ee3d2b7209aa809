"""A part of a painting is the cut of the whole, and a large one is painted in strips: bit for bit."""

from dataclasses import replace
from functools import cache

import numpy as np
import OpenImageIO
import pytest
from PIL import Image

import brushgs as bg
from brushgs.cli import main
from brushgs.options.choices import LOOKS
from brushgs.options.look import config_of
from brushgs.options.painting import ClusterConfig, ViewConfig, chosen_size
from brushgs.pipeline import strips
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_view
from brushgs.rendering.wanted import Wanted
from brushgs.values.layers import Matte
from brushgs.values.part import Part
from tests.kit import blind, for_each, names, refused, save_opaque, still_life_of
from tests.rendering.test_parts import is_same

WIDTH, HEIGHT = 140, 102
# A look of each medium; the others are made of the same parts: ink is hatching with lines and blacks.
DIFFERENT = [look for look in LOOKS if look not in ("impressionist", "gouache", "hatching", "stippling")]
PARTS = (Part(37, 29, 60, 41), Part(133, 101, 7, 1))
SMALL = ["--quiet", "--size", f"{WIDTH}x{HEIGHT}", "--strokes", "300", "--up", "-y", "--see", "off"]


@cache
def prepared_in(look):
    return prepare(still_life_of(1000), blind(look, 300, (WIDTH, HEIGHT)), Report())


@for_each("look", DIFFERENT)
def test_in_every_look_a_part_is_the_cut_of_the_whole(look):
    prepared = prepared_in(look)
    whole = paint_view(prepared, Report())
    for part in PARTS:
        painting = replace(prepared.painting, part=part)
        assert is_same(paint_view(replace(prepared, painting=painting), Report()), whole.cut(part))


def test_only_what_washes_and_blacks_need_is_painted_whole():
    reaches = {look: prepared_in(look).painting for look in ("oil", "charcoal", "watercolour", "ink")}
    camera = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=1000, height=750)
    of_look = {look: painting.reach(camera) for look, painting in reaches.items()}
    assert of_look["watercolour"] is of_look["ink"] is None
    assert 0 < of_look["oil"] < of_look["charcoal"] < 40
    larger = camera.resized(4000, 3000)
    assert reaches["oil"].reach(larger) > of_look["oil"]
    on_paper = replace(reaches["oil"], dpi=150.0)
    assert on_paper.reach(larger) == on_paper.reach(camera)


def test_layers_and_samples_of_a_part_are_those_of_the_whole():
    prepared, part = prepared_in("oil"), PARTS[0]
    painting = replace(prepared.painting, part=part)
    for wanted in (Wanted(("depth", "stroke", "unlit", "uv", "normal")), Wanted(deep=True)):
        whole = paint_view(prepared, Report(), wanted=wanted).cut(part)
        cut = paint_view(replace(prepared, painting=painting), Report(), wanted=wanted)
        assert is_same(cut, whole)
        assert cut.layers.keys() == whole.layers.keys()
        for name, layer in cut.layers.items():
            one, other = (of.coverage if isinstance(of, Matte) else of for of in (layer, whole.layers[name]))
            assert np.array_equal(one, other), name
        if cut.deep is not None:
            assert np.array_equal(cut.deep.colors, whole.deep.colors)


def rendered(scene, name, *flags):
    """The pixels of a file of `brushgs render`, and their resolution."""
    assert main(["render", str(scene), *SMALL, *flags, "-o", name]) == 0
    with Image.open(name) as picture:
        return np.asarray(picture), picture.info.get("dpi")


@pytest.fixture
def in_strips(monkeypatch):
    """A function that has pictures painted in strips of so many pixels from now on."""

    def switch(pixels):
        monkeypatch.setattr(strips, "MOST_PIXELS", 100)
        monkeypatch.setattr(strips, "STRIP_PIXELS", pixels)

    return switch


def test_the_file_of_a_part_is_the_cut_of_that_of_the_whole_also_in_strips(scene, folder, in_strips):
    save_opaque("behind.png", np.random.default_rng(0).random((60, 80, 3)))
    cuts = {}
    for background in ("transparent", "behind.png"):
        flags = ["--look", "plain", "--stroke", "flat", "--background", background]
        whole, _ = rendered(scene, "whole.png", *flags)
        cuts[background], _ = rendered(scene, "part.png", *flags, "--crop", "7,3,120,90")
        assert np.array_equal(cuts[background], whole[3:93, 7:127])
    in_strips(40 * WIDTH)
    found, _ = rendered(scene, "strips.png", *flags, "--crop", "7,3,120,90")
    assert np.array_equal(found, cuts[background])


def test_an_exr_says_where_in_the_picture_its_part_lies(scene, tmp_path):
    for more in (["--layers", "depth"], ["--deep"]):
        path = tmp_path / "part.exr"
        flags = [*SMALL, *more, "--crop", "37,29,60,41"]
        assert main(["render", str(scene), *flags, "-o", str(path)]) == 0
        source = OpenImageIO.ImageInput.open(str(path))
        spec = source.spec()
        assert (spec.x, spec.y, spec.width, spec.height) == (37, 29, 60, 41)
        assert (spec.full_width, spec.full_height) == (WIDTH, HEIGHT)
        pixels = source.read_native_deep_image() if spec.deep else source.read_image()
        assert pixels is not None
        source.close()


@for_each(("look", "suffix"), [("oil", "png"), ("charcoal", "png"), ("plain", "tif"), ("plain", "jpg")])
def test_strips_give_the_file_of_one_piece(look, suffix, scene, folder, in_strips, monkeypatch):
    flags = ["--look", look, "--size", f"{WIDTH}x{HEIGHT}@200"]
    whole, dpi = rendered(scene, f"whole.{suffix}", *flags)
    in_strips(20 * WIDTH)  # strips of one row of tiles
    found, dpi_of_strips = rendered(scene, f"strips.{suffix}", *flags)
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert np.array_equal(found, whole)
    assert dpi == dpi_of_strips == pytest.approx((200, 200), abs=0.1)


def test_a_picture_beyond_the_memory_is_refused(monkeypatch):
    prepared = prepared_in("watercolour")
    monkeypatch.setattr(strips, "MOST_PIXELS", 100)
    monkeypatch.setattr(strips, "UNCHECKED", 100)
    monkeypatch.setattr(strips, "machine_memory", lambda: 10**6)
    with pytest.raises(ValueError, match=r"its washes or blacks need some 3\.14 MB for 140x102 pixels"):
        paint_view(prepared, Report(), in_strips=True)


@for_each(
    ("flags", "sentence"),
    [
        (["--crop", "100,0,41,10"], "crop must lie in the picture of 140x102 pixels, got 100,0,41,10"),
        (["--crop", "0,0,4,4", "-o", "a.svg"], "crop must be omitted for a drawing in lines, got a.svg"),
        (["--stroke-size", "8mm"], "stroke-size must be in px without a size on paper, got 8mm"),
    ],
)
def test_what_cannot_be_printed_is_refused(flags, sentence, scene, capsys, folder):
    assert sentence in refused(capsys, "render", scene, "--size", f"{WIDTH}x{HEIGHT}", *flags)
    assert names() == []


def test_paper_lies_as_suits_the_subject(scene):
    report = Report()
    config = replace(config_of("oil"), view=ViewConfig(size=chosen_size("A6@30")), cluster=ClusterConfig(300))
    camera = prepare(scene, config, report, asks=("cameras",)).camera
    flags = next(stage.counts["flags"] for stage in report.stages if stage.name == "camera")
    assert {camera.width, camera.height} == {175, 124}
    lies = "landscape" if camera.width > camera.height else "portrait"
    assert f"--size A6-{lies}@30" in flags
