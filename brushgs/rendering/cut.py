"""Erase discs of a surface: in each view, strokes that reach into a disc are cut at its rim."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.rendering.facing import facing_shares
from brushgs.rendering.flat import CORNERS, planes_of
from brushgs.values.arrays import F32, Array, Mask
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.rendering.motion import Pose


@dataclass(frozen=True, eq=False)
class Cut:
    """Erased parts of the strokes of a coat.

    Attributes:
        discs: K flat discs; their radius is one standard deviation.
        normals: [K, 3] toward the side from which they are erased.
        tolerances: [K] world units: paint up to this far in front of a disc does not hide it.
        touching: [N] mask of strokes of the surface that reach into a disc, within which they are erased.
        inside: [N] mask of those whose center lies in a disc; omitted entirely where strokes cannot be cut.
    """

    discs: Gaussians
    normals: Array
    tolerances: Array
    touching: Mask
    inside: Mask

    def __add__(self, other: "Cut") -> "Cut":
        """Join the discs of two cuts of the same strokes."""
        return Cut(
            self.discs + other.discs,
            np.concatenate([self.normals, other.normals]),
            np.concatenate([self.tolerances, other.tolerances]),
            self.touching | other.touching,
            self.inside | other.inside,
        )

    def posed(self, pose: "Pose") -> "Cut":
        """The cut at a moment of a moving scene."""
        return replace(self, discs=pose.moved(self.discs), normals=pose.turned(self.discs, self.normals))

    def without(self, boxes: Boxes) -> Boxes:
        """Boxes with opacity 0 for touching strokes; boxes of plain Gaussians do not change."""
        is_gone = np.append(self.touching, False)[np.minimum(boxes.ids, len(self.touching))]
        return replace(boxes, opacities=np.where(is_gone, 0, boxes.opacities).astype(boxes.opacities.dtype))

    def applied(self, frame: Frame, camera: Camera, bare: Callable[[], Frame], part: Part | None) -> Frame:
        """Blend a frame of all strokes with the frame `bare` where discs are visible.

        Args:
            frame: of all strokes of the coat.
            camera: the view.
            bare: renders the frame of strokes that touch no disc.
            part: the pixels of the frames; None for all.
        """
        share = self.seen(camera, frame, part)
        if not share.any():
            return frame
        other = bare()

        def mixed(ours: Array | None, theirs: Array | None) -> Array | None:
            if ours is None or theirs is None:
                return None
            weight = share if ours.ndim == 2 else share[..., None]
            return np.asarray(ours + weight * (theirs - ours), ours.dtype)

        rgb, alpha = mixed(frame.rgb, other.rgb), mixed(frame.alpha, other.alpha)
        assert rgb is not None
        assert alpha is not None
        depth = frame.depth
        if depth is not None and other.depth is not None:
            depth = np.where((share > 0.5) | (frame.alpha == 0), other.depth, depth)
        return replace(frame, rgb=rgb, alpha=alpha, depth=depth, height=mixed(frame.height, other.height))

    def seen(self, camera: Camera, frame: Frame, part: Part | None = None) -> F32:
        """[H, W] share of each pixel covered by visible discs; 0 where paint of the frame hides them."""
        part = part or Part.whole(camera.width, camera.height)
        found = np.zeros((part.height, part.width), np.float32)
        rows = np.arange(len(self.discs))
        planes = planes_of(self.discs, rows, camera, 1.0)
        corners = planes.seen(np.broadcast_to(CORNERS, (len(rows), 4, 3)))
        is_before = (corners[..., 2] > camera.near).all(axis=1)
        shares = facing_shares(self.discs.means, self.normals, camera, is_one_sided=True)
        low = np.floor(corners[..., :2].min(axis=1) - 1).astype(np.int64)
        high = np.ceil(corners[..., :2].max(axis=1) + 1).astype(np.int64)
        origin = np.array([part.left, part.top])
        low = np.maximum(low - origin, 0)
        high = np.minimum(high - origin, (part.width, part.height))
        inverse = np.linalg.pinv(planes.to_picture)
        for row in np.flatnonzero(is_before & (shares > 0) & (high > low).all(axis=1)):
            (left, top), (right, bottom) = low[row], high[row]
            y, x = np.mgrid[top:bottom, left:right] + 0.5
            place = np.stack([x + part.left, y + part.top, np.ones_like(x)], axis=-1) @ inverse[row].T
            away = np.hypot(place[..., 0], place[..., 1]) / np.maximum(np.abs(place[..., 2]), 1e-300)
            size = np.linalg.norm(planes.sides[row], axis=1).min()
            share = shares[row] * np.clip((1 - away) * size + 0.5, 0, 1)
            window = found[top:bottom, left:right]
            if frame.depth is not None:
                z, tolerance = planes.to_picture[row, 2, 2], self.tolerances[row]
                before = z - frame.depth[top:bottom, left:right]
                is_paint = frame.alpha[top:bottom, left:right] > 0.15
                share *= np.where(is_paint, np.clip(2 - before / tolerance, 0, 1), 1)
            np.maximum(window, share, out=window)
        return found
