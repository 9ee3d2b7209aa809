"""Turn pieces of painted areas, with the depth of the surface below, into marks in space with tiles.

A mark is placed first, then the picture is resampled on its plane as its tile: seen from the camera it looks
as painted, however its plane is tilted.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import (
    distance_transform_edt,
    label,
    map_coordinates,
    maximum_filter,
    median_filter,
    minimum_filter,
)
from scipy.spatial import cKDTree

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.marks.strokes import mean_of
from brushgs.rendering.constants import MIN_ALPHA
from brushgs.rendering.depth_test import SOLID
from brushgs.rendering.flat import Planes
from brushgs.rendering.render import render
from brushgs.values.arrays import F64, U8, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import MOST_TILE, Erased, Marks

# Cut a painted area of a picture into pieces along its skeleton, each as wide as the paint, at one depth.
#
# Pieces overlap a little and share the paint there: if shares w sum to 1, layers of alpha 1 - (1 - a)^w
# composite to exactly a, in any order.


LEAST_REACH = 16.0  # px, minimum reach of a piece
MOST_REACH = 1 / 20  # maximum reach, as a share of the shorter side of the picture
OVERLAP = 12.0  # px over which neighbors share the paint
NEIGHBOURS = 4  # maximum number of pieces that share a pixel
STEEP = 1.0
APART = 1e6  # px between areas that do not touch


@dataclass(frozen=True, eq=False)
class Pieces:
    """K pieces of the P pixels of a painted area.

    Attributes:
        rows: [P] rows of the pixels in the picture.
        columns: [P] columns of the pixels.
        piece: [P, n] pieces that share each pixel, nearest first.
        shares: [P, n] their shares of the paint, sum 1.
        count: K.
    """

    rows: Rows
    columns: Rows
    piece: Rows
    shares: F64
    count: int

    def pixels(self, piece: int) -> tuple[Rows, F64]:
        """The pixels of a piece with a share above 0, and the shares."""
        pixel, slot = self._places[piece]
        return pixel, self.shares[pixel, slot]

    @cached_property
    def _places(self) -> list[tuple[Rows, Rows]]:
        """The pixels of each piece, and the column of each in `piece`."""
        pixel, slot = np.nonzero(self.shares)
        piece = self.piece[pixel, slot]
        order = np.argsort(piece, kind="stable")
        ends = np.searchsorted(piece[order], np.arange(1, self.count))
        return list(zip(np.split(pixel[order], ends), np.split(slot[order], ends), strict=True))


def cut(painted: Mask, log_depth: F64, focal: float) -> Pieces:
    """Cut a painted area into pieces.

    Seeds are taken on the skeleton, the local maxima of the distance to the border, then in the remaining
    paint; each claims the pixels within the local width of the paint. Paint is cut where depth jumps.

    Args:
        painted: [H, W], not all False.
        log_depth: [H, W] logarithm of camera z of the surface below, finite where painted.
        focal: px.
    """
    inside = distance_transform_edt(np.pad(painted, 1))[1:-1, 1:-1]
    is_ridge = painted & (inside >= maximum_filter(inside, 3))
    areas, _ = label(painted, np.ones((3, 3)))
    rows, columns = np.nonzero(painted)
    away = STEEP * focal * log_depth[rows, columns]
    points = np.stack([columns, rows, away, APART * areas[rows, columns]], axis=1)
    reach = np.clip(2 * inside[rows, columns], LEAST_REACH, max(LEAST_REACH, MOST_REACH * min(painted.shape)))
    tree, is_left = cKDTree(points), np.ones(len(points), bool)
    seeds: list[int] = []
    for pixel in np.argsort(~is_ridge[rows, columns], kind="stable"):
        if is_left[pixel]:
            seeds.append(int(pixel))
            is_left[tree.query_ball_point(points[pixel], reach[pixel])] = False
    distances, piece = cKDTree(points[seeds]).query(points, k=NEIGHBOURS)
    closeness = np.clip(1 - (distances - distances[:, :1]) / OVERLAP, 0, 1)
    closeness[piece == len(seeds)] = 0  # there are fewer seeds
    return Pieces(
        rows,
        columns,
        np.minimum(piece, len(seeds) - 1),
        closeness / closeness.sum(axis=1, keepdims=True),
        len(seeds),
    )


TILT = np.radians(75)  # maximum angle between the plane of a mark and the picture
MARGIN = 2.0  # px around the paint of a mark
DENSITY = 1.5  # texels per pixel of the picture
SMOOTH = 5  # px, side of the windows of the median of depths and of the search for edges
# Slope of depth in the picture from which it is an edge between two surfaces, whose depths the plain render
# mixes: the tangent of 76 degrees.
EDGE = 4.0
RIM = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
LEAST_POINTS = 12  # points of a surface needed to fit a plane
MOST_RADIUS = 12.0  # px of an erased disc: surfaces bend
RIM_PIXELS = 2.0  # px by which erased discs extend beyond the erased area
FAR = 3.0  # outliers of a plane fit: points farther than this times the median distance


@dataclass(frozen=True, eq=False)
class Below:
    """The surface that is painted over, in one view.

    Attributes:
        camera: the view.
        log_depth: [H, W] logarithm of camera z of the front surface; of the nearest such pixel if empty.
        is_solid: [H, W] whether there is a surface of the scene.
        is_known: [H, W] whether there is a surface of the scene or its stage; None for `is_solid`.
    """

    camera: Camera
    log_depth: F64
    is_solid: Mask
    is_known: Mask = None  # type: ignore[assignment]  # where it is solid

    def __post_init__(self) -> None:
        if self.is_known is None:
            object.__setattr__(self, "is_known", self.is_solid)

    def on_stage(self, depth: F64) -> "Below":
        """The surface, and a stage where the scene is empty; its `depth` [H, W] is infinite outside it."""
        is_stage = ~self.is_solid & np.isfinite(depth)
        log_depth = np.where(is_stage, np.log(np.where(is_stage, depth, 1)), self.log_depth)
        return Below(self.camera, log_depth, self.is_solid, self.is_solid | is_stage)

    @classmethod
    def in_view(cls, camera: Camera, gaussians: Gaussians) -> "Below":
        """The surface of a scene in a view; if that is empty, a plane at the distance of its median point."""
        plain = render(gaussians, camera, StrokeTexture.open("gaussian"))
        distance = float(np.linalg.norm(np.median(gaussians.means, axis=0) - camera.position))
        return cls.of(camera, plain, max(distance, 2 * camera.near))

    @classmethod
    def of(cls, camera: Camera, plain: Frame, distance: float) -> "Below":
        """The surface in a plain render with depth; if it is empty, a plane at camera z `distance`."""
        assert plain.depth is not None, "ask for it"
        is_solid = plain.alpha > max(SOLID, 0.5)
        if not is_solid.any():
            return cls(camera, np.full(plain.alpha.shape, np.log(distance)), is_solid)
        depth = np.maximum(plain.depth.astype(np.float64), camera.near)
        filled = median_filter(_from_nearest(np.log(depth), is_solid), SMOOTH)
        span = maximum_filter(filled, SMOOTH) - minimum_filter(filled, SMOOTH)
        is_sure = is_solid & (span * camera.K[0, 0] < EDGE * SMOOTH)
        return cls(camera, _from_nearest(filled, is_sure) if is_sure.any() else filled, is_solid)

    def points(self, x: F64, y: F64, z: F64) -> F64:
        """World points [N, 3] of pixels at camera z."""
        K, viewmat = self.camera.K, self.camera.viewmat
        rays = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(z)], axis=-1)
        return np.asarray((rays * z[..., None] - viewmat[:3, 3]) @ viewmat[:3, :3])


def _from_nearest(values: F64, is_known: Mask) -> F64:
    """Values [H, W], with unknown ones set to those of the nearest known pixel."""
    nearest = distance_transform_edt(~is_known, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def marks_of_paint(paint: Array, below: Below) -> Marks | None:
    """The marks of the paint over a picture; None if there is no paint.

    Args:
        paint: [H, W, 4] red, green, blue and straight alpha, 0 to 1, display-encoded, in the size of the
            camera; transparent where nothing is painted.
        below: the surface that it is painted over.
    """
    picture: F64 = np.asarray(paint, np.float64)
    painted = picture[..., 3] >= MIN_ALPHA
    if not painted.any():
        return None
    pieces = cut(painted, below.log_depth, float(below.camera.K[0, 0]))
    placed = [_placed(pieces, row, below) for row in range(pieces.count)]
    columns: dict[str, Any] = {name: np.array([one[name] for one in placed]) for name in placed[0]}
    marks = Marks(**columns)
    across = np.cross(marks.directions, marks.normals)
    halves = 0.5 * marks.lengths[:, None] * marks.directions, 0.5 * marks.widths[:, None] * across
    planes = Planes.of(below.camera, marks.means, *halves)
    images = tuple(_tile(picture, pieces, row, planes.take([row])) for row in range(pieces.count))
    colors = np.array([mean_of(image) for image in images])
    return Marks(
        **{name: getattr(marks, name) for name in Marks.COLUMNS}
        | {"colors": colors, "tiles": np.arange(pieces.count)},
        images=images,
    )


def erased_of_area(area: Mask, below: Below) -> Erased | None:
    """Discs on the front surface that cover an erased area [H, W]; None if there is no surface.

    They extend beyond its border by at most `RIM_PIXELS`.
    """
    area = area & below.is_solid
    if not area.any():
        return None
    y, x = np.nonzero(area)
    z = np.exp(below.log_depth[y, x])
    points = below.points(np.asarray(x + 0.5, np.float64), np.asarray(y + 0.5, np.float64), z)
    inside = distance_transform_edt(np.pad(area, 1))[1:-1, 1:-1][y, x]
    radii = (np.minimum(inside, MOST_RADIUS) + RIM_PIXELS) * z / below.camera.K[0, 0]
    tree, is_left, found = cKDTree(points), np.ones(len(points), bool), []
    for pixel in np.argsort(-inside, kind="stable"):
        if not is_left[pixel]:
            continue
        near = tree.query_ball_point(points[pixel], radii[pixel])
        is_left[near] = False
        view = below.camera.position - points[pixel]
        view /= np.linalg.norm(view)
        normal = view if len(near) <= LEAST_POINTS else _leaning(_fitted(points[near])[1], view)
        found.append((points[pixel], normal, radii[pixel]))
    means, normals, sizes = zip(*found, strict=True)
    return Erased(np.array(means), np.array(normals), np.array(sizes))


def _leaning(normal: F64, view: F64) -> F64:
    """The normal flipped towards the camera and limited to `TILT` from the direction to it."""
    normal = normal if normal @ view >= 0 else -normal
    if normal @ view >= np.cos(TILT):
        return normal
    side = normal - (normal @ view) * view
    return np.asarray(np.cos(TILT) * view + np.sin(TILT) * side / np.linalg.norm(side))


def _plane(pieces: Pieces, pixel: Rows, below: Below) -> tuple[F64, F64, F64]:
    """Points of the surface below pixels, the one in their middle, and the normal towards the camera."""
    y, x = pieces.rows[pixel], pieces.columns[pixel]
    z = np.exp(below.log_depth[y, x])
    points = below.points(np.asarray(x + 0.5, np.float64), np.asarray(y + 0.5, np.float64), z)
    middle = (x.min() + x.max() + 1) / 2, (y.min() + y.max() + 1) / 2
    mean = below.points(np.array([middle[0]]), np.array([middle[1]]), np.array([np.median(z)]))[0]
    view = below.camera.position - mean
    view = view / np.linalg.norm(view)
    if len(points) <= LEAST_POINTS or not below.is_known[y, x].all():
        return points, mean, view
    center, normal = _fitted(points)
    normal = _leaning(normal, view)
    on_plane = mean + view * ((center - mean) @ normal) / (view @ normal)
    far = np.linalg.norm(on_plane - mean) > np.ptp(points, axis=0).max()
    return points, (mean if far else on_plane), normal


def _fitted(points: F64) -> tuple[F64, F64]:
    """Center and normal of a plane fitted to points [P, 3], refitted without outliers."""
    for _ in range(2):
        center = points.mean(axis=0)
        normal = np.linalg.svd(points - center, full_matrices=False)[2][2]
        away = np.abs((points - center) @ normal)
        points = points[away <= FAR * np.median(away) + 1e-12]
    return center, normal


def _placed(pieces: Pieces, piece: int, below: Below) -> dict[str, F64]:
    """Columns of a mark for a piece, just large enough for its paint."""
    pixel, _ = pieces.pixels(piece)
    _, mean, normal = _plane(pieces, pixel, below)
    y, x = pieces.rows[pixel], pieces.columns[pixel]
    offsets = np.stack([x - x.mean(), y - y.mean()], axis=1)
    long_way = np.linalg.svd(offsets, full_matrices=False)[2][0] if len(pixel) > 2 else np.array([1.0, 0.0])
    middle = np.array([x.mean(), y.mean()]) + 0.5
    start, end = _on_plane(np.stack([middle, middle + 0.5 * long_way]), mean, normal, below.camera)
    direction = (end - start) / np.linalg.norm(end - start)
    across = np.cross(direction, normal)
    rims = np.stack([x, y], axis=1)[:, None] + 0.5 + MARGIN * RIM
    points = _on_plane(rims.reshape(-1, 2), mean, normal, below.camera) - mean
    places = points @ np.stack([direction, across], axis=1)
    low, high = places.min(axis=0), places.max(axis=0)
    center = (low + high) / 2
    return {
        "means": mean + center[0] * direction + center[1] * across,
        "directions": direction,
        "normals": normal,
        "lengths": high[0] - low[0],
        "widths": high[1] - low[1],
        "colors": np.zeros(3),
        "opacities": np.array(1.0),
        "tiles": np.array(-1),
    }


def _on_plane(pixels: F64, mean: F64, normal: F64, camera: Camera) -> F64:
    """Intersections [P, 3] of the rays of pixels [P, 2] with a plane."""
    K = camera.K
    rays = np.stack(
        [(pixels[:, 0] - K[0, 2]) / K[0, 0], (pixels[:, 1] - K[1, 2]) / K[1, 1], np.ones(len(pixels))], axis=1
    )
    rays = rays @ camera.viewmat[:3, :3]
    distances = ((mean - camera.position) @ normal) / (rays @ normal)
    return np.asarray(camera.position + rays * distances[:, None])


def _tile(paint: F64, pieces: Pieces, piece: int, planes: Planes) -> U8:
    """The picture of a piece, resampled on its plane."""
    pixel, shares = pieces.pixels(piece)
    y, x = pieces.rows[pixel], pieces.columns[pixel]
    top, left = y.min() - 2, x.min() - 2
    own = np.zeros((y.max() - top + 3, x.max() - left + 3, 4))
    rgba = paint[y, x]
    alpha = 1 - (1 - np.minimum(rgba[:, 3], 254 / 255)) ** shares
    own[y - top, x - left] = np.concatenate([rgba[:, :3] * alpha[:, None], alpha[:, None]], axis=1)
    half = np.linalg.norm(planes.sides[0], axis=1)
    columns, lines = np.clip(np.ceil(2 * DENSITY * half), 2, MOST_TILE).astype(int)
    s, t = ((np.arange(n) + 0.5) / n * 2 - 1 for n in (columns, lines))
    plane = np.stack([*np.meshgrid(s, t), np.ones((lines, columns))], axis=-1)
    seen = planes.seen(plane[None])[0]
    places = np.stack([seen[..., 1] - top - 0.5, seen[..., 0] - left - 0.5])
    found = np.stack([map_coordinates(own[..., c], places, order=1) for c in range(4)], axis=-1)
    found[..., :3] /= np.maximum(found[..., 3:], 1e-6)
    return np.asarray(np.rint(255 * np.clip(found, 0, 1)), np.uint8)
