"""Detect surroundings of an object, and azimuths from which they do not hide it."""

import numpy as np

from brushgs.cameras.framing import camera_axes, frame_scene
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.first_view.sample import SIDE, Painter, thin, thinned
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

MOST_ROWS = 60_000
SOLID = 0.6  # alpha from which the depth of a pixel is that of a surface
HIDDEN = 0.1  # hidden share of the subject above which other azimuths are tried
STEPS = np.radians((-20.0, 20.0, -40.0, 40.0))  # azimuths to try, relative to the first
GAIN = 0.03  # least improvement of the hidden share
EXTENT = (0.02, 0.98)  # depth quantiles of a subject
RISE = 0.25  # most height added to a dense middle, relative to it
SLICES = 20  # of the dense middle
LEAST_SLICE = 0.01  # opacity of an added slice, relative to the mean of the middle
BEFORE = 0.3  # least distance of an occluder in front of the subject, in depths of the subject


def has_surroundings(gaussians: Gaussians, up: F64) -> bool:
    """Whether most of the visible scene lies around its middle.

    From around the scene, objects cover up to 1.5 times as many pixels around their middle as in it, a truck
    on a plaza 4.1 times as many: above 2 a scene has surroundings.
    """
    level = camera_axes(up, 0.0, 0.0).ravel().tolist()
    num_threads = num_threads_or_default(None)
    return bool(_core.has_surroundings(**gaussians.columns(), level=level, num_threads=num_threads))


def dense_middle(gaussians: Gaussians) -> F64:
    """[n, 3] centers of Gaussians in the dense middle of a scene, which was photographed from near.

    The box with 97 % of the opacity along each axis, weighted by the number of Gaussians in the voxel: the
    truck then fills two thirds of the picture. With plain opacity it is lost on the plaza.
    """
    return gaussians.means[_core.dense_rows(**gaussians.columns())].astype(np.float64)


def upright_middle(gaussians: Gaussians, up: F64) -> F64:
    """[n, 3] centers in the dense middle, and those of what rises from it: heads, branches, necks of bottles.

    The dense middle leaves out 1.5 % of the weight at its top, which may be a face. Slices above it are
    added, as long as each has a share of the opacity of those below.

    Args:
        gaussians: N Gaussians.
        up: [3] unit vector in world axes.
    """
    points, rows = dense_middle(gaussians), thinned(len(gaussians), MOST_ROWS)
    means, opacities = gaussians.means[rows].astype(np.float64), gaussians.opacities[rows]
    axes = camera_axes(up, 0.0, 0.0)
    middle = points @ axes.T
    low, high = middle.min(axis=0), middle.max(axis=0)
    places = (means @ axes.T - low) / np.where(high > low, high - low, 1.0)  # right, down, ahead
    column = np.flatnonzero(((places >= [0, -RISE, 0]) & (places <= 1)).all(axis=1))
    if not high[1] > low[1] or len(column) == 0:
        return points
    slices = ((1 - places[column, 1]) * SLICES).astype(int)  # from the ground up
    weights = np.bincount(slices, opacities[column], minlength=SLICES)
    is_empty = np.append(weights[SLICES:] < LEAST_SLICE * weights[:SLICES].mean(), True)
    top = SLICES + int(np.argmax(is_empty))
    return np.concatenate([points, means[column[(slices >= SLICES) & (slices < top)]]])


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
