"""Open the film of a moving scene for a command."""

from argparse import Namespace
from typing import TYPE_CHECKING

from brushgs.cli.configs import clip_config

if TYPE_CHECKING:
    from brushgs.options.scene_source import SceneSource
    from brushgs.pipeline.clip import Clip


def open_clip(args: Namespace, scene: "SceneSource") -> "Clip | None":
    """The film of a moving scene; None for a still one, or one moment.

    Raises:
        ValueError: see `clip_config`.
        SceneError: if a file cannot be used.
    """
    from brushgs.formats.moving import open_moving

    moving = None if scene.time is not None else open_moving(scene)
    config = clip_config(args, scene, is_moving=moving is not None)
    if moving is None or config is None:
        return None
    from brushgs.pipeline.clip import Clip

    return Clip(moving, config, scene)
