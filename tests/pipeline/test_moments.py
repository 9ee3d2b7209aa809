"""Strokes of a clip as a folder of moments: it paints what the clip paints."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import DrawConfig
from brushgs.pipeline.moments import check_moments, write_strokes
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from tests.clips import clip_of, save_clip
from tests.kit import BLIND, for_each, names, refused, run, without_look

COLUMNS = ("means", "scales", "opacities", "sh")


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return save_clip(tmp_path_factory.mktemp("scene") / "dance")


@pytest.fixture
def strokes(clip, folder, capsys):
    """The folder of strokes that `cluster` writes; the current folder holds nothing else."""
    code, out, err = run(capsys, "cluster", clip, "--strokes", 60, "--up", "-y", "--see", "off", "--json")
    assert (code, err) == (0, "")
    report = json.loads(out)
    assert report["output"] == "dance-strokes/"
    written = report["stages"][-1]
    assert (written["name"], written["counts"]["moments"]) == ("write", 5)
    return Path("dance-strokes")


PAINT = without_look("flat", 60, (96, 72), strokes=BLIND)


def test_a_folder_of_moments_is_a_clip_of_these_strokes(strokes):
    scene = bg.load_moving(strokes)
    assert (scene.has_rows, scene.duration) == (True, pytest.approx(5 / 24))
    assert (scene.notes.is_strokes, scene.notes.scene) == (True, "dance")
    again = prepare(clip_of(strokes), PAINT, Report())
    assert len(again.strokes) == len(scene.at(0)) <= 60
    for moment in range(5):
        painted, stored = again.moving.pose(moment).moved(again.strokes), scene.at(moment / 24)
        order = np.argsort(painted.ids)
        for name in COLUMNS:
            found, expected = getattr(painted, name)[order], getattr(stored, name)
            np.testing.assert_allclose(found, expected, atol=0.01, err_msg=name)  # what rests may creep


def test_the_folder_paints_the_pictures_that_its_strokes_make(strokes, capsys):
    words = ["--stroke", "flat", "--look", "plain", "--size", "96x72", "--lock", "anchor", "--order", "depth"]
    words += ["--fps", "24"]
    assert run(capsys, "render", strokes, *words, "-o", "film/")[0] == 0
    assert len(list(Path("film").iterdir())) == 6  # and the manifest
    assert run(capsys, "render", strokes, *words[:6], "--time", "0", "-o", "first.png")[0] == 0
    assert run(capsys, "render", strokes, *words[:6], "--time", "100%", "-o", "last.png")[0] == 0
    first, last = read_image(Path("first.png")), read_image(Path("last.png"))
    assert np.abs(first - last).max() > 0.2
    for still, frame in ((first, "film/00000.png"), (last, "film/00004.png")):
        assert np.abs(still - read_image(Path(frame))).mean() < 0.002


def test_a_part_of_a_clip(clip, folder, capsys):
    words = ["cluster", clip, "--strokes", 60, "--up", "-y", "--see", "off"]
    assert run(capsys, *words, "--start", "50%", "-o", "late")[1] == "late/\n"
    assert len(list(Path("late").iterdir())) == 3
    assert run(capsys, *words, "--time", "50%", "-o", "a.ply", "--quiet")[0] == 0
    assert bg.load_moving("a.ply").duration == 0


def test_strokes_of_several_brushes_keep_them(clip, tmp_path):
    paint = replace(PAINT, draw=DrawConfig(), brushes=BrushesConfig(other=("flat", "dry_brush")))
    made = prepare(clip_of(clip), paint, Report(), asks=(*PICTURE, "first_view"))
    assert len(np.unique(made.strokes.brushes)) > 1
    write_strokes(made.strokes, made, tmp_path / "brushes", "dance", Report())
    scene = bg.load_moving(tmp_path / "brushes")
    assert scene.notes.brushes == made.kit.images
    np.testing.assert_array_equal(scene.at(0.1).brushes, made.strokes.brushes)


@for_each(
    ("scene", "words", "sentence"),
    [
        ("{clip}", "-o a.ply", "a.ply is one scene, and {clip} moves; write a folder, a/, or add --time"),
        ("{clip}", "-o a.ksplat", "a moving scene must be a folder, got 'a.ksplat'; write a folder"),
        ("{clip}", "-o {clip}", "is an input, and {clip}/ would replace it; choose another folder"),
        ("{clip}", "-o {clip}/../", "is an input, and"),
        ("{clip}/frame_0.ply", "-o strokes/", "output must end in .ply, "),
        ("{clip}/frame_0.ply", "--start 0.1", "--start needs a moving scene, and "),
    ],
)
def test_an_output_that_is_no_folder_of_moments_is_refused(clip, folder, capsys, scene, words, sentence):
    scene, words, sentence = (text.format(clip=clip) for text in (scene, words, sentence))
    assert sentence in refused(capsys, "cluster", scene, *words.split())
    assert names() == []


def test_a_name_with_a_point_is_a_folder_if_it_ends_in_a_slash(clip, tmp_path):
    check_moments(f"{tmp_path}/take.2/", clip_of(clip))
    with pytest.raises(ValueError, match=r"must be a folder, got '.*take\.2'; write a folder, .*take/"):
        check_moments(f"{tmp_path}/take.2", clip_of(clip))
