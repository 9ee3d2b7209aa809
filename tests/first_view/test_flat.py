"""Flat things are seen from where their face shows; land from the air as it was."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.first_view import find_first_view
from brushgs.first_view.front import wrapped
from tests.first_view.scenes import about, gaussians, joined, moved, statue, statue_view
from tests.kit.for_each import for_each

LYING = about((1, 0, 0), -90)  # what faces -z then faces up, which is -y


def plate(depth: float = 0.03) -> bg.Gaussians:
    """A disc of radius 1 with a picture towards -z and a plain back."""
    rng = np.random.default_rng(0)
    front, back = (rng.uniform(-1, 1, (count, 2)) for count in (9000, 3000))
    front, back = (places[(places**2).sum(axis=1) < 1] for places in (front, back))
    stones = rng.uniform(0, 1, (8, 8, 3))
    colors = stones[*((front.T + 1) * 4).astype(int)]
    face = np.column_stack([front, -0.5 * depth * (1 + colors.mean(axis=1))])
    rear = np.column_stack([back, np.full(len(back), 0.5 * depth)])
    plain = gaussians(rear, np.tile([0.0, 0, 1], (len(rear), 1)), 0.03, (0.5, 0.5, 0.5))
    return joined(gaussians(face, np.tile([0.0, 0, -1], (len(face), 1)), 0.015, colors), plain)


def comb() -> bg.Gaussians:
    """A comb, long in x, with teeth along y: alike from both sides, and in its own plane a mirror image."""
    rng = np.random.default_rng(0)
    means = rng.uniform((-1, -0.25, -0.02), (1, 0.3, 0.02), (12000, 3))
    means = means[(means[:, 1] < 0) | (np.floor(means[:, 0] * 30) % 2 == 0)]
    means[:, 2] = np.where(rng.random(len(means)) < 0.5, -0.02, 0.02)
    colors = np.clip(np.array((0.55, 0.3, 0.12)) + rng.normal(0, 0.08, (len(means), 1)), 0, 1)
    normals = np.column_stack([np.zeros((len(means), 2)), np.sign(means[:, 2])])
    return gaussians(means, normals, 0.012, colors)


def seen_towards(scene: bg.Gaussians) -> np.ndarray:
    """[3] direction from the scene to the camera of its first view."""
    camera = frame_scene(find_first_view(scene, up="-y"), width=64, height=48)
    return -camera.viewmat[2, :3]


@for_each("degrees", [0, 90, 215])
@for_each(("scene", "least"), [(plate(0.03), 0.85), (plate(0.12), 0.85), (comb(), -1)])
def test_what_stands_shows_its_picture_or_is_at_least_not_seen_edge_on(scene, least, degrees):
    turn = about((0, 1, 0), degrees)
    towards = seen_towards(moved(scene, rotation=turn)) @ turn @ (0, 0, -1)
    assert abs(towards) > 0.85
    assert towards > least


@for_each("degrees", [0, 40])
@for_each("made", [plate, comb])
def test_what_lies_is_seen_from_steeply_above(made, degrees):
    scene = moved(made(), rotation=about((0, 1, 0), degrees) @ LYING)
    view = find_first_view(scene, up="-y")
    assert 55 <= np.degrees(view.elevation) <= 70
    if made is comb:  # its length lies across the picture
        right = frame_scene(view, width=64, height=48).viewmat[0, :3]
        assert abs(right @ about((0, 1, 0), degrees) @ (1, 0, 0)) > 0.9


def test_what_is_not_flat_keeps_its_front():
    view = find_first_view(statue(), up="-y")
    assert view.elevation == pytest.approx(np.radians(15))
    assert abs(wrapped(view.front - statue_view().front)) < 1e-6
