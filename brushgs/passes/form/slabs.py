"""Limit the size of strokes in pictures: long strokes are cut into several shorter ones.

Near a camera one stroke can cover half a room. Strokes longer than a share of the diagonal in some view of
the job are cut along their length, and along their width if it is too long too; each piece covers its part of
the stroke. Strokes right before a camera only hide the scene and are dropped. The sky, and everything far
behind the scene, has no limit. It is decided once for all views.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.extent import robust_frame
from brushgs.values.arrays import F64, Mask, Rows, check
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

LONGEST = 0.12  # of the diagonal of a picture
NUM_SIGMAS = 2.0  # standard deviations from the middle of a stroke to its end
SHORTENED = 1.3  # allowed lengths, up to which a stroke is only shortened
SPACING = 1.6  # of pieces, in half lengths: less than 2, since their ends are narrow
MOST_PIECES = (10, 5)  # along and across; larger strokes are shortened too
BEFORE_EYE = 0.25  # of the median depth of a view: nearer strokes longer than `HIDING` only hide the scene
HIDING = 0.4  # of the diagonal
SKY = 2.5  # radii of the scene from its middle: strokes that lie further out are exempt
MOST_VIEWS = 60  # of a path, evenly spread; a stroke near the camera is large in several frames
MARGIN = 0.05  # of the longer side of a picture: strokes this close to it are kept, since views move
NUM_ROUNDS = 3  # of cutting: pieces nearer to the camera than their stroke are longer than estimated
SHRINK = 0.999  # keeps the last cut below the limit in spite of rounding


def cut_slabs(
    strokes: Gaussians,
    cameras: Sequence[Camera],
    *,
    longest: float = LONGEST,
    num_sigmas: float | NDArray[np.floating] = NUM_SIGMAS,
) -> tuple[Gaussians, Rows]:
    """Cut or drop strokes that are longer in some view than a share of its diagonal.

    Args:
        strokes: k strokes.
        cameras: all views of the job; at most `MOST_VIEWS` are examined.
        longest: share of the diagonal, > 0.
        num_sigmas: half length of a stroke in standard deviations, for all or [k]: the maximum of its brush.

    Returns:
        The strokes, and the original row of each, ascending. Strokes that fit are unchanged, bit for bit; if
        all fit, the result is the input itself. Pieces have the columns of their stroke.

    Raises:
        ValueError: if `longest` is not positive.

    The sky, further from the middle of the scene than `SKY` radii, is exempt. Pieces outside all pictures and
    their `MARGIN` are dropped. Boxes may be longer by the low-pass of the renderer.
    """
    if not longest > 0:
        raise ValueError(f"cut_slabs: longest must be above 0, got {longest:g}")
    rows = np.arange(len(strokes))
    if len(strokes) == 0 or not cameras:
        return strokes, rows
    half = np.broadcast_to(np.asarray(num_sigmas, np.float64), len(strokes))
    check("cut_slabs", means=(strokes.means, "N 3"), num_sigmas=(half, "N"))
    views = _Views.of(strokes, _some(cameras), longest)
    sizes = views.sizes(strokes, half)
    changes = (sizes.length > 1) & views.are_near(strokes)
    if not changes.any():
        return strokes, rows
    kept, cut = rows[~changes], rows[changes & ~sizes.only_hides]
    pieces, sizes = strokes.take(cut), sizes.take(cut)
    for last in (*(False,) * (NUM_ROUNDS - 1), True):
        too_long = np.flatnonzero(sizes.length > 1)
        if not too_long.size:
            break
        pieces, parts = _cut(pieces, sizes, too_long, half[cut], at_most=None if last else MOST_PIECES)
        cut = cut[parts]
        sizes = views.sizes(pieces, half[cut])
        shown = np.flatnonzero(sizes.is_shown)
        pieces, cut, sizes = pieces.take(shown), cut[shown], sizes.take(shown)
    origin = np.concatenate([kept, cut])
    order = np.argsort(origin, kind="stable")
    means, scales = (
        np.concatenate([getattr(strokes, name)[kept], getattr(pieces, name)])[order]
        for name in ("means", "scales")
    )
    origin = origin[order]
    return replace(strokes.take(origin), means=means, scales=scales), origin


def too_long(strokes: Gaussians, cameras: Sequence[Camera]) -> Mask:
    """Mask [k] of the strokes that `cut_slabs` would cut or drop."""
    return _long(strokes, cameras)[1]


def shorten_slabs(strokes: Gaussians, cameras: Sequence[Camera]) -> Gaussians:
    """The same strokes, row by row, with the axes of those that are too long shortened; see `cut_slabs`."""
    for at_most in ((1, 1), None):  # two long axes may coincide in a picture, which is still too long
        sizes, changes = _long(strokes, cameras)
        if not changes.any():
            break
        half = np.full(len(strokes), NUM_SIGMAS)
        strokes = _cut(strokes, sizes, np.flatnonzero(changes), half, at_most=at_most)[0]
    return strokes


def _long(strokes: Gaussians, cameras: Sequence[Camera]) -> "tuple[_Sizes, Mask]":
    """The sizes of strokes, and a mask of those that are too long."""
    views = _Views.of(strokes, _some(cameras), LONGEST)
    sizes = views.sizes(strokes, np.full(len(strokes), NUM_SIGMAS))
    return sizes, np.asarray((sizes.length > 1) & views.are_near(strokes))


def _some(cameras: Sequence[Camera]) -> Sequence[Camera]:
    """At most `MOST_VIEWS` of the views, evenly spread."""
    return cameras[:: max(1, ceil(len(cameras) / MOST_VIEWS))]


@dataclass(frozen=True, eq=False)
class _Sizes:
    """Maximum size of strokes over all views, in allowed lengths.

    Attributes:
        length: [k] of the box; 0 if no view shows the stroke.
        axes: [k, 3] of the axes.
        only_hides: [k] whether a stroke lies right before some camera.
        is_shown: [k] whether it lies in some picture or its `MARGIN`.
    """

    length: F64
    axes: F64
    only_hides: Mask
    is_shown: Mask

    def take(self, rows: Rows) -> "_Sizes":
        return _Sizes(self.length[rows], self.axes[rows], self.only_hides[rows], self.is_shown[rows])


@dataclass(frozen=True, eq=False)
class _Views:
    """Views, with data to detect far and near strokes.

    Attributes:
        cameras: the views.
        depths: median depth of each, world units; 0 for an empty view.
        center: [3] of the scene.
        radius: of the scene, world units.
        longest: share of the diagonal.
    """

    cameras: Sequence[Camera]
    depths: tuple[float, ...]
    center: F64
    radius: float
    longest: float

    @classmethod
    def of(cls, strokes: Gaussians, cameras: Sequence[Camera], longest: float) -> "_Views":
        center, radius = robust_frame(strokes.means)
        depths = []
        for camera in cameras:
            x, y, z = _seen_from(strokes, camera)
            u, v = _pixels(x, y, z, camera)
            shown = (z > camera.near) & (abs(u) < 0.5 * camera.width) & (abs(v) < 0.5 * camera.height)
            depths.append(float(np.median(z[shown])) if shown.any() else 0.0)
        return cls(cameras, tuple(depths), center, radius, longest)

    def are_near(self, strokes: Gaussians) -> Mask:
        """Mask of strokes that are not sky."""
        away = np.linalg.norm(strokes.means.astype(np.float64) - self.center, axis=1)
        return np.asarray(away <= SKY * self.radius)

    def sizes(self, strokes: Gaussians, half: F64) -> _Sizes:
        """The sizes of strokes with half lengths of `half` standard deviations."""
        num = len(strokes)
        found = _Sizes(np.zeros(num), np.zeros((num, 3)), np.zeros(num, bool), np.zeros(num, bool))
        lengths = 2 * half[:, None] * strokes.scales.astype(np.float64)
        reach = np.linalg.norm(lengths, axis=1)
        for camera, depth in zip(self.cameras, self.depths, strict=True):
            x, y, z = _seen_from(strokes, camera)
            limit = self.longest * float(np.hypot(camera.width, camera.height))
            # Upper bound of the box: most strokes need no exact size.
            focal = float(max(camera.K[0, 0], camera.K[1, 1]))
            slant = 1 + (camera.width + camera.height) / focal
            with np.errstate(over="ignore"):
                most = slant * focal * reach / np.maximum(z, camera.near)  # pixels
            u, v = _pixels(x, y, z, camera)
            side = 2 * MARGIN * max(camera.width, camera.height) + np.minimum(most, 2 * limit)
            inside = (2 * abs(u) < camera.width + side) & (2 * abs(v) < camera.height + side)
            found.is_shown[:] |= (z > camera.near) & inside
            rows = np.flatnonzero((z > camera.near) & (most > limit))
            u, v = u[rows], v[rows]
            axes = rotation_matrices(strokes.quats[rows]) * lengths[rows][:, None, :]
            along = np.einsum("ij,njk->nik", camera.viewmat[:3, :3], axes)
            with np.errstate(over="ignore", invalid="ignore"):
                ways = np.stack(_slopes(along, u, v, z[rows], camera), axis=1)  # [n, 2, 3] pixels
                each = np.minimum(np.linalg.norm(ways, axis=1), _HUGE)
                length = np.minimum(_longest(np.clip(ways, -_HUGE, _HUGE)), _HUGE)
            shows = (abs(u) < 0.5 * (camera.width + length)) & (abs(v) < 0.5 * (camera.height + length))
            length, each = length / limit, each / limit
            hides = shows & (z[rows] < BEFORE_EYE * depth) & (length * self.longest > HIDING)
            found.only_hides[rows] |= hides
            larger = shows & (length > found.length[rows])
            found.length[rows[larger]], found.axes[rows[larger]] = length[larger], each[larger]
        return found


_HUGE = 1e12  # pixels


def _seen_from(strokes: Gaussians, camera: Camera) -> tuple[F64, F64, F64]:
    x, y, z = (strokes.means.astype(np.float64) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]).T
    return x, y, z


def _pixels(x: F64, y: F64, z: F64, camera: Camera) -> tuple[F64, F64]:
    """Positions in a picture, pixels from its middle; far out for points not in front of the camera."""
    depth = np.maximum(z, 1e-12)
    u = camera.K[0, 0] * x / depth + camera.K[0, 2] - 0.5 * camera.width
    v = camera.K[1, 1] * y / depth + camera.K[1, 2] - 0.5 * camera.height
    return u, v


def _slopes(along: F64, u: F64, v: F64, z: F64, camera: Camera) -> tuple[F64, F64]:
    """[n, 3] twice: projected axes, of [n, 3, 3] as columns, right and down, pixels.

    Projected at the stroke's position, clamped to slightly outside the picture, as in `project`.
    """
    (fx, cx), (fy, cy) = camera.K[0, [0, 2]], camera.K[1, [1, 2]]
    right = np.clip(u, -0.65 * camera.width, 0.65 * camera.width) + 0.5 * camera.width - cx
    down = np.clip(v, -0.65 * camera.height, 0.65 * camera.height) + 0.5 * camera.height - cy
    return (
        (fx * along[:, 0] - right[:, None] * along[:, 2]) / z[:, None],
        (fy * along[:, 1] - down[:, None] * along[:, 2]) / z[:, None],
    )


def _longest(ways: F64) -> F64:
    """[n] the longer axis of ellipses whose factors are [n, 2, 3]."""
    xx, yy = (ways[:, 0] ** 2).sum(axis=1), (ways[:, 1] ** 2).sum(axis=1)
    xy = (ways[:, 0] * ways[:, 1]).sum(axis=1)
    return np.asarray(np.sqrt(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)))


def _cut(
    strokes: Gaussians, sizes: _Sizes, rows: Rows, half: F64, *, at_most: tuple[int, int] | None
) -> tuple[Gaussians, Rows]:
    """Cut these rows into pieces, and return the row of each.

    A stroke is cut along the two axes that are longest in the picture, if they are longer than `SHORTENED`.
    With a maximum of one piece these axes are shortened, with None whole strokes.
    """
    each = sizes.axes[rows]
    order = np.argsort(-each, axis=1, kind="stable")[:, :2]
    lengths = np.take_along_axis(each, order, axis=1)
    wanted = np.where(lengths > SHORTENED, 1 + np.ceil(2 * (lengths - 1) / SPACING), 1)
    pieces = np.minimum(wanted, at_most or 1).astype(np.intp)
    counts = np.ones(len(strokes), np.intp)
    counts[rows] = pieces.prod(axis=1)
    parts = np.repeat(np.arange(len(strokes)), counts)
    place = np.full(len(strokes), -1)
    place[rows] = np.arange(len(rows))
    changed = np.flatnonzero(place[parts] >= 0)
    own = place[parts[changed]]
    index = changed - np.searchsorted(parts, parts[changed])
    found = strokes.take(parts)
    means, scales = found.means.astype(np.float64), found.scales.astype(np.float64)
    axes = rotation_matrices(found.quats[changed])
    if at_most is None:
        scales[changed] *= (SHRINK / np.maximum(sizes.length[rows], 1.0))[own, None]
    else:
        shares = []  # position of each piece along each axis, -1 to 1
        for rank, at in enumerate((index % pieces[own, 0], index // pieces[own, 0])):
            axis, count, length = order[own, rank], pieces[own, rank], np.maximum(lengths[own, rank], 1.0)
            deviation = scales[changed, axis]
            share = np.where(count > 1, (1 - 1 / length) * (2 * at / np.maximum(count - 1, 1) - 1), 0.0)
            means[changed] += (share * half[parts[changed]] * deviation)[:, None] * axes[
                np.arange(len(own)), :, axis
            ]
            scales[changed, axis] = deviation / length
            shares.append(share)
        for rank in range(2):  # pieces get narrower toward the ends of a stroke, like the stroke
            scales[changed, order[own, rank]] *= np.sqrt(1 - shares[1 - rank] ** 2)
    dtype = found.means.dtype
    largest = np.finfo(dtype).max
    means, scales = np.clip(means, -largest, largest), np.minimum(scales, largest)
    return replace(found, means=means.astype(dtype), scales=scales.astype(dtype)), parts
