"""Noise in space, evaluated at the surface points of pixels, so that it moves with the surfaces.

The sizes of its octaves double. Octaves are weighted smoothly by their size in the picture, so that the grain
of the noise is about the same on near and far surfaces, and in pictures of all sizes.
Source: Perlin 2002 (Improving noise); Benard et al. 2009 (Dynamic solid textures: octaves by their size in
the picture).
"""

from dataclasses import dataclass

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera

FINEST = 0.012  # size of the cells of the finest octave, over the diagonal
OCTAVES = 5
# As in the core:
DEVIATION = 0.27  # of the noise of one octave
PERSISTENCE = 0.6  # amplitude of an octave over that of the next coarser one
PRIMES = 0x8DA6B343, 0xD8163841, 0xCB1AB31F  # of the hash of a cell, by axis


@dataclass(frozen=True)
class Anchor:
    """Origin, scale and focus of the noise of a job, world units.

    Attributes:
        center: origin of its cells.
        scale: size of the cells of one octave, > 0.
        focus: center of interest of the picture.
        reach: radius around it that is in focus, > 0.
        seed: of the noise.
    """

    center: tuple[float, float, float]
    scale: float
    focus: tuple[float, float, float]
    reach: float
    seed: int = 0

    def distances(self, points: Array) -> F64:
        """[N] distance of points from the focus, over `reach`."""
        apart = points.astype(np.float64) - np.asarray(self.focus)
        return np.asarray(np.linalg.norm(apart, axis=1) / self.reach)


def space_noise(
    depth: Array,
    camera: Camera,
    anchor: Anchor,
    *,
    finest: float = FINEST,
    octaves: int = OCTAVES,
    corner: tuple[int, int] = (0, 0),
) -> Array:
    """[H, W, 3] two noises (mean 0, deviation 1) and the distance to the focus; 0 where nothing is painted.

    The first noise has all octaves, the second only the coarse ones. Distances are relative to the reach.

    Args:
        depth: [H, W] camera z, 0 where nothing is painted; of the view or a part of it.
        camera: the view.
        anchor: where the noise is fixed.
        finest: size of the cells of the finest octave, in diagonals of the picture.
        octaves: of the first noise, >= 2.
        corner: column and row of the upper left pixel of the part.
    """
    depth = np.ascontiguousarray(depth)
    noise = np.empty((*depth.shape, 3), depth.dtype)
    rays, focus, size = rays_of(camera, anchor, finest)
    rays[2] += corner[0] * rays[0] + corner[1] * rays[1]
    _core.space_noise(
        depth=depth,
        rays=rays,
        focus=focus,
        reach=anchor.reach / anchor.scale,
        finest=size,
        octaves=octaves,
        seed=anchor.seed,
        num_threads=num_threads_or_default(None),
        noise=noise,
    )
    return noise


def rays_of(camera: Camera, anchor: Anchor, finest: float) -> tuple[F64, F64, float]:
    """The linear map from pixels and depth to points, in cells of an anchor.

    Returns:
        [4, 3] steps of a pixel to the right and down, and the upper left corner, all at depth 1 relative to
        the camera center, which is the last row; [3] the focus; and the size of the finest octave at depth 1.
    """
    to_world, inverse = np.linalg.inv(camera.viewmat), np.linalg.inv(camera.K)
    rays = (to_world[:3, :3] @ inverse).T / anchor.scale
    center = np.asarray(anchor.center, np.float64)
    origin = (to_world[:3, 3] - center) / anchor.scale
    focus = (np.asarray(anchor.focus, np.float64) - center) / anchor.scale
    focal = float(np.sqrt(camera.K[0, 0] * camera.K[1, 1]))
    size = finest * float(np.hypot(camera.width, camera.height)) / (focal * anchor.scale)
    return np.ascontiguousarray(np.concatenate([rays, origin[None]])), focus, size
