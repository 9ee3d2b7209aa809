"""Strokes while the camera turns around them: nothing flips and nothing pops."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.rendering.reference import rotation_matrices
from tests.page.studio import painting_of
from tests.rendering.test_track import steps_of, strokes, turntable

COUNT = 400


@pytest.mark.parametrize("elevation", [0.0, 1.2])
def test_strokes_flip_only_where_one_looks_along_their_axis(studio, elevation):
    """As `anchor` is held to: in 240 steps of 1.5 degrees no stroke turns by more than 15, and none pops."""
    scene, cameras = strokes(COUNT, seed=7), turntable(240, elevation=elevation)
    rows = studio.load(painting_of(scene, bg.StrokeTexture.open("flat")), cameras[0]).rows[0]
    boxes = studio.turning(cameras)
    longest = rotation_matrices(scene.quats)[np.arange(COUNT), :, np.argmax(scene.scales, axis=1)][rows]
    toward = scene.means[rows] - np.array([camera.position for camera in cameras])[:, None]
    cosine = (longest * toward).sum(axis=2) / np.linalg.norm(toward, axis=2)
    is_free = np.abs(cosine) < np.cos(np.radians(10))
    assert (boxes[:, :, 7] == 1).all()
    is_free = is_free[1:] & is_free[:-1]
    assert steps_of(boxes[:, :, 4])[is_free].max() < np.radians(15)
    assert np.abs(np.diff(boxes[:, :, 6], axis=0)).max() < 0.1  # 0.05 where a needle turns its end to the eye
    sizes = np.log(boxes[:, :, 2] * boxes[:, :, 3])
    assert np.abs(np.diff(sizes, axis=0))[is_free].max() < 0.5
