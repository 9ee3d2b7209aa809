"""The meshes of a glTF model and where its nodes place them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.gltf_file import CURE, GltfFile
from brushgs.io.gltf_nodes import placed_nodes


def placed_meshes(file: GltfFile) -> list[tuple[dict[str, Any], NDArray[np.float64]]]:
    """Each mesh of the scene with its matrix [4, 4], world from mesh; all meshes as they are without nodes.

    Raises:
        SceneError: if nodes are missing, form a ring, or place very many meshes.
    """
    nodes = placed_nodes(file)
    if nodes is None:
        meshes = file.top.get("meshes")
        count = len(meshes) if isinstance(meshes, list) else 0
        return [(file.item("meshes", float(index), "the model"), np.eye(4)) for index in range(count)]
    placed = []
    for some in nodes:
        if some.node.get("mesh") is None:
            continue
        if (
            isinstance(some.node.get("extensions"), dict)
            and "EXT_mesh_gpu_instancing" in some.node["extensions"]
        ):
            raise SceneError(file.path, f"repeats a mesh by EXT_mesh_gpu_instancing, not read; {CURE}")
        placed.append((file.item("meshes", some.node["mesh"], "a node"), some.matrix))
    return placed
