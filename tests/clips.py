"""A small scene that moves: a wall that rests, and before it a body that goes to the right and turns."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.clip import Clip
from brushgs.values.quats import quat_products, rotation_matrices
from tests.passes.scenes import gaussians_at
from tests.scenes import save_upright

DURATION = 4 / 24  # seconds: five frames of a folder
NUM_WALL, NUM_BODY = 220, 120
WAY, ANGLE = np.array([0.9, 0.0, 0.0]), 1.2  # of the body, over the whole clip


def first_moment():
    """Colored patches on a wall, and a body that is red and green."""
    g = np.random.default_rng(5)
    wall = np.column_stack([g.uniform(-1.5, 1.5, (NUM_WALL, 2)), g.normal(0.6, 0.02, NUM_WALL)])
    body = g.normal(0, (0.28, 0.16, 0.1), (NUM_BODY, 3)) - (0.45, 0, 0.4)
    of_body = np.where(body[:, :1] > -0.45, [[0.85, 0.15, 0.1]], [[0.1, 0.6, 0.2]])
    colors = np.concatenate([0.35 + 0.25 * np.sin(3 * wall), of_body])
    scales = np.concatenate([np.full((NUM_WALL, 3), (0.2, 0.2, 0.02)), np.full((NUM_BODY, 3), 0.07)])
    return gaussians_at(np.concatenate([wall, body]), scales, colors, dtype=np.float32)


def moving_scene(duration=DURATION):
    """The scene as a function of time."""
    start = first_moment()
    center = start.means[NUM_WALL:].mean(axis=0).astype(float)
    resting = np.arange(len(start)) < NUM_WALL

    def at(time):
        share = time / duration if duration else 0.0
        turn = np.array([np.cos(ANGLE * share / 2), 0, 0, np.sin(ANGLE * share / 2)])
        means, quats = start.means.copy(), start.quats.copy()
        body = start.means[NUM_WALL:].astype(float) - center
        means[NUM_WALL:] = body @ rotation_matrices(turn[None])[0].T + center + share * WAY
        quats[NUM_WALL:] = quat_products(np.tile(turn, (NUM_BODY, 1)), start.quats[NUM_WALL:])
        return replace(start, means=means, quats=quats)

    return bg.MovingScene(duration, True, at, resting=resting)


def save_clip(folder):
    """The five frames as files, one a moment, with up stated."""
    folder.mkdir()
    scene = moving_scene()
    for index in range(5):
        save_upright(scene.at(index / 24), folder / f"frame_{index}.ply")
    return folder


def clip_of(folder, **options):
    """The clip in a folder that `save_clip` wrote, one frame a moment."""
    return Clip(bg.load_moving(folder), bg.ClipConfig(fps=24, **options), SceneSource.of(folder))
