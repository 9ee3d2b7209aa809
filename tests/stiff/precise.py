"""`brushgs.project` once more, in extended precision: what errors are measured against.

NumPy's `longdouble` has 64 bits of mantissa on x86 and 15 of exponent (113 and 15 on arm64 Linux): needles
of aspect 1e8 keep ten digits of their thin side, and nothing leaves the range. Inputs are taken as they
are, float32 ones too: what is measured is the arithmetic, not the rounding of the scene. Only the harmonics
(`values.sh`) are in float64. The shorter extent comes from the area of the ellipse, another way than the
core's.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from brushgs.rendering.project import Directions
from brushgs.rendering.reference import ANCHOR_PULL, CLAMP, DIRECTION_NOISE, FADED_NEAR
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import sh_basis

X = np.longdouble
HAS_DIGITS = np.finfo(X).eps < 1e-18
needs_digits = pytest.mark.skipif(not HAS_DIGITS, reason="longdouble is no longer than double here")


@dataclass(frozen=True)
class Exact:
    """Boxes of all N Gaussians, by row, those culled by `project` included; all but `colors` longdouble."""

    centers: np.ndarray  # [N, 2]
    half_extents: np.ndarray  # [N, 2]
    angles: np.ndarray  # [N]
    depths: np.ndarray  # [N]
    colors: np.ndarray  # [N, 3]
    opacities: np.ndarray  # [N]
    axes: np.ndarray  # [N, 2] deviations of the ellipse, the longer first, pixels
    shade_size: np.ndarray  # [N, 3] sum of |coefficient x basis|: rounding of a color is relative to it


def exact(
    gaussians: Gaussians,
    camera: Camera,
    *,
    num_sigmas: float = 2.0,
    low_pass: float = 0.3,
    lock: str | Directions = "off",
    fade: bool = False,
) -> Exact:
    means, scales, opacities = (c.astype(X) for c in (gaussians.means, gaussians.scales, gaussians.opacities))
    W, shift = camera.viewmat[:3, :3].astype(X), camera.viewmat[:3, 3].astype(X)
    t = (W * means[:, None]).sum(axis=2) + shift
    directions = means + (W * shift[:, None]).sum(axis=0)  # from the camera, which is at -W^T shift
    directions /= np.sqrt((directions**2).sum(axis=1, keepdims=True))
    R = rotations(gaussians.quats)
    M = jacobian(t, camera, W) @ R * scales[:, None]
    p, q = M[:, 0], M[:, 1]
    theta = np.arctan2(2 * (p * q).sum(axis=1), ((p - q) * (p + q)).sum(axis=1)) / 2
    longer = deviation(M, theta)
    shorter = np.sqrt((np.cross(p, q) ** 2).sum(axis=1)) / np.where(longer > 0, longer, 1)
    axes = np.stack([longer, shorter], axis=1)
    square = axes**2 + X(low_pass)  # [N, 2]

    angles, growth = theta, X(1)
    if isinstance(lock, Directions):
        angles = lock.angles.astype(X)
    elif lock == "anchor":
        rows, longest = np.arange(len(M)), np.argmax(scales, axis=1)
        px, py = M[rows, :, longest].T
        side = 1 - (R[rows, :, longest] * directions).sum(axis=1) ** 2
        pull = 1 + ANCHOR_PULL * side * ((square[:, 0] - square[:, 1]) / square.sum(axis=1)) ** 2
        c, s = np.cos(theta), np.sin(theta)
        along, across = pull * (c * px + s * py), c * py - s * px
        bent = np.arctan2(s * along + c * across, c * along - s * across)
        lengths = scales.max(axis=1) * camera.K[[0, 1], [0, 1]].max() / t[:, 2]
        angles = np.where(np.hypot(px, py) > DIRECTION_NOISE * lengths, bent, theta)
    # Along a direction off the axis by d: the ellipse's own two deviations, turned.
    cos2, sin2 = np.cos(angles - theta) ** 2, np.sin(angles - theta) ** 2
    u, v = cos2 * square[:, 0] + sin2 * square[:, 1], sin2 * square[:, 0] + cos2 * square[:, 1]
    area, smallest = np.sqrt(u * v), np.sqrt(square[:, 0] * square[:, 1])
    if isinstance(lock, Directions):
        area_scales = 1 if lock.area_scales is None else lock.area_scales.astype(X)
        growth = np.maximum(area_scales * smallest / area, 1)
        opacities = opacities * (smallest / (area * growth))
    half_extents = X(num_sigmas) * np.sqrt(np.stack([u, v], axis=1) * np.reshape(growth, (-1, 1)))
    if fade:
        opacities = opacities * faded(t[:, 2], half_extents, axes[:, 0], camera, low_pass)
    f, c = camera.K[[0, 1], [0, 1]].astype(X), camera.K[:2, 2].astype(X)
    basis = sh_basis(directions.astype(np.float64), gaussians.sh_degree)
    shades = basis[..., None] * gaussians.sh.astype(np.float64)
    colors, sums = np.maximum(0, 0.5 + shades.sum(axis=1)), np.abs(shades).sum(axis=1)
    return Exact(t[:, :2] / t[:, 2:] * f + c, half_extents, angles, t[:, 2], colors, opacities, axes, sums)


def rotations(quats: np.ndarray) -> np.ndarray:
    quats = quats.astype(X)
    quats = quats / np.abs(quats).max(axis=1, keepdims=True)
    w, x, y, z = (quats / np.sqrt((quats**2).sum(axis=1, keepdims=True))).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def jacobian(t: np.ndarray, camera: Camera, W: np.ndarray) -> np.ndarray:
    """[N, 2, 3] derivative of the pixel by world coordinates."""
    rows = []
    for axis, side in ((0, camera.width), (1, camera.height)):
        focal = camera.K[axis, axis].astype(X)
        limit = X(CLAMP) * side / (2 * focal)
        ratio = np.clip(t[:, axis] / t[:, 2], -limit, limit)
        rows.append((focal / t[:, 2])[:, None] * (W[axis] - ratio[:, None] * W[2]))
    return np.stack(rows, axis=1)


def deviation(M: np.ndarray, angles: np.ndarray) -> np.ndarray:
    along = np.cos(angles)[:, None] * M[:, 0] + np.sin(angles)[:, None] * M[:, 1]
    return np.sqrt((along**2).sum(axis=1))


def faded(depths, half_extents, longer, camera: Camera, low_pass: float) -> np.ndarray:
    near, area = X(camera.near), 4 * half_extents.prod(axis=1)
    inverse = np.sqrt(X(camera.width * camera.height) / area)
    length = longer / np.sqrt(longer**2 + X(low_pass))
    ramps = (depths / near - 1) / (X(FADED_NEAR) - 1), (inverse - 0.1) / 0.4
    return np.prod([t * t * (3 - 2 * t) for t in np.clip(ramps, 0, 1)], axis=0) * length


@dataclass(frozen=True)
class Errors:
    """Worst over the boxes. Relative, but `angle`: radians off, weighed by what a turn moves; centers:
    pixels off over pixels from the middle of the picture or half extents, whichever is more; colors over
    the size of what was summed.
    """

    length: float
    width: float
    angle: float
    center: float
    depth: float
    color: float
    opacity: float


def errors_of(boxes: Boxes, wanted: Exact) -> Errors:
    ids = boxes.ids
    half, expected = boxes.half_extents.astype(X), wanted.half_extents[ids]
    ratio = np.abs(half - expected) / expected
    turn = (boxes.angles.astype(X) - wanted.angles[ids]) / (2 * X(np.pi))
    turn = np.abs(turn - np.round(turn)) * 2 * X(np.pi)
    turn = np.minimum(turn, np.abs(turn - X(np.pi)))  # of a line; arrows have tests of their own
    squares = expected**2
    anisotropy = np.abs(squares[:, 0] - squares[:, 1]) / squares.sum(axis=1)
    away = np.abs(boxes.centers.astype(X) - wanted.centers[ids])
    size = np.maximum(np.abs(wanted.centers[ids]), expected.max(axis=1, keepdims=True)) + 1
    shade = np.abs(boxes.colors - wanted.colors[ids]) / (0.5 + wanted.shade_size[ids])
    depths = np.abs(boxes.depths.astype(X) / wanted.depths[ids] - 1)
    opacities = np.abs(boxes.opacities.astype(X) / wanted.opacities[ids] - 1)
    errors = ratio[:, 0], ratio[:, 1], turn * anisotropy, away / size, depths, shade, opacities
    return Errors(*(float(values.max(initial=0)) for values in errors))
