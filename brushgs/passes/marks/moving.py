"""Move paint over one moment of a moving scene to another, with the Gaussians around it."""

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from scipy.spatial import cKDTree

from brushgs.rendering.motion import Pose
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import Overpaint, Patches
from brushgs.values.quats import rotation_matrices, turn_forms

AROUND = 24  # nearest Gaussians whose motion a mark follows
VISIBLE = 0.1  # opacity below which Gaussians are ignored: their positions, given by a formula, mean little
STIFF = 1e-3  # regularisation, as a share of the squared distances, for directions without Gaussians
P = TypeVar("P", bound=Patches)


def carried(overpaint: Overpaint, before: Gaussians, after: Gaussians) -> Overpaint:
    """Move the paint over one moment to another.

    Each mark and patch takes the rigid motion that best fits that of the visible Gaussians nearest to it.

    Args:
        overpaint: at the moment of `before`.
        before: N Gaussians.
        after: the same rows at the other moment.
    """
    rows = np.flatnonzero(before.opacities >= VISIBLE)
    if not len(rows):
        return overpaint
    tree = cKDTree(before.means[rows].astype(np.float64))
    kinds: dict[str, Any] = {}
    for name in ("marks", "erased", "combs", "density"):
        patches: Patches | None = getattr(overpaint, name)
        if patches is not None and len(patches):
            near = np.asarray(tree.query(patches.means, k=min(AROUND, len(rows)))[1])
            near = rows[near.reshape(len(patches), -1)]
            kinds[name] = _moved(patches, before.means[near], after.means[near])
    return replace(overpaint, **kinds)


def _moved(patches: P, before: Any, after: Any) -> P:
    """Patches after the least-squares rigid motions between points [N, k, 3]."""
    x, y = before.astype(np.float64), after.astype(np.float64)
    from_, to = x.mean(axis=1), y.mean(axis=1)
    x, y = x - from_[:, None], y - to[:, None]
    products = np.einsum("nki,nkj->nij", y, x)
    spread = STIFF * np.square(x).sum(axis=(1, 2)) + 1e-300
    products += spread[:, None, None] * np.eye(3)
    turns = rotation_matrices(np.linalg.eigh(turn_forms(products))[1][:, :, -1])

    def turned(vectors: F64) -> F64:
        return np.asarray(np.einsum("nij,nj->ni", turns, vectors))

    columns = {
        name: turned(getattr(patches, name)) for name, (_, limits) in patches.COLUMNS.items() if not limits
    }
    return replace(patches, means=to + turned(patches.means - from_), **columns)


def tied(marks: Gaussians, normals: Array, strokes: Gaussians, pose: Pose) -> tuple[Gaussians, Array]:
    """Marks tied to the nearest strokes of the scene by id, and their normals, both at rest.

    Args:
        marks: as strokes, at the moment of the pose.
        normals: [N, 3] of the marks.
        strokes: of the scene at rest, with ids.
        pose: of the strokes at the moment.
    """
    moved = pose.moved(strokes)
    rows = np.flatnonzero(moved.opacities >= min(VISIBLE, float(moved.opacities.max(initial=0))))
    if strokes.ids is None or not len(rows):
        return marks, normals
    nearest = rows[cKDTree(moved.means[rows]).query(marks.means)[1]]
    marks = replace(marks, ids=strokes.ids[nearest])
    return pose.at_rest(marks), pose.turned(marks, normals, is_back=True)
