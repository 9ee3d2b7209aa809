"""Detect surroundings of an object, and azimuths from which they do not hide it."""

import numpy as np

from brushgs.cameras.framing import (
    camera_axes,
    frame_scene,
    subject,
    weighted_quantiles,
)
from brushgs.first_view.sample import SIDE, Painter, camera_around, thin, thinned
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

MOST_ROWS = 60_000
NUM_VIEWS = 4  # around the scene
ELEVATION = np.radians(15.0)
SEEN, SOLID = 0.5, 0.6  # alpha from which a pixel is covered, and from which its depth is that of a surface
# Covered pixels around the middle over those of the middle, median over views: objects have up to 1.5, a
# truck on a plaza 4.1.
MOST_AROUND = 2.0
VOXELS = 64  # along the diagonal of the scene
# Share of density-weighted opacity cut at each end of an axis. The truck then fills two thirds of the
# picture; with plain opacity it is lost on the plaza.
DENSE_TAIL = 0.015
HIDDEN = 0.1  # hidden share of the subject above which other azimuths are tried
STEPS = np.radians((-20.0, 20.0, -40.0, 40.0))  # azimuths to try, relative to the first
GAIN = 0.03  # least improvement of the hidden share
EXTENT = (0.02, 0.98)  # depth quantiles of a subject
BEFORE = 0.3  # least distance of an occluder in front of the subject, in depths of the subject


def has_surroundings(gaussians: Gaussians, up: F64) -> bool:
    """Whether most of the visible scene lies around its middle."""
    whole, _ = subject(gaussians, is_whole=True)
    middle, spans_more = subject(gaussians)
    if not spans_more:
        return False
    low, high = whole.min(axis=0), whole.max(axis=0)
    center, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    scene = thin(gaussians, np.arange(len(gaussians)), MOST_ROWS)
    inner = scene.take(_within(scene, middle))
    ratios, paint = [], Painter()
    for view in range(NUM_VIEWS):
        camera = camera_around(center, radius, camera_axes(up, 2 * np.pi * view / NUM_VIEWS, ELEVATION))
        covered, covered_by_inner = ((paint(g, camera).alpha > SEEN).sum() for g in (scene, inner))
        ratios.append((covered - covered_by_inner) / max(covered_by_inner, 1))
    return bool(np.median(ratios) > MOST_AROUND)


def dense_middle(gaussians: Gaussians) -> F64:
    """[n, 3] centers of Gaussians in the dense middle of a scene, which was photographed from near.

    The box with most of the opacity along each axis, weighted by the number of Gaussians in the voxel.
    """
    whole, _ = subject(gaussians, is_whole=True)
    rows = np.flatnonzero(_within(gaussians, whole))
    rows = rows[thinned(len(rows), MOST_ROWS)]
    means = gaussians.means[rows].astype(np.float64)
    low = whole.min(axis=0)
    voxel = float(np.linalg.norm(whole.max(axis=0) - low)) / VOXELS
    cells = np.floor((means - low) / max(voxel, 1e-300)).astype(np.int64)
    keys = (cells[:, 0] * (VOXELS + 1) + cells[:, 1]) * (VOXELS + 1) + cells[:, 2]
    _, places, counts = np.unique(keys, return_inverse=True, return_counts=True)
    weights = gaussians.opacities[rows].astype(np.float64) * counts[places]
    at = (DENSE_TAIL, 1 - DENSE_TAIL)
    low, high = np.transpose([weighted_quantiles(column, weights, at) for column in means.T])
    return np.asarray(means[((means >= low) & (means <= high)).all(axis=1)])


def clear_azimuth(gaussians: Gaussians, view: FirstView) -> float:
    """The azimuth nearest to the view's from which the subject is not hidden by its surroundings."""
    scene = thin(gaussians, np.arange(len(gaussians)), MOST_ROWS)
    inner = scene.take(_within(scene, view.points))
    best, least = view.azimuth, np.inf
    for step in (0.0, *STEPS):
        azimuth = view.azimuth + step
        share = _hidden_share(scene, inner, frame_scene(view, width=SIDE, height=SIDE, azimuth=azimuth))
        if share < least - GAIN:
            best, least = azimuth, share
        if least < HIDDEN:
            break
    return float(best)


def _within(gaussians: Gaussians, points: F64) -> Mask:
    """Mask of the Gaussians in the box of points."""
    low, high = points.min(axis=0), points.max(axis=0)
    return np.asarray(((gaussians.means >= low) & (gaussians.means <= high)).all(axis=1))


def _hidden_share(scene: Gaussians, inner: Gaussians, camera: Camera) -> float:
    """Share of the subject's pixels with an occluder in front."""
    paint = Painter(depth=True)
    frame, alone = paint(scene, camera), paint(inner, camera)
    assert frame.depth is not None
    assert alone.depth is not None
    depths = inner.means @ camera.viewmat[2, :3] + camera.viewmat[2, 3]
    nearest, farthest = np.quantile(depths, EXTENT) if len(depths) else (0.0, 0.0)
    covered = alone.alpha > SOLID
    hidden = covered & (frame.depth < alone.depth - BEFORE * (farthest - nearest))
    return float(hidden.sum() / max(covered.sum(), 1))
