"""The order in which the page draws strokes."""

import numpy as np
import pytest

import brushgs as bg
from tests.outlets.page.strokes import CAMERAS, hard_strokes
from tests.outlets.page.studio import painting_of

RESOLUTION = 2.0**-17  # of a distance, where the farthest is less than 16 times as far as the nearest


def means_of(count, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (count, 3)).astype(np.float32)


@pytest.mark.parametrize("with_underpaint", [False, True])
@pytest.mark.parametrize("axis", [None, [0.0, 0.6, 0.8]])
def test_all_are_drawn_once_farthest_first(studio, axis, with_underpaint):
    means, eye = means_of(3000), (0.5, -2, -3)
    setbacks = np.random.default_rng(1).uniform(0, 0.2, 3000).astype(np.float32) if with_underpaint else None
    ids = studio.order(means, eye, setbacks=setbacks, axis=axis)
    rays = means.astype(np.float64) - eye
    distances = np.linalg.norm(rays, axis=1) if axis is None else rays @ axis
    if with_underpaint:
        distances = np.stack([distances, distances + setbacks], axis=1).ravel()
    assert sorted(ids) == list(range(len(distances)))
    assert (np.diff(distances[ids]) < RESOLUTION * distances.max()).all()


def test_of_strokes_at_one_depth_the_first_is_nearest_and_its_underpaint_behind_all(studio):
    means = np.zeros((4, 3), np.float32)
    ids = studio.order(means, (0, 0, -3), setbacks=np.zeros(4, np.float32))
    assert ids.tolist() == [7, 5, 3, 1, 6, 4, 2, 0]


def test_turning_the_head_changes_no_order(studio):
    strokes = hard_strokes(300)
    studio.load(painting_of(strokes, bg.StrokeTexture.open("flat")), CAMERAS[0])
    turned = [
        bg.Camera.look_at((0, 0, -4), (x, 0, 0), up=up, width=320, height=240, fov_y=0.8)
        for x, up in ((0, (0, -1, 0)), (3, (0, -1, 0)), (0, (1, 0, 0)))
    ]
    drawn = [studio.drawn(camera) for camera in turned]
    np.testing.assert_array_equal(drawn[0], drawn[1])
    np.testing.assert_array_equal(drawn[0], drawn[2])
    assert not np.array_equal(drawn[0], studio.drawn(CAMERAS[1]))
