"""Strokes laid as the marks of a painting, before any step."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.refine.lay import Seen, lay_marks
from brushgs.rendering.motion import AT_REST, SHIFT, SIZE, TURN, Pose
from brushgs.values.quats import rotation_matrices
from brushgs.values.style import StyleMarks
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at

SIGMAS = 1.6
CAMERA = bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=160, height=120, fov_y=0.5)


def marks_at(degrees, length=0.1, aspect=6.0):
    """Marks that all run one way, from +x towards +y of the picture."""
    twice = 2 * np.radians(degrees)
    directions = np.tile(np.float32([np.cos(twice), np.sin(twice)]), (6, 8, 1))
    return StyleMarks(length, aspect, directions)


def wall(num=300, scale=0.05, color=(0.6, 0.4, 0.2)):
    """Round, flat strokes that face the camera."""
    rng = np.random.default_rng(0)
    means = np.column_stack([rng.uniform(-1.4, 1.4, num), rng.uniform(-1, 1, num), np.zeros(num)])
    return gaussians_at(means, (scale, 0.95 * scale, 0.01), color, opacity=0.95, dtype=np.float32)


def laid(strokes, marks, **options):
    behind = wall(900, 0.2)  # what the plain picture shows: a surface without holes
    return lay_marks(strokes, marks, [Seen.of(behind, CAMERA)], SIGMAS, **options)


def boxes_of(strokes):
    return bg.project(strokes, CAMERA, num_sigmas=SIGMAS, low_pass=0.0)


def off(angles, degrees):
    """Angles between directions without a sign, degrees."""
    return np.degrees(np.abs((angles - np.radians(degrees) + np.pi / 2) % np.pi - np.pi / 2))


@for_each("degrees", [0, 30, 90, 135])
def test_marks_run_as_those_of_the_painting(degrees):
    strokes = wall()
    assert np.median(off(boxes_of(strokes).angles, 0)) < 1
    after, _ = laid(strokes, marks_at(degrees))
    assert np.median(off(boxes_of(after).angles, degrees)) < 3


def test_marks_are_as_long_and_as_slender_as_those_of_the_painting():
    after, _ = laid(wall(scale=0.04), marks_at(30, length=0.1, aspect=5.0))
    middle = boxes_of(after).half_extents
    assert np.median(2 * middle[:, 0]) == pytest.approx(0.1 * 120, rel=0.1)
    assert np.median(middle[:, 0] / middle[:, 1]) == pytest.approx(5, rel=0.1)


def test_a_large_stroke_becomes_several_marks_in_its_place():
    strokes = wall(40, scale=0.3)
    after, parents = laid(strokes, marks_at(30))
    assert len(after) > 10 * len(strokes)
    assert (np.diff(parents) >= 0).all()
    assert set(parents) == set(range(len(strokes)))
    away = np.linalg.norm(after.means - strokes.means[parents], axis=1)
    assert away.max() <= 0.3 * SIGMAS * 1.001
    assert np.abs(after.means[:, 2]).max() < 1e-6  # within its plane


@for_each("most", [40, 100, 400])
def test_there_are_no_more_marks_than_asked_for(most):
    after, _ = laid(wall(40, scale=0.3), marks_at(30), most=most)
    assert 40 <= len(after) <= most
    nothing, parents = laid(wall().take(slice(0, 0)), marks_at(30))
    assert len(nothing) == len(parents) == 0


def test_a_mark_ends_where_another_color_begins():
    strokes, half = wall(400, 0.04), 60.0
    behind = [wall(900, 0.03, color) for color in ((0.9, 0.9, 0.9), (0.1, 0.1, 0.1))]
    sides = [one.take(one.means[:, 0] * sign > 0) for one, sign in zip(behind, (-1, 1), strict=True)]
    seen = Seen.of(bg.Gaussians.joined(sides), CAMERA)
    after, _ = lay_marks(strokes, marks_at(0, length=0.14), [seen], SIGMAS)
    boxes = boxes_of(after)
    away, reach = np.abs(boxes.centers[:, 0] - 80), boxes.half_extents[:, 0]
    near, far = (away > 2) & (away < 5), (away > 12) & (away < half)
    assert np.median(reach[near]) < 0.7 * np.median(reach[far])


def test_marks_go_back_to_their_reference_moments():
    pytest.importorskip("torch", reason="needs the extra [refine]")
    from brushgs.refine.in_style import at_reference

    strokes = replace(wall(20), ids=np.arange(20, dtype=np.int32))
    rng = np.random.default_rng(1)
    numbers = np.tile(np.float32(AT_REST), (15, 1))
    numbers[:, SHIFT] = rng.normal(size=(15, 3))
    turns = rng.normal(size=(15, 4))
    numbers[:, TURN] = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    numbers[:, SIZE] = rng.normal(0, 0.3, 15)
    pose = Pose(np.arange(15, dtype=np.int32), rng.normal(size=(15, 3)), numbers)
    back = at_reference(pose.moved(strokes, has_color=False), pose)
    np.testing.assert_allclose(back.means, strokes.means, atol=1e-5)
    np.testing.assert_allclose(back.scales, strokes.scales, rtol=1e-5)
    np.testing.assert_allclose(rotation_matrices(back.quats), rotation_matrices(strokes.quats), atol=1e-5)
