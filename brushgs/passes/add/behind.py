"""Fill what a photograph hides: Gaussians behind the edges of a scene predicted from it.

When the camera sways, gaps open between near and far surfaces, and at the borders of the picture. They are
filled by continuing the nearest surface behind, in its colors and at its depth (layered depth images, Shade
et al. 1998).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, grey_dilation

from brushgs.rendering.plain import plain_views
from brushgs.values.arrays import F32, F64, Mask
from brushgs.values.camera import Camera, Photograph
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import in_colors

SIDE = 240  # pixels of the longer side of the picture for finding gaps
DEEPER = 1.1  # minimum depth ratio of the surface behind to the surface in front
PAINTED = 0.5  # minimum alpha of a surface
NEAREST, FARTHEST = 0.02, 0.98  # quantiles of the depths that count as nearest and farthest
WIDEST = 0.35  # maximum width of a gap, share of the longer side
OVERLAP, THIN = 0.8, 0.05  # sizes of a Gaussian in pixels, across and along the view
BLUR = 2.0  # pixels, blur of the colors
OPACITY = 0.99


def behind(gaussians: Gaussians, photograph: Photograph, angle: float) -> Gaussians:
    """Gaussians behind the edges of a scene.

    Args:
        gaussians: the scene.
        photograph: the photograph that it was predicted from.
        angle: largest turn of the swaying camera to each side, radians.

    Returns:
        One Gaussian for each pixel of a small picture at which a gap may open, view-independent; possibly
        none.
    """
    small = photograph.camera.in_side(SIDE)
    seen = plain_views(gaussians, [small], depth=True).frames[0]
    assert seen.depth is not None
    depth, is_painted = seen.depth.astype(np.float64), seen.alpha > PAINTED
    if not is_painted.any():
        return gaussians.take(np.zeros(0, np.intp))
    gap = _widest_gap(depth[is_painted], small, photograph, angle)
    camera, border = _with_border(small, gap), ((gap, gap), (gap, gap))
    depth, is_painted = np.pad(depth, border), np.pad(is_painted, border)
    colors = np.pad(seen.straight_colors(), (*border, (0, 0)))
    depth = np.where(is_painted, depth, 0)
    is_front = grey_dilation(depth, size=2 * gap + 1) > DEEPER * np.maximum(depth, 1e-9)
    rows, columns = _nearest(is_painted & ~is_front)
    far = np.maximum(depth[rows, columns], DEEPER * depth)
    colors = _blurred(colors[rows, columns])
    return _on_rays(gaussians, camera, far, colors, is_front | ~is_painted)


def _widest_gap(depths: F64, camera: Camera, photograph: Photograph, angle: float) -> int:
    """Largest displacement of near against far surfaces as the camera sways, pixels."""
    near, far = np.quantile(depths, (NEAREST, FARTHEST))
    pivot = float(camera.viewmat[2, :3] @ photograph.pivot + camera.viewmat[2, 3])
    moved = (
        float(camera.K[0, 0]) * np.sin(angle) * max(pivot, 0.0) * (1 / max(near, 1e-9) - 1 / max(far, 1e-9))
    )
    return int(np.ceil(min(moved + 1, WIDEST * max(camera.width, camera.height))))


def _with_border(camera: Camera, border: int) -> Camera:
    """The camera with a border of `border` pixels added around its picture."""
    K = camera.K.copy()
    K[:2, 2] += border
    return replace(camera, K=K, width=camera.width + 2 * border, height=camera.height + 2 * border)


def _nearest(mask: Mask) -> NDArray[np.int32]:
    """[2, H, W] row and column of the nearest pixel in a mask; of the pixel itself if the mask is empty."""
    if not mask.any():
        return np.indices(mask.shape, np.int32)
    found: NDArray[np.int32] = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    return found


def _blurred(colors: F32) -> F32:
    return np.stack([gaussian_filter(colors[..., channel], BLUR) for channel in range(3)], axis=-1)


def _on_rays(like: Gaussians, camera: Camera, depth: F64, colors: F32, mask: Mask) -> Gaussians:
    """Thin, round Gaussians that face the camera, one for each pixel of a mask, at these depths."""
    rows, columns = np.nonzero(mask & (depth > 0))
    z, num = depth[rows, columns], len(rows)
    rays = np.stack([columns + 0.5, rows + 0.5, np.ones(num)], axis=1) @ np.linalg.inv(camera.K).T
    rotation = camera.viewmat[:3, :3]
    means = (rays * z[:, None] - camera.viewmat[:3, 3]) @ rotation
    sides = np.stack([z / camera.K[0, 0], z / camera.K[1, 1], THIN * z / camera.K[0, 0]], axis=1)
    dtype = like.means.dtype
    blank = Gaussians(
        means=means.astype(dtype),
        quats=np.broadcast_to(quats_of(rotation.T[None]), (num, 4)).astype(dtype),
        scales=(OVERLAP * sides).astype(dtype),
        opacities=np.full(num, OPACITY, dtype),
        sh=np.zeros((num, 1, 3), dtype),
    )
    return in_colors(blank, colors[rows, columns])
