"""Files of any format become moving scenes."""

import numpy as np

from brushgs.formats.moving.frames import open_frames
from brushgs.formats.moving.open_formula import open_formula
from brushgs.formats.scenes.read import read_scene
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.values.moving import MovingScene


def open_moving(scene: SceneFiles) -> MovingScene | None:
    """See `brushgs.formats.moving.open_moving`."""
    source = SceneSource.of(scene)
    return open_formula(source) or open_frames(source)


def load_moving(scene: SceneFiles, moments_per_second: float | None = None) -> MovingScene:
    """See `brushgs.formats.moving.load_moving`."""
    source = SceneSource.of(scene, moments_per_second=moments_per_second)
    moving = open_moving(source)
    if moving is not None:
        return moving
    gaussians, notes = read_scene(source)
    resting = np.ones(len(gaussians), np.bool_)
    return MovingScene(0.0, True, lambda time: gaussians, resting=resting, notes=notes)
