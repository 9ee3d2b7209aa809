"""Paintings that grow: from the bare ground to the finished painting, ever nearer to it."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_image
from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint_file
from tests.kit.for_each import for_each
from tests.scenes import save_upright, still_life_of

LOOKS = ["oil", "plain", "charcoal", "ink"]
NUM_FRAMES = 8
SCENE = still_life_of(3000)
GROW = GrowConfig(1.0, fps=8)  # six frames that grow, and two of the finished painting


def config(look="oil", count=300, **steps):
    values = {step: dict(fields) for step, fields in Look.open(look).values.items()}
    values.setdefault("cluster", {})["strokes"] = count
    values["view"] = {"size": (160, 120)}
    for step, fields in steps.items():
        values.setdefault(step, {}).update(fields)
    return PaintConfig.of(values)


def quick(look="oil"):
    """For what whole films are about: strokes that do not see, in a small picture."""
    return config(look, 200, strokes={"see": "off"}, view={"size": (80, 60)})


@cache
def prepared(look, count=300):
    made = config(look, count, strokes={"see": "off"}, view={"size": (160, 120)})
    return prepare(SCENE, made, Report(), asks=(*PICTURE, "growth"))


def of_strokes(ready):
    """Its growing coat of the strokes of the scene; accents are another."""
    return next(coat for coat in ready.growth.coats if coat.coat.name == "strokes")


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "still_life.ply"
    save_upright(still_life_of(1000), path)
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def seen(painting, prepared):
    """A picture of a painting, 0 to 1, on white where there is no ground."""
    background = (1, 1, 1) if prepared.background is None else prepared.background
    return painting.with_depth(False).frame(prepared.camera).over(background)


def psnr(picture, finished):
    return -10 * np.log10(max(float(np.mean((picture - finished) ** 2)), 1e-12))


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
        assert len(of_strokes(ready).comes) > len(ready.strokes)


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


def test_the_last_frames_are_the_still_bit_for_bit(scene, folder):
    paint_file(scene, "still.png", quick())
    paint_file(scene, "first.png", quick(), first=1)
    report = paint_sequence(scene, "f/", GROW, quick())
    names = sorted(path.name for path in Path("f").glob("*.png"))
    still = read_image(Path("still.png"))
    assert len(names) == 8
    for name in names[6:]:
        assert np.array_equal(read_image(Path("f") / name), still)
    assert not np.array_equal(read_image(Path("f") / names[5]), still)
    assert Path("first.png").read_bytes() == Path("still.png").read_bytes()
    counts = {stage.name: stage.counts for stage in report.stages}
    assert (counts["paint"]["painted"], counts["paint"]["repeated"]) == (7, 1)
    assert counts["order"]["laid"] > 200


def test_any_number_of_processes_paints_the_same_and_missing_frames_can_be_resumed(scene, folder):
    paint_sequence(scene, "one/", GROW, quick())
    paint_sequence(scene, "two/", GROW, quick(), SequenceConfig(jobs=2))
    Path("two/00003.png").unlink()
    paint_sequence(scene, "two/", GROW, quick(), SequenceConfig(is_resumed=True))
    one, two = ({path.name: path.read_bytes() for path in Path(f).glob("*.png")} for f in ("one", "two"))
    assert one == two
    with pytest.raises(SceneError, match=r"another painting \(grow 1.0, now 2"):
        paint_sequence(scene, "two/", GrowConfig(2, fps=4), quick(), SequenceConfig(is_resumed=True))
    with pytest.raises(SceneError, match="another painting"):
        paint_sequence(scene, "two/", GROW, quick("plain"), SequenceConfig(is_resumed=True))


def test_a_painting_grows_as_the_camera_moves_and_then_is_that_of_the_path(scene, folder):
    orbit, grow = PathConfig(orbit=6, fps=8), GrowConfig(0.5, is_along_path=True)
    paint_sequence(scene, "plain/", orbit, quick())
    paint_sequence(scene, "grown/", orbit, quick(), grow=grow)
    paint_sequence(scene, "some/", orbit, quick(), SequenceConfig(jobs=2), grow=grow)
    Path("some/00002.png").unlink()
    paint_sequence(scene, "some/", orbit, quick(), SequenceConfig(is_resumed=True), grow=grow)
    pictures = {
        f: [read_image(path) for path in sorted(Path(f).glob("*.png"))] for f in ("plain", "grown", "some")
    }
    assert all(map(np.array_equal, pictures["some"], pictures["grown"]))
    same = [np.array_equal(*pair) for pair in zip(pictures["grown"], pictures["plain"], strict=True)]
    assert same == [False] * 3 + [True] * 3  # of four frames the last is finished
    errors = [psnr(*pair) for pair in zip(pictures["grown"][:4], pictures["plain"], strict=False)]
    assert np.diff(errors).min() > 0
    with pytest.raises(SceneError, match="another painting"):
        paint_sequence(scene, "some/", orbit, quick(), SequenceConfig(is_resumed=True))


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
