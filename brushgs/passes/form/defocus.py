"""Reduce detail away from the focus: larger, softer strokes of weaker contrast.

A painter gives detail to the subject, and little to what lies in front of it and behind it. Strokes grow as a
lens blurs: with z the depth of a stroke in a view, and z0 the depth in focus nearest to z,

    growth = 1 + 2 strength x |1/z - 1/z0| z0

and at most 1 + 2 strength, the limit far behind the focus; closer than half of z0 that applies as well. No
stroke grows beyond the length at which slabs are cut: large strokes in front would veil the focus. The
optical depth of paint is divided by the growth, so outlines fade; the color difference from the mean around
a stroke shrinks to 1 / growth. Blur depends on the position of a stroke alone: over a path it is the mean of
the views whose pictures show that position, so nothing changes as the camera moves.
Source: Potmesil and Chakravarty 1981, A Lens and Aperture Camera Model for Synthetic Image Generation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.cameras.framing import weighted_quantiles
from brushgs.passes.color.picture_votes import votes
from brushgs.passes.form.slabs import LONGEST, NUM_SIGMAS
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Array, Mask, check
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors

GAIN = 2.0  # growth per unit of blur, at strength 1
MOST_BLUR = 1.0  # |1/z - 1/z0| z0
ENDS = 0.1, 0.9  # quantiles of the visible depths of the focus, between which depths are in focus
MIDDLE = 0.12  # without a subject: standard deviation of the part in focus, in sides of the picture
FEW = 1e-6  # weight of views whose picture does not show a position
SAMPLE, AROUND = 20_000, 48  # Gaussians for colors around strokes; and how many of them around one stroke
LEAST_SEEN = 0.01  # pixels: Gaussians with a smaller visible area do not count
LEAST_OPACITY = 1e-7  # transparency below which float32 has no digits


@dataclass(frozen=True, eq=False)
class Lens:
    """The blur of each place of a scene, for all views of a job.

    Attributes:
        cameras: K >= 1 views of the job.
        depths: [K, 2] nearest and farthest camera z in focus, world units, > 0.
        places: [m, 3] where colors are known, world units.
        colors: [m, 3] RGB, display-encoded.
        areas: [m] visible areas, pixels.
    """

    cameras: Sequence[Camera]
    depths: F64
    places: F64
    colors: F64
    areas: F64

    def blur(self, points: Array) -> F64:
        """[n] |1/z - 1/z0| z0 at points [n, 3], 0 to `MOST_BLUR`."""
        total, weights = np.zeros(len(points)), np.zeros(len(points))
        for camera, (low, high) in zip(self.cameras, self.depths, strict=True):
            depths, is_shown = _seen_in(camera, points)
            weight = np.where(is_shown, 1.0, FEW)
            total += weight * np.minimum(np.abs(np.clip(depths, low, high) / depths - 1), MOST_BLUR)
            weights += weight
        return total / weights

    def growth(self, points: Array, strength: float) -> F64:
        """[n] growth at points [n, 3], 1 to 1 + 2 strength."""
        return np.asarray(1 + GAIN * strength * self.blur(points))

    def room(self, strokes: Gaussians) -> F64:
        """[k] growth up to which strokes stay within the largest allowed length, in any view direction.

        Strokes beside or behind a camera count too: grown, they would reach into the picture as a veil.
        """
        means, nearest_share = strokes.means.astype(np.float64), np.full(len(strokes), np.inf)
        for camera in self.cameras:
            distances = np.linalg.norm(means - camera.position, axis=1)
            share = np.hypot(camera.width, camera.height) / max(camera.K[0, 0], camera.K[1, 1])
            nearest_share = np.minimum(nearest_share, share * np.maximum(distances, camera.near))
        lengths = 2 * NUM_SIGMAS * strokes.scales.max(axis=1).astype(np.float64)
        endless = np.full(len(strokes), np.inf)  # for strokes of size 0
        return np.asarray(np.divide(LONGEST * nearest_share, lengths, out=endless, where=lengths > 0))

    def around(self, points: Array) -> F64:
        """[n, 3] mean colors around points [n, 3]; there must be known colors."""
        _, rows = nearest(self.places, np.asarray(points, np.float64), min(AROUND, len(self.places)))
        weights = self.areas[rows]
        return np.asarray((weights[..., None] * self.colors[rows]).sum(axis=1) / weights.sum(axis=1)[:, None])


def focused(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    is_focus: Mask | None,
    *,
    num_threads: int | None = None,
) -> Lens:
    """Focus on some Gaussians, where views show them.

    Args:
        gaussians: N >= 1 Gaussians, the scene.
        cameras: some small views of the job, >= 1.
        is_focus: [N] whether Gaussians are in the focus; None for the middle of the pictures, which is also
            the focus in views that show none of them.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    depths, seen = np.empty((len(cameras), 2)), np.zeros(len(gaussians))
    for row, camera in zip(depths, cameras, strict=True):
        sums, areas = votes(
            gaussians, [camera], [_middle(camera.width, camera.height)], num_threads=num_threads
        )
        seen += areas
        z, _ = _seen_in(camera, gaussians.means)
        weights = sums[:, 0] if is_focus is None else areas * is_focus
        for found in (weights, sums[:, 0], areas):
            if found.sum() > LEAST_SEEN:
                row[:] = weighted_quantiles(z, found, ENDS)
                break
        else:
            row[:] = camera.near, np.inf
    rows = np.flatnonzero(seen > LEAST_SEEN)
    rows = rows[:: -(-len(rows) // SAMPLE) or 1]
    places, colors = gaussians.means[rows].astype(np.float64), base_colors(gaussians.sh[rows])
    return Lens(cameras, depths, places, colors, seen[rows])


def defocus(strokes: Gaussians, lens: Lens, strength: float) -> Gaussians:
    """Strokes with less detail away from the focus.

    Args:
        strokes: k strokes.
        lens: see `focused`.
        strength: 0 to 1.

    Returns:
        The same strokes in the same order; out of focus larger (limited by `Lens.room`), more transparent and
        closer to the colors around them. The input itself at strength 0.

    Raises:
        ValueError: if `strength` is out of range.

    Example:
        >>> from brushgs.passes.form.defocus import defocus, focused
        >>> softer = defocus(strokes, focused(scene, [camera], None), 0.6)
        >>> len(softer) == len(strokes)
        True
    """
    if not 0 <= strength <= 1:
        raise ValueError(f"defocus: strength must be in [0, 1], got {strength:g}")
    check("defocus", means=(strokes.means, "k 3"))
    if strength == 0 or len(strokes) == 0:
        return strokes
    growth = np.minimum(lens.growth(strokes.means, strength), np.maximum(lens.room(strokes), 1))
    dtype = strokes.scales.dtype
    scales = (strokes.scales * growth[:, None]).astype(dtype)
    passes = np.maximum(1 - strokes.opacities.astype(np.float64), LEAST_OPACITY)
    opacities = np.where(growth > 1, 1 - passes ** (1 / growth), strokes.opacities).astype(dtype)
    sh = strokes.sh.copy()
    sh[:, 1:] /= growth[:, None, None].astype(sh.dtype)
    paler = replace(strokes, scales=scales, opacities=opacities, sh=sh)
    if len(lens.places) == 0:
        return paler
    steps = lens.around(strokes.means) - base_colors(strokes.sh)
    return shift_base_colors(paler, (1 - 1 / growth)[:, None] * steps)


def _seen_in(camera: Camera, points: Array) -> tuple[F64, Mask]:
    """Depths [n] of points, at least the near plane, and whether they lie in the picture."""
    local = np.asarray(points, np.float64) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    depths = np.maximum(local[:, 2], camera.near)
    x = local[:, 0] * (camera.K[0, 0] / depths) + camera.K[0, 2]
    y = local[:, 1] * (camera.K[1, 1] / depths) + camera.K[1, 2]
    is_shown = (x > 0) & (x < camera.width) & (y > 0) & (y < camera.height)
    return depths, np.asarray(is_shown & (local[:, 2] > camera.near))


def _middle(width: int, height: int) -> F64:
    """[height, width, 1] weights of pixels, 1 in the middle of a picture."""
    x, y = (((np.arange(side) + 0.5) / side - 0.5) / MIDDLE for side in (width, height))
    return np.asarray(np.exp(-0.5 * (x**2 + y[:, None] ** 2)))[..., None]
