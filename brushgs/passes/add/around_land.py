"""What surrounds land seen from the air, in the manner of paintings: strokes on a sphere around it.

Such land has no table to stand on. The map of a painting is laid on the sphere around the nadir, by
stereographic projection: it keeps angles, so marks run as in the painting. In the first view it fills the
picture, upright. Beyond its upper and lower border it is mirrored.
"""

from collections.abc import Sequence

import numpy as np

from brushgs.cameras.framing import camera_axes
from brushgs.core.native import core as _core
from brushgs.passes.add.backdrop import (
    BEYOND_EYE,
    RADIUS,
    REACH,
    SIZE_JITTER,
    THICKNESS,
    TONED,
    Backdrop,
    mean_lab,
    seen_by_any,
    sphere,
)
from brushgs.passes.add.stage_map import Manner, Places, map_angles, map_colors, map_contrasts
from brushgs.passes.add.stage_paint import MARKED_OVERLAP, MOST_SEEN, PROBES
from brushgs.passes.extent import robust_frame
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import C0

PLAIN_SIZE = 0.05  # of strokes without marks, in shorter sides of the picture
HIGHEST = 0.9  # sine of the elevation up to which the projection is used: at the zenith it has no end


def around_land(
    manner: Manner,
    gaussians: Gaussians,
    first_view: FirstView,
    cameras: Sequence[Camera],
    *,
    seed: int = 0,
) -> Gaussians:
    """Strokes all around land, only those that show in some camera.

    Args:
        manner: of paintings.
        gaussians: the land.
        first_view: of it, for its up axis.
        cameras: of the job, at least one; the map fills the picture of the first. The share of colors that
            is not of maps is that of a toned ground.
        seed: of places and jitter.

    Returns:
        Flat strokes that face the land, without view-dependent color, in the dtype of the scene.
    """
    center, radius = robust_frame(gaussians.means)
    first, own = cameras[0], TONED.lab(mean_lab(gaussians))
    away = max(float(np.linalg.norm(camera.position - center)) for camera in cameras)
    radius = max(RADIUS * radius, BEYOND_EYE * away)
    g = np.random.default_rng([seed, 11])
    axes = camera_axes(first_view.up, 0.0, 0.0)  # right, down, forward

    shorter = min(first.width / first.K[0, 0], first.height / first.K[1, 1])
    behind = 1 + float(np.linalg.norm(first.position - center)) / radius  # distance of the far side, in radii
    side = shorter * radius * behind  # of the picture there
    size = side * PLAIN_SIZE ** (1 - manner.marks) * manner.size**manner.marks
    aspect = manner.aspect**manner.marks
    reach = REACH * np.sqrt(aspect) / _core.STROKE_SIGMAS
    probes = center + radius * (sphere(PROBES, g)[0] @ axes)
    shown = float(seen_by_any(probes, np.full(PROBES, reach * size), cameras).mean())
    count = 4 * np.pi * radius**2 * MARKED_OVERLAP / size**2
    more = max(float(np.sqrt(shown * count / MOST_SEEN)), 1.0)
    size, count = size * more, round(count / more**2)

    outward, _ = sphere(count, g)
    outward = outward[seen_by_any(center + radius * (outward @ axes), np.full(count, reach * size), cameras)]
    places, right, up = _laid(manner, outward, axes, first, behind)
    noise = g.normal(0, 1, (len(outward), 5))
    lab = map_colors(manner, places, np.broadcast_to(own, (len(outward), 3)))
    jitter = np.array([manner.jitter[0], manner.jitter[1], manner.jitter[1]])
    lab += noise[:, :3] * jitter * map_contrasts(manner, places)[:, None]
    angles, clear = map_angles(manner, places, noise[:, 3])
    along = np.cos(angles)[:, None] * right - np.sin(angles)[:, None] * up
    along *= np.where((along * right).sum(axis=1) < 0, -1, 1)[:, None]
    along = _unit(clear * along + (1 - clear) * right)
    frames = np.stack([along @ axes, np.cross(outward, along) @ axes, outward @ axes], axis=2)
    frames[:, :, 2] *= np.sign(np.linalg.det(frames))[:, None]
    sizes = size / _core.STROKE_SIGMAS * np.exp(SIZE_JITTER * noise[:, 4:])
    return Gaussians(
        center + radius * (outward @ axes),
        quats_of(frames),
        sizes * (np.sqrt(aspect), 1 / np.sqrt(aspect), THICKNESS),
        np.full(len(outward), Backdrop.opacity),
        ((np.clip(rgb_of_oklab(lab), 0, 1) - 0.5) / C0)[:, None],
    ).astype(gaussians.means.dtype.type)


def _laid(manner: Manner, outward: F64, axes: F64, first: Camera, behind: float) -> tuple[Places, F64, F64]:
    """Places in the maps of directions [n, 3], and [n, 3] which way is right and up in the maps there."""
    height, width = manner.parts[0].stage.colors.shape[:2]
    forward, below = axes @ first.viewmat[2, :3], axes @ first.viewmat[1, :3]
    ahead = _unit(((forward - below) * (1, 0, 1))[None])[0]  # level; one of both is not upright
    aside = np.cross((0, 1, 0), ahead)
    from_zenith = 1 + np.clip(outward[:, 1], -HIGHEST, 1)  # down is the second axis
    points = np.stack([outward @ aside, outward @ ahead], axis=1) / from_zenith[:, None]
    middle = float(forward @ ahead) / (1 + max(float(forward[1]), -HIGHEST))
    # Of the angle to the nadir: d tan(t / 2) / dt = (1 + tan(t / 2)^2) / 2.
    span = 0.5 * (1 + middle**2) * behind * first.height / first.K[1, 1]
    rows = (0.5 - (points[:, 1] - middle) / span) % 2
    places = Places(points[:, 0] / (span * width / height), 1 - np.abs(rows - 1))
    # Which way a step in the plane goes on the sphere: the derivative of the inverse projection.
    squares, down = 1 + (points**2).sum(axis=1)[:, None], np.array([0.0, 1.0, 0.0])
    right, up = (
        2 * way / squares - (2 * points[:, k : k + 1] / squares) * (outward + down)
        for k, way in enumerate((aside, ahead))
    )
    right, up = (_unit(one - (one * outward).sum(axis=1, keepdims=True) * outward) for one in (right, up))
    return places, right, up * np.where(rows > 1, -1, 1)[:, None]


def _unit(ways: F64) -> F64:
    return np.asarray(ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9))
