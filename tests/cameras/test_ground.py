"""Up is perpendicular to the ground, where there is one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import brushgs as bg
from brushgs.cameras.framing import AXES
from brushgs.cameras.ground import level_up
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, replaced, rescaled
from tests.scenes import real_scene


def degrees_between(one, other):
    return np.degrees(np.arccos(np.clip(np.dot(one, other), -1, 1)))


def turned(gaussians, rotation):
    """The scene turned by a rotation of SciPy."""
    quats = (rotation * Rotation.from_quat(gaussians.quats[:, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]]
    means = rotation.apply(gaussians.means)
    return replaced(gaussians, means=means.astype(np.float32), quats=quats.astype(np.float32))


def statue_on_a_plaza(seed=0, noise=4.0):
    """A ball of discs that face outward, over a ground of discs that are level within `noise` degrees."""
    rng = np.random.default_rng(seed)
    ground = np.column_stack([rng.uniform(-3, 3, 6000), rng.normal(1, 0.01, 6000), rng.uniform(-3, 3, 6000)])
    outward = rng.normal(size=(3000, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    facing = np.concatenate([rng.normal(size=(6000, 3)) * np.sin(np.radians(noise)) + (0, -1, 0), outward])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    axis = np.cross((0, 0, 1), facing)
    quats = np.column_stack([1 + facing[:, 2], axis])  # from z to the direction that the disc faces
    means = np.concatenate([ground, 0.9 * outward])
    return gaussians_at(means, (0.05, 0.05, 0.002), quats=quats, dtype=np.float32)


@for_each("tilt", [(3, 0, 0), (0, 0, -4), (5, 0, 9)])
@for_each("unit", [1e-4, 1.0, 1e4])
def test_up_is_perpendicular_to_the_ground(tilt, unit):
    scene = rescaled(statue_on_a_plaza(), unit)
    rotation = Rotation.from_rotvec(tilt, degrees=True)
    found = level_up(turned(scene, rotation), np.array(AXES["-y"]))
    assert degrees_between(found, rotation.apply(AXES["-y"])) < 0.3
    assert np.linalg.norm(found) == pytest.approx(1)


def test_without_a_ground_the_axis_stays():
    up, scene = np.array(AXES["-y"]), statue_on_a_plaza()
    ball = scene.take(slice(6000, None))
    rng = np.random.default_rng(1)
    unordered = replaced(scene, quats=rng.normal(size=(9000, 4)).astype(np.float32))
    tilted = turned(unordered, Rotation.from_rotvec((9, 0, 0), degrees=True))
    one, equal, few = ball.take(slice(0, 1)), ball.take(np.zeros(50, int)), scene.take(slice(0, 30))
    for found in (ball, one, equal, few, tilted):
        assert level_up(found, up) is up


def test_objects_without_ground_are_left_alone():
    up = np.array(AXES["+z"])
    assert level_up(bg.load(real_scene("derived/chair.ply")), up) is up
