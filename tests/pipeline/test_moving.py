"""Films of moving scenes: strokes follow what they paint, and frames do not depend on each other."""

import json
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.options.painting import StrokesConfig
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.moving import attached
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from tests.kit import BLIND, blind, changed, for_each, stages, without_look
from tests.passes.scenes import gaussians_at

SECONDS, STEP = 0.5, 1.2  # of the scene, and how far the ball goes, world units
CAMERA = bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=64, height=48, near=0.1)
CONFIG = changed(without_look("flat", 60, (64, 48), strokes=BLIND), draw={"background": "black"})
SEEING = replace(CONFIG, strokes=StrokesConfig())
WALL, BALL = 400, 150


def wall_and_ball(seed=0):
    """A grey wall, and before it a red ball."""
    rng = np.random.default_rng(seed)
    wall = np.concatenate([rng.uniform(-2, 2, (WALL, 2)), np.full((WALL, 1), 1.0)], axis=1)
    ball = rng.normal(size=(BALL, 3))
    ball = 0.5 * ball / np.linalg.norm(ball, axis=1, keepdims=True) - (0.6, 0, 0)
    colors = np.repeat([(0.5, 0.5, 0.5), (0.9, 0.1, 0.1)], (WALL, BALL), axis=0)
    return gaussians_at(np.concatenate([wall, ball]), 0.12, colors, dtype=np.float32)


def moving_scene(*, has_rows=True, seconds=SECONDS, step=STEP):
    """The ball goes to the right; without rows in common every moment is shuffled."""
    start = wall_and_ball()

    def at(time):
        means = start.means.copy()
        means[WALL:, 0] += step * time / max(seconds, 1e-9)
        moment = replace(start, means=means)
        if has_rows:
            return moment
        return moment.take(np.random.default_rng(int(1000 * time)).permutation(len(moment))[:-15])

    times = None if has_rows else np.arange(round(30 * seconds) + 1) / 30
    resting = np.arange(WALL + BALL) < WALL if has_rows else None
    return bg.MovingScene(seconds, has_rows, at, times=times, resting=resting)


def paint(output, scene=None, *, clip=None, config=CONFIG, path=CAMERA, **sequence):
    source = Clip(scene or moving_scene(), clip or bg.ClipConfig(fps=12))
    return paint_sequence(source, output, path, config, SequenceConfig(**sequence))


def frames_of(folder):
    return np.stack([read_image(file) for file in sorted(folder.glob("*.png"))])


def files_of(folder):
    return {file.name: file.read_bytes() for file in folder.glob("*.png")}


def red_center(picture):
    """Column of the middle of what is red."""
    red = np.clip(picture[..., 0] - picture[..., 1], 0, 1) ** 2
    return float((red.sum(axis=0) * np.arange(red.shape[1])).sum() / red.sum())


@for_each("has_rows", [True, False])
def test_strokes_follow_what_they_paint_and_what_rests_is_the_same_in_every_frame(has_rows, tmp_path):
    folder, scene = tmp_path / f"{has_rows}", moving_scene(has_rows=has_rows)
    report = paint(folder / "%02d.png", scene, config=SEEING)
    pictures = frames_of(folder)
    assert len(pictures) == 7
    centers = np.array([red_center(picture) for picture in pictures])
    focal = CAMERA.K[0, 0]
    expected = focal * STEP / 6 * np.arange(7) / 6  # the ball is six units away
    np.testing.assert_allclose(centers - centers[0], expected, atol=1.0)
    counts = stages(report)["follow"].counts
    assert 0 < counts["moving"] < counts["strokes"]
    left = pictures[:, :, :6]  # of the wall, where the ball never is
    assert not has_rows or (left == left[:1]).all()


def test_frames_do_not_depend_on_each_other_nor_on_which_one_a_process_paints_first(tmp_path):
    thick = blind("oil", 80, (64, 48), view={"up": "-y"})
    for name, options in (("flat", {}), ("thick", {"config": thick, "path": PathConfig(orbit=4)})):
        one, more = tmp_path / name / "one", tmp_path / name / "more"
        paint(one / "%d.png", **options)
        paint(more / "%d.png", **options, jobs=3)
        files = files_of(one)
        assert files == files_of(more)
        (one / "2.png").unlink()
        report = paint(one / "%d.png", **options, is_resumed=True)
        assert stages(report)["paint"].counts["painted"] == 1
        assert files_of(one) == files


@for_each(
    ("scene", "clip", "message"),
    [
        (moving_scene(), bg.ClipConfig(fps=12, speed=2), "clip speed 1.0, now 2"),
        (moving_scene(step=0.5), bg.ClipConfig(fps=12), "another motion"),
    ],
)
def test_frames_of_another_film_are_not_resumed(scene, clip, message, tmp_path):
    paint(tmp_path / "%d.png")
    with pytest.raises(bg.SceneError, match=message):
        paint(tmp_path / "%d.png", scene, clip=clip, is_resumed=True)


def test_there_and_back_is_a_loop_that_repeats_pictures_and_a_fading_one_has_no_jump(tmp_path):
    config = changed(CONFIG, draw={"lock": "anchor"})
    paint(tmp_path / "there" / "%02d.png", clip=bg.ClipConfig(fps=12, loop=True), config=config)
    pictures = frames_of(tmp_path / "there")
    assert len(pictures) == 12
    np.testing.assert_array_equal(pictures[1:6], pictures[:6:-1])
    paint(tmp_path / "fades" / "%02d.png", clip=bg.ClipConfig(fps=24, loop=True, cross_fade=0.25))
    pictures = frames_of(tmp_path / "fades")
    assert len(pictures) == 6
    steps = np.abs(pictures - np.roll(pictures, -1, axis=0)).mean(axis=(1, 2, 3))
    assert max(steps) < 2.5 * np.median(steps), "the film has a jump"


def test_while_nothing_moves_one_picture_serves_all_frames(tmp_path):
    frame = {"transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 6], [0, 0, 0, 1]]}
    views, file = {"camera_angle_x": 1.2, "w": 64, "h": 48, "frames": [frame] * 10}, tmp_path / "views.json"
    file.write_text(json.dumps(views))
    report = paint(tmp_path / "%02d.png", path=PathConfig(file=file, fps=12))
    assert stages(report)["paint"].skipped == ["3 frames: nothing moves, they equal those before"]


def test_every_mark_moves_with_a_stroke_and_a_backdrop_rests():
    prepared = prepare(Clip(moving_scene(), bg.ClipConfig(fps=12)), CONFIG, Report(), views=CAMERA)
    strokes = prepared.strokes
    lines = replace(strokes.take(slice(3, 7)), ids=None)
    options = RenderOptions.of(prepared.texture, order="soft")
    coats = [Coat(name, lines, prepared.texture, options) for name in ("lines", BACKDROP)]
    moved, rested = attached(coats, strokes, resting=(BACKDROP,))
    np.testing.assert_array_equal(moved.strokes.ids, strokes.ids[3:7])
    assert rested.strokes.ids is None


def moments(*those, has_rows=False):
    times = np.arange(len(those)) / 30
    return bg.MovingScene(times[-1], has_rows, lambda time: those[round(30 * time)], times=times)


@for_each("has_rows", [True, False])
@for_each("num", [1, 2])
def test_one_moment_and_two(num, has_rows, tmp_path):
    folder = tmp_path / f"{num}-{has_rows}"
    paint(folder / "%d.png", moments(*[wall_and_ball()] * num, has_rows=has_rows), clip=bg.ClipConfig())
    pictures = frames_of(folder)
    assert len(pictures) == num
    np.testing.assert_array_equal(pictures[0], pictures[-1])


def test_moments_without_gaussians_and_of_other_counts(tmp_path):
    whole = wall_and_ball()
    none, half = whole.take(slice(0, 0)), whole.take(slice(0, None, 2))
    scene = moments(none, *[whole] * 3, half, whole, *[none] * 15)
    paint(tmp_path / "a" / "%02d.png", scene, clip=bg.ClipConfig())
    levels = frames_of(tmp_path / "a").mean(axis=(1, 2, 3))
    np.testing.assert_allclose(levels[1:6], levels[2], rtol=0.1)
    assert levels[-1] == 0, "it has faded"
    # A view is framed on the first moment that shows anything.
    paint(tmp_path / "b" / "%02d.png", moments(none, whole), clip=bg.ClipConfig(), path=None)
    assert frames_of(tmp_path / "b")[1].mean() > 0.1
    for path in (None, PathConfig(orbit=3)):
        for has_rows in (True, False):
            with pytest.raises(ValueError, match="the scene shows nothing between its start and its end"):
                paint(tmp_path / "c" / "%d.png", moments(none, none, has_rows=has_rows), path=path)
    assert not (tmp_path / "c").exists()


@pytest.mark.filterwarnings("ignore:no stroke is in the picture")
def test_what_leaves_and_comes_back_takes_its_strokes_along(tmp_path):
    near = wall_and_ball()
    far = replace(near, means=near.means + np.float32([0, 0, 1e6]))
    paint(tmp_path / "%d.png", moments(near, near, far, far, near, has_rows=True), clip=bg.ClipConfig())
    first, *_, away, back = frames_of(tmp_path)
    assert away.max() < 0.02
    np.testing.assert_allclose(back, first, atol=0.35)
    assert np.abs(back - first).mean() < 0.02
