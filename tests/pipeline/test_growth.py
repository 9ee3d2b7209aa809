"""Paintings that grow: from the bare ground to the finished painting, ever nearer to it."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_image
from brushgs.measure.likeness import psnr
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint_file
from tests.kit import blind, for_each, stages, still_life_of

LOOKS = ["oil", "plain", "charcoal", "ink"]
SCENE = still_life_of(3000)
GROW = GrowConfig(1.0, fps=8)  # six frames that grow, and two of the finished painting


QUICK = blind("oil", 200, (80, 60))  # for what whole films are about


@cache
def prepared(look):
    return prepare(SCENE, blind(look, 300, (160, 120)), Report(), asks=(*PICTURE, "growth"))


def seen(painting, prepared):
    """A picture of a painting, 0 to 1, on white where there is no ground."""
    background = (1, 1, 1) if prepared.background is None else prepared.background
    return painting.with_depth(False).frame(prepared.camera).over(background)


@for_each("look", LOOKS)
def test_a_painting_begins_with_the_bare_ground_and_ends_as_itself(look):
    ready = prepared(look)
    bare = seen(replace(ready.painting, coats=()), ready)
    for begun in (ready.growth.at(0, 0.1), ready.growth.first(0)):
        assert np.array_equal(seen(begun, ready), bare)
    for finished in (ready.growth.at(1, 0.1), ready.growth.first(1)):
        assert finished is ready.painting


@for_each("look", LOOKS)
def test_every_stroke_of_the_painting_comes_and_stays_and_coarser_ones_leave(look):
    ready = prepared(look)
    for coat, growing in zip(ready.painting.coats, ready.growth.coats, strict=True):
        num = len(coat.strokes)
        assert np.array_equal(growing.coat.strokes.means[:num], coat.strokes.means)
        assert (growing.comes[:num] <= 1).all()
        assert np.isinf(growing.leaves[:num]).all()
        coarse = np.isfinite(growing.comes[num:])
        assert np.isfinite(growing.leaves[num:][coarse]).all()
        assert (growing.comes[num:][coarse] <= growing.leaves[num:][coarse]).all()
    if look in ("oil", "plain"):
        growing = next(coat for coat in ready.growth.coats if coat.coat.name == "strokes")
        assert len(growing.comes) > len(ready.strokes)


def test_a_share_of_the_strokes_is_laid():
    ready = prepared("oil")
    growing = ready.growth.coats
    for share in (0.1, 0.3, 0.9):
        laid = sum(int((coat.laid < share).sum()) for coat in growing)
        total = sum(int(np.isfinite(coat.comes).sum()) for coat in growing)
        assert laid / total == pytest.approx(share, abs=0.03)
    finished = seen(ready.painting, ready)
    curve = [psnr(seen(ready.growth.first(share), ready), finished) for share in (0.1, 0.3, 0.6, 0.9)]
    assert (np.diff(curve) > 0).all()


def pictures(folder):
    return [read_image(path) for path in sorted(Path(folder).glob("*.png"))]


def test_the_last_frames_are_the_still_bit_for_bit(scene, folder):
    paint_file(scene, "still.png", QUICK)
    paint_file(scene, "first.png", QUICK, first=1)
    report = paint_sequence(scene, "f/", GROW, QUICK)
    still, frames = read_image("still.png"), pictures("f")
    assert [np.array_equal(frame, still) for frame in frames] == [False] * 6 + [True] * 2
    assert Path("first.png").read_bytes() == Path("still.png").read_bytes()
    counts = {name: stage.counts for name, stage in stages(report).items()}
    assert (counts["paint"]["painted"], counts["paint"]["repeated"]) == (7, 1)
    assert counts["order"]["laid"] > 200
    # Any number of processes paints the same, and what is missing can be resumed.
    paint_sequence(scene, "two/", GROW, QUICK, SequenceConfig(jobs=2))
    Path("two/00003.png").unlink()
    resumed = SequenceConfig(is_resumed=True)
    paint_sequence(scene, "two/", GROW, QUICK, resumed)
    assert all(map(np.array_equal, pictures("two"), frames))
    with pytest.raises(SceneError, match=r"another painting \(grow 1.0, now 2"):
        paint_sequence(scene, "two/", GrowConfig(2, fps=4), QUICK, resumed)


def test_a_painting_grows_as_the_camera_moves_and_then_is_that_of_the_path(scene, folder):
    orbit, grow = PathConfig(orbit=6, fps=8), GrowConfig(0.5, is_along_path=True)
    paint_sequence(scene, "plain/", orbit, QUICK)
    paint_sequence(scene, "grown/", orbit, QUICK, grow=grow)
    grown, plain = pictures("grown"), pictures("plain")
    same = [np.array_equal(*pair) for pair in zip(grown, plain, strict=True)]
    assert same == [False] * 3 + [True] * 3  # of four frames the last is finished
    errors = [psnr(*pair) for pair in zip(grown[:4], plain, strict=False)]
    assert np.diff(errors).min() > 0
    Path("grown/00002.png").unlink()
    paint_sequence(scene, "grown/", orbit, QUICK, SequenceConfig(is_resumed=True, jobs=2), grow=grow)
    assert all(map(np.array_equal, pictures("grown"), grown))
    with pytest.raises(SceneError, match="another painting"):
        paint_sequence(scene, "grown/", orbit, QUICK, SequenceConfig(is_resumed=True))


@for_each(
    ("values", "sentence"),
    [
        ((0.0,), "grow must be above 0 seconds, got 0"),
        ((float("inf"),), "grow must be above 0 seconds, got inf"),
        ((8, 0.0), "fps must be above 0"),
        ((0.01,), "grow times fps must give 2 to 99999 frames, got 0"),
    ],
)
def test_what_cannot_grow_is_refused(values, sentence):
    with pytest.raises(ValueError, match=sentence):
        GrowConfig(*values)


def test_a_painting_stands_finished_for_a_second_or_a_quarter():
    for grow, num_growing in ((GrowConfig(8), 168), (GrowConfig(2), 36), (GrowConfig(8, fps=10), 70)):
        assert grow.num_growing == num_growing
        assert grow.time(0) == 0
        assert grow.time(num_growing - 1) < 1 == grow.time(num_growing) == grow.time(grow.num_frames - 1)
