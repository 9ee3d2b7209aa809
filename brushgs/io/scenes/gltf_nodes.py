"""The meshes of a glTF model and where its nodes place them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.json_file import shown
from brushgs.io.scenes.gltf_file import CURE, GltfFile
from brushgs.quats import rotation_matrices

_MAX_PLACED = 10_000  # meshes; a file of splats has a few


def placed_meshes(file: GltfFile) -> list[tuple[dict[str, Any], NDArray[np.float64]]]:
    """Each mesh of the scene with its matrix [4, 4], world from mesh; all meshes as they are without nodes.

    Raises:
        SceneError: if nodes are missing, form a ring, or place very many meshes.
    """
    roots = _roots(file)
    if roots is None:
        meshes = file.top.get("meshes")
        count = len(meshes) if isinstance(meshes, list) else 0
        return [(file.item("meshes", float(index), "the model"), np.eye(4)) for index in range(count)]
    placed = []
    # A node with its parents' matrix and the nodes above it.
    pending = [(root, np.eye(4), frozenset[float]()) for root in reversed(roots)]
    num_nodes = 0
    while pending:
        index, parent, above = pending.pop()
        node = file.item("nodes", index, "a scene or node")
        num_nodes += 1
        if index in above or num_nodes > _MAX_PLACED or len(above) > 200:
            raise SceneError(file.path, f"its nodes form a ring, or there are too many; {CURE}")
        with np.errstate(over="ignore", invalid="ignore"):
            matrix = parent @ _local_matrix(file, index, node)
        if not np.isfinite(matrix).all():
            raise SceneError(file.path, f"its nodes scale beyond all numbers; {CURE}")
        if node.get("mesh") is not None:
            if isinstance(node.get("extensions"), dict) and "EXT_mesh_gpu_instancing" in node["extensions"]:
                raise SceneError(file.path, f"repeats a mesh by EXT_mesh_gpu_instancing, not read; {CURE}")
            placed.append((file.item("meshes", node["mesh"], "a node"), matrix))
        children = node.get("children") or []
        if not isinstance(children, list):
            raise SceneError(file.path, f"children of a node must be a list, got {shown(children)}; {CURE}")
        pending.extend((child, matrix, above | {index}) for child in reversed(children))
    return placed


def _roots(file: GltfFile) -> list[Any] | None:
    """The nodes at the top of the default scene, or of all nodes; None if there are no nodes."""
    nodes = file.top.get("nodes")
    if not isinstance(nodes, list) or not nodes:
        return None
    if isinstance(file.top.get("scenes"), list) and file.top["scenes"]:
        scene = file.item("scenes", file.top.get("scene", 0.0), "the model")
        roots = scene.get("nodes") or []
    else:
        children = [
            n["children"] for n in nodes if isinstance(n, dict) and isinstance(n.get("children"), list)
        ]
        below = {child for some in children for child in some if isinstance(child, float)}
        roots = [float(index) for index in range(len(nodes)) if index not in below]
    if not isinstance(roots, list):
        raise SceneError(file.path, f"nodes of a scene must be a list, got {shown(roots)}; {CURE}")
    return roots


def _local_matrix(file: GltfFile, index: float, node: dict[str, Any]) -> NDArray[np.float64]:
    """[4, 4] of one node: its matrix, or translation, rotation (x, y, z, w) and scale."""
    if node.get("matrix") is not None:
        matrix = _numbers(file, index, node, "matrix", 16, None).reshape(4, 4).T
        if not np.array_equal(matrix[3], (0, 0, 0, 1)):
            raise SceneError(file.path, f"matrix of node {index:.0f} must be affine; {CURE}")
        return matrix
    matrix = np.eye(4)
    x, y, z, w = _numbers(file, index, node, "rotation", 4, (0, 0, 0, 1))
    if not any((x, y, z, w)):
        raise SceneError(file.path, f"rotation of node {index:.0f} must not be zero; {CURE}")
    matrix[:3, :3] = rotation_matrices(np.array([[w, x, y, z]]))[0]
    matrix[:3, :3] *= _numbers(file, index, node, "scale", 3, (1, 1, 1))
    matrix[:3, 3] = _numbers(file, index, node, "translation", 3, (0, 0, 0))
    return matrix


def _numbers(
    file: GltfFile, index: float, node: dict[str, Any], name: str, count: int, default: object
) -> NDArray[np.float64]:
    values = default if node.get(name) is None else node[name]
    # Beyond 1e18, products of a few would overflow.
    if (
        not isinstance(values, list | tuple)
        or len(values) != count
        or not all(isinstance(v, float | int) and abs(v) < 1e18 for v in values)
    ):
        raise SceneError(
            file.path, f"{name} of node {index:.0f} must be {count} numbers, got {shown(values)}; {CURE}"
        )
    return np.array(values, dtype=np.float64)
