"""Films of moving scenes: strokes follow what they paint, and frames do not depend on each other."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_image
from brushgs.options.clip import ClipConfig
from brushgs.options.look import Look
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, StrokesConfig, ViewConfig
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.moving import attached
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.values.moving import MovingScene

SECONDS, STEP = 0.5, 1.2  # of the scene, and how far the ball goes, world units
CAMERA = bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=64, height=48, near=0.1)
CONFIG = PaintConfig(
    cluster=ClusterConfig(strokes=60),
    draw=DrawConfig(stroke="flat", background="black"),
    strokes=StrokesConfig(see="off"),
    view=ViewConfig(size=(64, 48)),
)
SEEING = replace(CONFIG, strokes=StrokesConfig())
WALL, BALL = 400, 150


def wall_and_ball(seed=0):
    """A grey wall, and before it a red ball."""
    rng = np.random.default_rng(seed)
    wall = np.concatenate([rng.uniform(-2, 2, (WALL, 2)), np.full((WALL, 1), 1.0)], axis=1)
    ball = rng.normal(size=(BALL, 3))
    ball = 0.5 * ball / np.linalg.norm(ball, axis=1, keepdims=True) - (0.6, 0, 0)
    num = WALL + BALL
    colors = np.full((num, 3), 0.5)
    colors[WALL:] = (0.9, 0.1, 0.1)
    return bg.Gaussians(
        np.concatenate([wall, ball]).astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (num, 1)),
        np.full((num, 3), 0.12, np.float32),
        np.full(num, 0.9, np.float32),
        ((colors - 0.5) / 0.28209479177387814).astype(np.float32)[:, None, :],
    )


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
    return MovingScene(seconds, has_rows, at, times=times, resting=resting)


def paint(output, scene=None, *, clip=None, config=CONFIG, path=CAMERA, **sequence):
    source = Clip(scene or moving_scene(), clip or ClipConfig(fps=12))
    return paint_sequence(source, output, path, config, SequenceConfig(**sequence))


def frames_of(folder):
    return [read_image(file) for file in sorted(folder.glob("*.png"))]


def red_center(picture):
    """Column of the middle of what is red."""
    red = np.clip(picture[..., 0] - picture[..., 1], 0, 1) ** 2
    return float((red.sum(axis=0) * np.arange(red.shape[1])).sum() / red.sum())


@pytest.mark.parametrize("has_rows", [True, False])
def test_strokes_follow_what_they_paint(has_rows, tmp_path):
    report = paint(tmp_path / "f" / "%02d.png", moving_scene(has_rows=has_rows), config=SEEING)
    pictures = frames_of(tmp_path / "f")
    assert len(pictures) == 7
    centers = np.array([red_center(picture) for picture in pictures])
    focal = CAMERA.K[0, 0]
    expected = focal * STEP / 6 * np.arange(7) / 6  # the ball is six units away
    np.testing.assert_allclose(centers - centers[0], expected, atol=1.0)
    follow = next(stage for stage in report.stages if stage.name == "follow")
    assert 0 < follow.counts["moving"] < follow.counts["strokes"]


def test_what_rests_is_the_same_in_every_frame(tmp_path):
    paint(tmp_path / "%d.png")
    pictures = np.stack(frames_of(tmp_path))
    left = pictures[:, :, :6]  # of the wall, where the ball never is
    np.testing.assert_array_equal(left, np.broadcast_to(left[:1], left.shape))


def test_frames_do_not_depend_on_each_other(tmp_path):
    paint(tmp_path / "one" / "%d.png")
    paint(tmp_path / "two" / "%d.png", jobs=2)
    one = {file.name: file.read_bytes() for file in (tmp_path / "one").glob("*.png")}
    assert one == {file.name: file.read_bytes() for file in (tmp_path / "two").glob("*.png")}
    (tmp_path / "one" / "3.png").unlink()
    report = paint(tmp_path / "one" / "%d.png", is_resumed=True)
    assert report.stages[-2].counts["painted"] == 1
    assert one == {file.name: file.read_bytes() for file in (tmp_path / "one").glob("*.png")}


def test_thick_paint_does_not_depend_on_which_frame_a_process_paints_first(tmp_path):
    path = PathConfig(orbit=4)
    config = Look.open("oil").config
    config = replace(
        config,
        cluster=replace(config.cluster, strokes=80),
        strokes=replace(config.strokes, see="off"),
        view=replace(CONFIG.view, up="-y"),
    )
    found = []
    for jobs in (1, 3):
        paint(tmp_path / f"{jobs}" / "%d.png", config=config, path=path, jobs=jobs)
        found.append({file.name: file.read_bytes() for file in (tmp_path / f"{jobs}").glob("*.png")})
    assert found[0] == found[1]
    (tmp_path / "1" / "2.png").unlink()
    paint(tmp_path / "1" / "%d.png", config=config, path=path, is_resumed=True)
    assert (tmp_path / "1" / "2.png").read_bytes() == found[0]["2.png"]


@pytest.mark.parametrize(
    ("scene", "clip", "message"),
    [
        (moving_scene(), ClipConfig(fps=12, speed=2), "clip speed 1.0, now 2"),
        (moving_scene(step=0.5), ClipConfig(fps=12), "another motion"),
    ],
)
def test_frames_of_another_film_are_not_resumed(scene, clip, message, tmp_path):
    paint(tmp_path / "%d.png")
    with pytest.raises(SceneError, match=message):
        paint(tmp_path / "%d.png", scene, clip=clip, is_resumed=True)


def test_there_and_back_is_a_loop_and_repeats_pictures(tmp_path):
    config = replace(CONFIG, draw=replace(CONFIG.draw, lock="anchor"))
    paint(tmp_path / "%02d.png", clip=ClipConfig(fps=12, loop=True), config=config)
    pictures = frames_of(tmp_path)
    assert len(pictures) == 12
    for k in range(1, 6):
        np.testing.assert_array_equal(pictures[k], pictures[12 - k])


def test_a_loop_fades_into_its_beginning(tmp_path):
    paint(tmp_path / "%02d.png", clip=ClipConfig(fps=24, loop=True, cross_fade=0.25))
    pictures = frames_of(tmp_path)
    assert len(pictures) == 6
    steps = [np.abs(a - b).mean() for a, b in zip(pictures, [*pictures[1:], pictures[0]], strict=True)]
    assert max(steps) < 2.5 * np.median(steps), "the film has a jump"


def test_every_mark_moves_with_a_stroke_and_a_backdrop_rests():
    prepared = prepare(Clip(moving_scene(), ClipConfig(fps=12)), CONFIG, Report(), views=CAMERA)
    strokes = prepared.strokes
    lines = replace(strokes.take(slice(3, 7)), ids=None)
    options = RenderOptions.of(prepared.texture, order="soft")
    coats = [Coat(name, lines, prepared.texture, options) for name in ("lines", BACKDROP)]
    moved, rested = attached(coats, strokes, resting=(BACKDROP,))
    np.testing.assert_array_equal(moved.strokes.ids, strokes.ids[3:7])
    assert rested.strokes.ids is None


def moments(*those, has_rows=False):
    times = np.arange(len(those)) / 30
    return MovingScene(times[-1], has_rows, lambda time: those[round(30 * time)], times=times)


@pytest.mark.parametrize("has_rows", [True, False])
@pytest.mark.parametrize("num", [1, 2])
def test_one_moment_and_two(num, has_rows, tmp_path):
    paint(tmp_path / "%d.png", moments(*[wall_and_ball()] * num, has_rows=has_rows), clip=ClipConfig())
    pictures = frames_of(tmp_path)
    assert len(pictures) == num
    np.testing.assert_array_equal(pictures[0], pictures[-1])


def test_moments_without_gaussians_and_of_other_counts(tmp_path):
    whole = wall_and_ball()
    none, half = whole.take(slice(0, 0)), whole.take(slice(0, None, 2))
    scene = moments(none, *[whole] * 3, half, whole, *[none] * 15)
    paint(tmp_path / "%02d.png", scene, clip=ClipConfig())
    levels = [picture.mean() for picture in frames_of(tmp_path)]
    np.testing.assert_allclose(levels[1:6], levels[2], rtol=0.1)
    assert levels[-1] == 0, "it has faded"


def test_a_view_is_framed_on_the_first_moment_that_shows_anything(tmp_path):
    whole = wall_and_ball()
    paint(tmp_path / "%02d.png", moments(whole.take(slice(0, 0)), whole), clip=ClipConfig(), path=None)
    assert frames_of(tmp_path)[1].mean() > 0.1


@pytest.mark.parametrize("has_rows", [True, False])
@pytest.mark.parametrize("path", [None, PathConfig(orbit=3)])
def test_a_clip_that_shows_nothing_is_refused_where_it_must_be_framed(path, has_rows, tmp_path):
    scene = moments(*[wall_and_ball().take(slice(0, 0))] * 2, has_rows=has_rows)
    with pytest.raises(ValueError, match="the scene shows nothing between its start and its end"):
        paint(tmp_path / "%d.png", scene, clip=ClipConfig(), path=path)
    assert not list(tmp_path.iterdir())


@pytest.mark.filterwarnings("ignore:no stroke is in the picture")
def test_what_leaves_and_comes_back_takes_its_strokes_along(tmp_path):
    near = wall_and_ball()
    far = replace(near, means=near.means + np.float32([0, 0, 1e6]))
    paint(tmp_path / "%d.png", moments(near, near, far, far, near, has_rows=True), clip=ClipConfig())
    first, *_, away, back = frames_of(tmp_path)
    assert away.max() < 0.02
    np.testing.assert_allclose(back, first, atol=0.35)
    assert np.abs(back - first).mean() < 0.02
