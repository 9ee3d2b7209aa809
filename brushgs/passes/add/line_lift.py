"""Lift chains of a picture into space, by the depth of the plain picture on the near side of the edge."""

from dataclasses import dataclass, fields

import numpy as np

from brushgs.passes.add.line_edges import EdgePoints
from brushgs.values.along import Along
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

PIXELS = 480_000  # 800x600, the picture size that widths and lengths refer to
# Depth is read on the near side, at two distances from the edge in px: closer to the edge the picture mixes
# both sides. From the outer position to the edge, depth changes by 0.8 of its change between the two
# positions on a flat surface, and by 2 on a round one, where it goes with the root of the distance.
INNER, OUTER = 4.5, 2.0
ONWARD = 1.5
MIXED = 0.06  # of the depth, between both positions: above it the outer one mixes both sides
SOLID = 0.3  # minimum alpha of a pixel with a depth
SMOOTH = 12  # passes of averaging with neighbors one pixel away
DEPTH_REACH = 12  # px to each side over which depth is averaged, twice: depth of trained scenes is rough
JUMP, JUMP_REACH = 0.04, 10  # of the depth, px on either side: lines are cut between bodies


@dataclass(frozen=True, eq=False)
class Chains:
    """P points in space, chain after chain.

    Attributes:
        points: [P, 3] world units.
        normals: [P, 3] of the surface at a silhouette; the length says how far it is one, 0 for edges fixed
            in space.
        strengths: [P] see `EdgePoints`.
        steps: [P] see `EdgePoints`.
        importances: [P] of the chain in its picture, see `importance`.
        pixels: [P] size of a pixel at this depth, world units, of its view in `PIXELS`.
        sizes: [P] the same for the width of a line, from the nearest view.
        chains: [P] ascending.
        views: [P] the view of the chain.
    """

    points: F64
    normals: F64
    strengths: F64
    steps: F64
    importances: F64
    pixels: F64
    sizes: F64
    chains: Rows
    views: Rows

    def __len__(self) -> int:
        return len(self.points)

    def take(self, rows: Rows | Mask) -> "Chains":
        """Some of the points, in their order."""
        return Chains(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    @classmethod
    def none(cls) -> "Chains":
        """No chains."""
        space, number, row = np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.intp)
        return cls(space, space, number, number, number, number, number, row, row)

    @classmethod
    def joined(cls, parts: "list[Chains]") -> "Chains":
        """All chains of several sets."""
        offsets = np.cumsum([0] + [int(p.chains[-1]) + 1 if len(p) else 0 for p in parts])
        columns = {f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)}
        columns["chains"] = np.concatenate(
            [p.chains + offset for p, offset in zip(parts, offsets[:-1], strict=True)]
        )
        return cls(**columns)


def unit_of(camera: Camera) -> float:
    """Focal length in pixels, scaled to a picture of `PIXELS`."""
    return float(np.sqrt(camera.K[0, 0] * camera.K[1, 1] * PIXELS / (camera.width * camera.height)))


def lift(
    edges: EdgePoints, along: Along, importances: F64, camera: Camera, frame: Frame, view: int
) -> Chains:
    """Lift chains into space; every second point is kept.

    Args:
        edges: P points in order.
        along: their chains.
        importances: [P] of the chains.
        camera: the view.
        frame: its plain picture, with depth.
        view: number of the view.
    """
    z = _depths_of(edges, along, frame)
    is_known = np.isfinite(z)
    z = np.where(is_known, z, 1.0)
    is_cut = _jumps(np.log(z), along) > JUMP
    chains = along.cut(is_known, is_cut)[is_known]
    z, edges, along = z[is_known], edges.take(is_known), Along.of(chains)
    importances = importances[is_known]
    z = 1 / along.even_mean(along.even_mean(1 / z, DEPTH_REACH), DEPTH_REACH)
    points = along.smooth(edges.points, SMOOTH)
    rays = np.ones((len(points), 3))
    rays[:, :2] = (points - camera.K[:2, 2]) / np.diag(camera.K)[:2]
    space = (rays * z[:, None] - camera.viewmat[:3, 3]) @ camera.viewmat[:3, :3]
    # The surface of a silhouette holds the ray and the edge: its normal is at right angles to both.
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    out = np.zeros_like(rays)
    out[:, :2] = along.smooth(edges.normals, SMOOTH)
    out -= (out * rays).sum(axis=1, keepdims=True) * rays
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    pixels = z / unit_of(camera)
    strengths, steps = (along.mean(column, 5) for column in (edges.strengths, edges.steps))
    views = np.full(len(points), view)
    normals = out @ camera.viewmat[:3, :3]
    columns = (space, normals, strengths, steps, importances, pixels, pixels, along.chains, views)
    return Chains(*columns).take(along.thinned())


def _jumps(logs: F64, along: Along) -> F64:
    """[P] lasting jump of depth before each point: the depth of surfaces seen from the side is a sawtooth."""
    total = np.concatenate([[0.0], np.cumsum(logs)])
    rows = np.arange(len(logs))
    low, high = along.near(-JUMP_REACH), along.near(JUMP_REACH - 1) + 1
    behind = (total[rows] - total[low]) / np.maximum(rows - low, 1)
    ahead = (total[high] - total[rows]) / (high - rows)
    jumps = np.minimum(np.abs(logs - logs[along.near(-1)]), np.abs(ahead - behind))
    return np.where(rows == along.first, 0, jumps)


def _depths_of(edges: EdgePoints, along: Along, frame: Frame) -> F64:
    """[P] depth at edges, infinite for empty pixels."""
    assert frame.depth is not None, "render the plain picture with depth"
    depth = np.where(frame.alpha > SOLID, frame.depth, np.inf).astype(np.float64)
    inner, outer = (_depths(depth, edges, inside) for inside in (INNER, OUTER))
    with np.errstate(invalid="ignore"):  # infinity less infinity
        rise = np.maximum(outer - inner, 0)
        is_round = rise < MIXED * inner
    z = np.where(is_round, np.where(is_round, outer, 0) + ONWARD * np.where(is_round, rise, 0), inner)
    return along.median(z, 5)


def _depths(depth: F64, edges: EdgePoints, inside: float) -> F64:
    """[P] depth `inside` pixels to the near side of edges, less far for edges that are no step of depth."""
    at = edges.points - inside * edges.normals * edges.steps[:, None]
    height, width = depth.shape
    columns = np.clip(at[:, 0].astype(np.intp), 0, width - 1)
    rows = np.clip(at[:, 1].astype(np.intp), 0, height - 1)
    return depth[rows, columns]
