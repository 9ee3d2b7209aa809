"""Writes glTF models with cameras, as exporters do."""

from pathlib import Path
from typing import Any

import numpy as np

from tests.io.scenes.gltf_maker import Model

LENS = {"yfov": 0.8, "aspectRatio": 1.5, "znear": 0.1}


class CameraModel(Model):
    """A model whose nodes hold cameras; nodes that no other names as its child stand at the top."""

    def __init__(self) -> None:
        super().__init__()
        self.top = {**self.top, "extensionsUsed": [], "nodes": [], "cameras": [], "animations": []}

    def node(self, name: str, **fields: object) -> int:
        """Adds a node; returns its number."""
        self.top["nodes"].append({"name": name, **fields})
        return len(self.top["nodes"]) - 1

    def camera(self, name: str, lens: dict[str, Any] = LENS, **fields: object) -> int:
        """Adds a node with a camera of its own; returns its number."""
        self.top["cameras"].append({"type": "perspective", "perspective": lens})
        return self.node(name, camera=len(self.top["cameras"]) - 1, **fields)

    def animate(self, node, part, times, values, interpolation="LINEAR", **target) -> dict[str, Any]:
        """Adds an animation with one channel; returns it."""
        inputs = self.accessor(np.array(times, np.float32)[:, None])
        outputs = self.accessor(np.asarray(values, np.float32).reshape(len(values), -1))
        sampler = {"input": inputs, "output": outputs, "interpolation": interpolation}
        channel = {"sampler": 0, "target": {"node": node, "path": part, **target}}
        self.top["animations"].append({"channels": [channel], "samplers": [sampler]})
        return self.top["animations"][-1]


def moving_model() -> CameraModel:
    """A camera that moves for two seconds on an arm that turns, with a scene and a second camera."""
    model = CameraModel()
    model.camera("Still", translation=[0, 1, 5])
    shot = model.camera("Shot", translation=[0, 0, 4], rotation=[0.1, 0.2, 0, 0.9])
    arm = model.node("Arm", children=[shot], scale=[2, 2, 2])
    model.node("brushgs_scene", rotation=[2**-0.5, 0, 0, 2**-0.5], scale=[3, 3, 3])
    model.animate(shot, "translation", [0.5, 1.0, 2.5], [[0, 0, 4], [1, 0, 4], [1, 2, 4]])
    quarter = [[0, 0, 0, 1], [0, 2**-0.5, 0, 2**-0.5]]
    model.animate(arm, "rotation", [0.5, 2.5], quarter)
    return model


def write(model: CameraModel, folder: Path, name: str = "move.glb") -> Path:
    """The model as a file."""
    return model.write(folder / name)
