"""Several brushes in one painting, from the command line and from options."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.formats import read_scene
from brushgs.formats.pictures.images import read_image
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, StrokesConfig, ViewConfig
from brushgs.outlets.passes import cluster_file, prune_file
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_file
from tests.brushes.test_kit import FLATS, write_brushes
from tests.scenes import still_life_of

SMALL = ViewConfig(size=(96, 72))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "a.ply"
    bg.save(still_life_of(1000), path)
    return path


def config(stroke="impasto", **steps):
    return PaintConfig(
        **{
            "cluster": ClusterConfig(strokes=150),
            "draw": DrawConfig(stroke=stroke),
            "strokes": StrokesConfig(see="off"),
            "view": SMALL,
        }
        | steps
    )


def stage(report, name):
    return next((stage for stage in report.stages if stage.name == name), None)


def test_strokes_take_their_brushes_and_one_stroke_paints_as_ever(scene, tmp_path):
    report = paint_file(scene, tmp_path / "two.png", config("flat,dab"))
    assert stage(report, "stroke").counts["brushes"][:5] == [*FLATS, "dab"]
    assert stage(report, "brushes").did == "150 strokes of 8 brushes"
    report = paint_file(scene, tmp_path / "one.png", config("flat"))
    assert stage(report, "brushes") is None
    paint_file(scene, tmp_path / "same.png", config(brushes=BrushesConfig(other=("flat_1",))))
    one, two = read_image(tmp_path / "one.png"), read_image(tmp_path / "two.png")
    np.testing.assert_array_equal(one, read_image(tmp_path / "same.png"))
    assert (np.abs(one - two).max(axis=2) > 0.02).mean() > 0.1


def test_a_folder_of_images_is_a_set(scene, tmp_path, monkeypatch, capsys):
    write_brushes(tmp_path / "mine", 4)
    monkeypatch.chdir(tmp_path)
    words = [
        "render",
        str(scene),
        "--strokes",
        "150",
        "--size",
        "96x72",
        "--see",
        "off",
        "--background",
        "white",
    ]
    assert cli.main([*words, "--stroke", "mine", "--output", "a.png"]) == 0
    assert cli.main([*words, "--stroke", ",".join(f"mine/00{n}.png" for n in range(4)), "-o", "b.png"]) == 0
    np.testing.assert_array_equal(read_image("a.png"), read_image("b.png"))
    (tmp_path / "empty").mkdir()
    capsys.readouterr()
    for stroke, sentence in {
        "empty": "empty: the folder holds no brush; put stroke images into it",
        "flat,swril": "swril: neither a file nor a built-in stroke",
        "flat,,dab": "flat,,dab: nothing stands between two commas",
        "flat,gaussian": "'gaussian' is computed and not drawn, so it must be the only brush",
    }.items():
        assert cli.main([*words, "--stroke", stroke, "--output", "c.png"]) == 2
        error = capsys.readouterr().err
        assert sentence in error
        assert len(error.splitlines()) == 1


def test_an_image_of_a_set_is_never_overwritten(scene, tmp_path):
    first, second = sorted(write_brushes(tmp_path / "mine", 2).iterdir())
    for stroke in (str(tmp_path / "mine"), f"{first},{second}"):
        with pytest.raises(bg.SceneError, match=r"001\.png: is the input, which is never overwritten"):
            paint_file(scene, second, config(stroke))


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
        assert (stage(report, "brushes") is None) == (stroke == "ink")
