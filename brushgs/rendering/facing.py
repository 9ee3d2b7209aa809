"""Fade boxes by their orientation to the camera.

Silhouette lines show only edge-on; one-sided strokes, such as those of a table, fade when seen from behind.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64, smoothstep
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

# Sines of the angles from edge-on at which a silhouette line starts to fade and is gone. On a round object it
# then lies 0.8 and 4 % of the radius inside the new silhouette.
BOUNDS = (0.105, 0.21)
BEHIND = (0.0, 0.087)  # the same for one-sided strokes, for the angle behind their plane: 5 degrees


def facing(points: NDArray[np.floating], normals: NDArray[np.floating], camera: Camera) -> F64:
    """[P] sine of the angle between the surface and the view: |view direction . normal|.

    Args:
        points: [P, 3] world units.
        normals: [P, 3] of the surface; shorter vectors lower the result, zero vectors give 0.
        camera: the view.
    """
    return np.abs(_sines(points, normals, camera))


def _sines(points: NDArray[np.floating], normals: NDArray[np.floating], camera: Camera) -> F64:
    """`facing` with sign: > 0 for surfaces seen from behind."""
    rays = points - camera.position
    lengths = np.maximum(np.linalg.norm(rays, axis=1), 1e-300)
    return np.asarray((rays * normals).sum(axis=1) / lengths, np.float64)


def fade_by_facing(
    boxes: Boxes,
    camera: Camera,
    strokes: Gaussians,
    normals: NDArray[np.floating],
    *,
    is_one_sided: bool = False,
) -> Boxes:
    """Fade boxes smoothly as their surface turns toward the camera or, one-sided, away from it.

    Args:
        boxes: M boxes of these strokes.
        camera: the view.
        strokes: N strokes.
        normals: [N, 3] of their surface, length at most 1; 0 for strokes that never fade.
        is_one_sided: fade strokes seen from behind instead.

    Raises:
        ValueError: if there is not one normal for each stroke.
    """
    if normals.shape != (len(strokes), 3):
        wanted = [len(strokes), 3]
        raise ValueError(f"fade_by_facing: normals must have shape {wanted}, got {list(normals.shape)}")
    shares = facing_shares(strokes.means[boxes.ids], normals[boxes.ids], camera, is_one_sided=is_one_sided)
    return replace(boxes, opacities=(boxes.opacities * shares).astype(boxes.opacities.dtype))


def facing_shares(
    points: NDArray[np.floating],
    normals: NDArray[np.floating],
    camera: Camera,
    *,
    is_one_sided: bool = False,
) -> F64:
    """[P] factors on the opacity of strokes at points [P, 3] with normals [P, 3]."""
    sines = (_sines if is_one_sided else facing)(points, normals, camera)
    low, high = BEHIND if is_one_sided else BOUNDS
    return np.asarray(1 - smoothstep((sines - low) / (high - low)))
