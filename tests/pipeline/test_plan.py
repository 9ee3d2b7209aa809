"""From where a clip is seen: all of what is shown of it is in the picture."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from tests.kit import changed, for_each, still_life_of
from tests.passes.scenes import gaussians_at

SECONDS, NUM_MOMENTS = 1.0, 9
SIZE = 1.0  # of the body, world units
SIZED = {"size": (96, 72), "up": "-y"}
CONFIG = changed(PaintConfig(), prune={"keep": 1.0}, cluster={"strokes": 20}, view=SIZED)


CENTER = np.array([4.0, -1.0, 2.0])  # far from the origin, where cameras of captures stand


def ball(num):
    """Small Gaussians on a sphere."""
    away = np.random.default_rng(2).normal(size=(num, 3))
    means = 0.5 * SIZE * away / np.linalg.norm(away, axis=1, keepdims=True) + CENTER
    return gaussians_at(means, 0.04 * SIZE, dtype=np.float32)


def wall(num):
    """What rests behind it."""
    places = np.random.default_rng(3).uniform(-1, 1, (num, 3)) * (1, 1, 0.02) + CENTER + (0, 0, 1.5)
    return replace(ball(num), means=places.astype(np.float32))


def clip_of(body_at, resting=None, *, has_rows, **options):
    """A clip of a body as a function of the share of the time, and of what rests."""

    def sample(time):
        body = body_at(time / SECONDS)
        scene = body if resting is None else bg.Gaussians.joined([resting, body])
        if has_rows:
            return scene
        return scene.take(np.random.default_rng(int(1e6 * time)).permutation(len(scene)))

    times = None if has_rows else np.linspace(0, SECONDS, NUM_MOMENTS)
    return Clip(bg.MovingScene(SECONDS, has_rows, sample, times=times), bg.ClipConfig(**options))


def planned(clip, config=CONFIG):
    prepared = prepare(clip, config, Report(), asks=("cameras", "first_view"))
    return prepared.camera, prepared.known_view


def share_in_picture(camera, means):
    """Of points."""
    places = means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    x, y = (places[:, :2] / places[:, 2:] @ camera.K[:2, :2].T + camera.K[:2, 2]).T
    inside = (places[:, 2] > camera.near) & (x >= 0) & (x <= camera.width) & (y >= 0) & (y <= camera.height)
    return inside.mean()


def flying(way):
    body = ball(200)
    return lambda share: replace(body, means=body.means + np.float32(share * 3 * SIZE * np.array(way)))


def growing(factors):
    """A body that grows by these factors, from the start of the clip to its end."""
    body, center = ball(200), CENTER.astype(np.float32)

    def body_at(share):
        factor = np.float32(np.interp(share, (0, 1), factors))
        return replace(body, means=factor * (body.means - center) + center, scales=factor * body.scales)

    return body_at


@for_each(
    ("body_at", "num_resting", "has_rows"),
    [
        (flying((0, -1, 0)), 200, True),
        (flying((1, 0, 0)), 0, False),
        (growing((0.05, 1)), 0, False),
        (growing((1, 0.05)), 0, True),
    ],
)
def test_a_body_that_moves_by_three_times_its_size_or_grows_stays_in_the_picture(
    body_at, num_resting, has_rows
):
    camera, _ = planned(clip_of(body_at, wall(num_resting) if num_resting else None, has_rows=has_rows))
    for share in np.linspace(0, 1, NUM_MOMENTS):
        assert share_in_picture(camera, body_at(share).means) == 1, share


@for_each("has_rows", [True, False])
def test_only_the_part_that_is_shown_is_framed_and_moments_without_gaussians_are_passed_over(has_rows):
    body_at = flying((1, 0, 0))
    _, whole = planned(clip_of(body_at, has_rows=has_rows))
    _, part = planned(clip_of(body_at, has_rows=has_rows, end=bg.Moment(0)))
    assert np.ptp(whole.points[:, 0]) == pytest.approx(4 * SIZE, rel=0.15)
    assert np.ptp(part.points[:, 0]) == pytest.approx(SIZE, rel=0.2)

    def sometimes(share):
        body = body_at(share)
        if 0.3 < share < 0.7:
            return body
        return replace(body, opacities=0 * body.opacities) if has_rows else body.take(slice(0, 0))

    camera, view = planned(clip_of(sometimes, has_rows=has_rows))
    assert share_in_picture(camera, body_at(0.5).means) == 1
    assert np.ptp(view.points[:, 0]) < 2.5 * SIZE


def test_where_rows_do_not_correspond_the_first_moment_that_shows_the_scene_says_which_way_is_up():
    still = still_life_of(2000)
    config = replace(CONFIG, view=ViewConfig(size=(96, 72)))
    clip = clip_of(lambda share: still.take(slice(0, 20)) if share < 0.2 else still, has_rows=False)
    _, view = planned(clip, config)
    _, alone = planned(Clip(bg.MovingScene(0.0, True, lambda time: still)), config)
    assert (view.ups, view.probability) != ((), None)
    assert view.ups[0][0] == alone.ups[0][0]
    np.testing.assert_allclose(view.azimuth, alone.azimuth, atol=np.radians(5))
