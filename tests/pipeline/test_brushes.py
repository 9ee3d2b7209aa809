"""Several brushes in one painting, from the command line and from options."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.formats.pictures.images import read_image
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import ClusterConfig
from brushgs.options.rules import Rule, Rules
from brushgs.options.where import Where
from brushgs.outlets.passes import cluster_file, prune_file
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_file
from tests.brushes.test_kit import FLATS, write_brushes
from tests.kit import BLIND, stages, without_look


def config(stroke="impasto", **steps):
    return without_look(stroke, 150, (96, 72), strokes=BLIND, **steps)


def test_strokes_take_their_brushes_and_one_stroke_paints_as_ever(scene, folder):
    found = stages(paint_file(scene, "two.png", config("flat,dab")))
    assert found["stroke"].counts["brushes"][:5] == [*FLATS, "dab"]
    assert found["brushes"].did == "150 strokes of 8 brushes"
    assert "brushes" not in stages(paint_file(scene, "one.png", config("flat")))
    paint_file(scene, "same.png", config(brushes=BrushesConfig(other=("flat_1",))))
    one, two = read_image("one.png"), read_image("two.png")
    np.testing.assert_array_equal(one, read_image("same.png"))
    assert (np.abs(one - two).max(axis=2) > 0.02).mean() > 0.1


def test_a_folder_of_images_is_a_set(scene, folder):
    write_brushes(folder / "mine", 4)
    paint_file(scene, "a.png", config("mine"))
    paint_file(scene, "b.png", config(",".join(f"mine/00{n}.png" for n in range(4))))
    np.testing.assert_array_equal(read_image("a.png"), read_image("b.png"))
    (folder / "empty").mkdir()
    for stroke, sentence in {
        "empty": "empty: the folder holds no brush; put stroke images into it",
        "flat,swril": "swril: neither a file nor a built-in stroke",
    }.items():
        with pytest.raises(ValueError, match=sentence):
            paint_file(scene, "c.png", config(stroke))


def test_strokes_keep_their_brushes_in_a_file_and_are_painted_the_same(scene, tmp_path):
    several = config("flat,dab")
    path = tmp_path / "strokes.ply"
    cluster_file(scene, path, several, Report())
    strokes, notes = read_scene(path)
    assert notes.brushes == bg.BrushKit.of("flat,dab").images
    chosen = bg.choose_brushes(strokes, bg.BrushKit.of("flat,dab"))
    np.testing.assert_array_equal(strokes.brushes, chosen.brushes)
    prune_file(path, tmp_path / "fewer.ply", replace(several.prune, keep=0.5), Report())
    fewer, notes = read_scene(tmp_path / "fewer.ply")
    assert notes.brushes == bg.BrushKit.of("flat,dab").images
    assert 0 < len(fewer.brushes) < len(strokes)
    # Painted with other brushes, strokes choose anew.
    for stroke in ("flat,dab", "ink", "swirl,filbert"):
        report = paint_file(path, tmp_path / "a.png", config(stroke, cluster=ClusterConfig()))
        assert ("brushes" not in stages(report)) == (stroke == "ink")
    usual = config(brushes=BrushesConfig(are_usual=True), cluster=ClusterConfig())
    ruled = replace(usual, rules=Rules((Rule(Where.parse("half:1,0,0,0"), brushes=("ink",)),)))
    for asked, are_kept in ((usual, True), (ruled, False)):
        assert ("stored brushes" in stages(paint_file(path, tmp_path / "a.png", asked))) == are_kept
