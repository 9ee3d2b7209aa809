"""The nodes of a glTF model: how they hang together, and where they stand."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.gltf_file import CURE, GltfFile
from brushgs.io.json_file import shown
from brushgs.values.quats import rotation_matrices

_MAX_NODES, _MAX_DEPTH = 10_000, 200  # a model with what is read here has a few
# Of the fields that place a node, where it does not have them.
_AT_REST: dict[str, tuple[float, ...]] = {
    "matrix": tuple(np.eye(4).ravel()),
    "rotation": (0, 0, 0, 1),
    "scale": (1, 1, 1),
    "translation": (0, 0, 0),
}


@dataclass(frozen=True)
class PlacedNode:
    """A node where the scene has it.

    Attributes:
        node: its JSON object.
        chain: numbers of the nodes from the top of the scene down to this one.
        matrix: [4, 4], world from node, as the nodes stand without animations.
    """

    node: dict[str, Any]
    chain: tuple[float, ...]
    matrix: NDArray[np.float64]


def placed_nodes(file: GltfFile) -> Iterator[PlacedNode] | None:
    """The nodes of the default scene, or of all that there are, parents first; None if there are none.

    Raises:
        SceneError: while they are taken, if nodes are missing, form a ring, or are very many.
    """
    roots = _roots(file)
    return None if roots is None else _walk(file, roots)


def _walk(file: GltfFile, roots: list[Any]) -> Iterator[PlacedNode]:
    # A node with its parents' matrix and the nodes above it.
    pending: list[tuple[Any, NDArray[np.float64], tuple[float, ...]]] = [
        (root, np.eye(4), ()) for root in reversed(roots)
    ]
    num_nodes = 0
    while pending:
        index, parent, above = pending.pop()
        node = file.item("nodes", index, "a scene or node")
        num_nodes += 1
        if index in above or num_nodes > _MAX_NODES or len(above) > _MAX_DEPTH:
            raise SceneError(file.path, f"its nodes form a ring, or there are too many; {CURE}")
        with np.errstate(over="ignore", invalid="ignore"):
            matrix = parent @ local_matrix(file, index, node)
        if not np.isfinite(matrix).all():
            raise SceneError(file.path, f"its nodes scale beyond all numbers; {CURE}")
        yield PlacedNode(node, (*above, index), matrix)
        children = node.get("children") or []
        if not isinstance(children, list):
            raise SceneError(file.path, f"children of a node must be a list, got {shown(children)}; {CURE}")
        pending.extend((child, matrix, (*above, index)) for child in reversed(children))


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


def local_matrix(file: GltfFile, index: float, node: dict[str, Any]) -> NDArray[np.float64]:
    """[4, 4] of one node: its matrix, or translation, rotation (x, y, z, w) and scale."""
    if node.get("matrix") is not None:
        matrix = node_numbers(file, index, node, "matrix").reshape(4, 4).T
        if not np.array_equal(matrix[3], (0, 0, 0, 1)):
            raise SceneError(file.path, f"matrix of node {index:.0f} must be affine; {CURE}")
        return matrix
    matrix = np.eye(4)
    x, y, z, w = node_numbers(file, index, node, "rotation")
    if not any((x, y, z, w)):
        raise SceneError(file.path, f"rotation of node {index:.0f} must not be zero; {CURE}")
    matrix[:3, :3] = rotation_matrices(np.array([[w, x, y, z]]))[0]
    matrix[:3, :3] *= node_numbers(file, index, node, "scale")
    matrix[:3, 3] = node_numbers(file, index, node, "translation")
    return matrix


def node_numbers(file: GltfFile, index: float, node: dict[str, Any], name: str) -> NDArray[np.float64]:
    """The numbers of a field that places a node; those of the standard where it has none."""
    values = _AT_REST[name] if node.get(name) is None else node[name]
    count = len(_AT_REST[name])
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
