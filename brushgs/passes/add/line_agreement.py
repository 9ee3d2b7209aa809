"""Merge the chains of several views into chains fixed in space, each line once.

A line found in one view is searched for in the others at its projection, if visible. A line that another view
found there is a duplicate and is dropped. A crease or mark that other views do not find is dropped too. A
silhouette that views from the side find at the same place is a sharp edge, and stays fixed; otherwise it is
the side of a round body, and fades as it is seen from the side.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from brushgs.passes.add.line_lift import Chains, unit_of
from brushgs.rendering.facing import BOUNDS, facing
from brushgs.values.along import Along
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

IN_SIGHT = 0.03  # tolerance of depth behind the plain picture, relative
SAME = 3  # px, distance within which lines are the same
SHARP = 2  # px, distance within which a view from the side must find a sharp edge
BESIDE = 0.3  # sine of the angle from which the silhouette of a round body has moved
NEAREST = 0.15  # sine: a view from a smaller angle has nearly the same silhouette
FARTHEST = 0.5  # sine above which a silhouette is gone even if no other view has its own
WIDEST = 1.6  # times the middle width of the lines of the first view
NEARER = 2.0  # maximum width, relative to the view that is nearest to the line
SMALLER = 2.5  # factor: a view ignores lines that are this much smaller than in another view
FOUND = (0.2, 0.4)  # share of the views that see a mark in which it must be an edge: of the first, of others
HALF, GONE = (BOUNDS[0] + share * (BOUNDS[1] - BOUNDS[0]) for share in (0.5, 0.9))  # of a silhouette
CLEAR = 0.7  # share of a chain that is dropped, above which the rest is dropped too
REACH = 5  # points to each side over which the votes of views are averaged


@dataclass(frozen=True, eq=False)
class Sight:
    """The edges of a view, for comparison with other views.

    Attributes:
        camera: the view.
        depth: [H, W] depth of the farthest plain surface within a pixel, infinite for empty pixels.
        is_edge: [H, W] whether an edge is within `SAME`.
        is_line: [H, W] whether an edge that is worth a line is within `SHARP`.
        unit: focal length in widths of a line.
    """

    camera: Camera
    depth: Array
    is_edge: Mask
    is_line: Mask
    unit: float

    @classmethod
    def of(cls, camera: Camera, frame: Frame, edges: F64, lines: F64) -> "Sight":
        """Build from a plain picture with depth, the points [E, 2] of its edges, and those worth a line."""
        assert frame.depth is not None
        depth = ndimage.maximum_filter(np.where(frame.alpha > 0.5, frame.depth, np.inf), 3)
        is_edge, is_line = _around(edges, SAME, depth.shape), _around(lines, SHARP, depth.shape)
        return cls(camera, depth, is_edge, is_line, unit_of(camera))

    def project(self, points: F64) -> tuple[F64, Mask]:
        """Pixels [P, 2] of points in space, and which are visible."""
        camera = self.camera
        t = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        z = np.maximum(t[:, 2], camera.near)
        pixels = t[:, :2] / z[:, None] * np.diag(camera.K)[:2] + camera.K[:2, 2]
        seen = (t[:, 2] > camera.near) & (pixels >= 0).all(axis=1)
        seen &= (pixels < (camera.width, camera.height)).all(axis=1)
        at = pixels[seen].astype(np.intp)
        seen[seen] = t[seen, 2] < self.depth[at[:, 1], at[:, 0]] * (1 + IN_SIGHT)
        return pixels, seen


def _around(points: F64, reach: int, shape: tuple[int, ...]) -> Mask:
    """[H, W] the pixels within `reach` of points [E, 2]."""
    mask = np.zeros(shape, np.uint8)
    columns, rows = points.astype(np.intp).T
    mask[rows, columns] = 1
    return np.asarray(ndimage.maximum_filter(mask, 2 * reach + 1), np.bool_)


def agreed(found: list[Chains], sights: list[Sight], *, least: float) -> Chains:
    """The confirmed chains of all views, those of the first view first.

    The first view is the picture: other views add no lines where it sees the surface, since they would be
    strays.

    Args:
        found: chains of each view.
        sights: of each view.
        least: px, minimum length of a chain.
    """
    parts: list[Chains] = []
    for view, chains in enumerate(found):
        if not len(chains):
            continue
        chains = _supported(chains, sights, view)
        if view > 0 and len(chains):
            chains = _without(chains, _shown(chains, sights[0]), 0.25)
            chains = _without(chains, _covered(chains, parts, sights[view]), 0.5)
        chains = _long_enough(chains, least)
        if len(chains):
            parts.append(chains)
    return _no_wider(Chains.joined(parts)) if parts else Chains.none()


def _no_wider(chains: Chains) -> Chains:
    """Chains of lines that are not much wider than those of the first view: a distant line there may be near
    in another view, so it is made thinner.
    """
    of_first = chains.sizes[chains.views == chains.views[0]]
    return replace(chains, sizes=np.minimum(chains.sizes, WIDEST * np.median(of_first)))


def _supported(chains: Chains, sights: list[Sight], own: int) -> Chains:
    """Chains without marks that other views do not find; sharp silhouettes fixed."""
    num = len(chains)
    seen, found, seen_beside, found_beside = np.zeros((4, num))
    beside_least, nearest = np.full(num, FARTHEST), chains.pixels.copy()
    for view, sight in enumerate(sights):
        if view == own:
            continue
        pixels, in_sight = sight.project(chains.points)
        rays = chains.points - sight.camera.position
        turned = -(rays * chains.normals).sum(axis=1) / np.linalg.norm(rays, axis=1)
        beside_least = np.where(turned > NEAREST, np.minimum(beside_least, turned), beside_least)
        rows = np.flatnonzero(in_sight)
        pixel = (rays[rows] @ sight.camera.viewmat[2, :3]) / sight.unit
        nearest[rows] = np.minimum(nearest[rows], pixel)
        columns, lines = pixels[rows].astype(np.intp).T
        seen[rows] += 1
        found[rows] += sight.is_edge[lines, columns]
        beside = np.abs(turned[rows]) > BESIDE
        seen_beside[rows] += beside
        found_beside[rows] += sight.is_line[lines, columns] & beside
    along = Along.of(chains.chains)
    often = along.mean(seen, REACH)
    share = along.mean(found, REACH) / np.maximum(often, 1e-9)
    fixed = along.mean(found_beside, 3 * REACH) / np.maximum(along.mean(seen_beside, 3 * REACH), 0.5)
    fixed = np.clip((fixed - 0.4) / 0.3, 0, 1)
    is_silhouette = np.clip(along.mean(chains.steps, 3 * REACH) * 1.6 - 0.3, 0, 1)
    fades = is_silhouette * (1 - fixed) * BOUNDS[1] / along.mean(beside_least, 3 * REACH)
    stands = (share >= FOUND[own > 0]) | (often < 0.5) | (is_silhouette > 0.7)
    nearest = np.minimum(chains.pixels, NEARER * along.mean(nearest, 3 * REACH))
    supported = replace(chains, normals=chains.normals * fades[:, None], sizes=nearest)
    return _without(supported, ~stands, 0.5)


def _shown(chains: Chains, sight: Sight) -> Mask:
    """Which points are visible in a view, and not too small."""
    _, seen = sight.project(chains.points)
    depths = (chains.points - sight.camera.position) @ sight.camera.viewmat[2, :3]
    seen &= depths / sight.unit < SMALLER * chains.pixels
    return seen & (facing(chains.points, chains.normals, sight.camera) < GONE)


def _covered(chains: Chains, parts: list[Chains], sight: Sight) -> Mask:
    """Which points lie on existing lines in this view."""
    there = [np.zeros((0, 2))]
    for part in parts:
        pixels, seen = sight.project(part.points)
        seen &= facing(part.points, part.normals, sight.camera) < HALF
        there.append(pixels[seen])
    points = np.concatenate(there)
    if not len(points):
        return np.zeros(len(chains), bool)
    pixels, _ = sight.project(chains.points)
    distances, _ = cKDTree(points).query(pixels, distance_upper_bound=1.5 * SAME)
    return np.asarray(np.isfinite(distances))


def _without(chains: Chains, is_left_out: Mask, most: float) -> Chains:
    """Chains without points in whose neighborhood more than a share is dropped, and without short remains."""
    along = Along.of(chains.chains)
    left_out = is_left_out.astype(np.float64)
    is_kept = (along.mean(left_out, REACH) < most) & (along.means(is_left_out) <= CLEAR)[along.chains]
    return replace(chains, chains=along.cut(is_kept)).take(is_kept)


def _long_enough(chains: Chains, least: float) -> Chains:
    """Chains of a least length, px of their own picture."""
    if not len(chains):
        return chains
    along = Along.of(chains.chains)
    lengths = along.totals(along.lengths(chains.points) / chains.pixels)
    return chains.take((lengths >= least)[along.chains])
