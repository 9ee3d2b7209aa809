"""The node of a 3D file that is the painted scene: its coordinates are those of the scene."""

import re

SCENE_NODE = "brushgs_scene"
_SCENE_NAME = re.compile(rf"{SCENE_NODE}([._]\d+)?")  # 3D programs number what has the name of another


def is_scene_name(name: object) -> bool:
    """Whether a node of this name is the painted scene."""
    return isinstance(name, str) and _SCENE_NAME.fullmatch(name) is not None
