"""What a watercolour decides once per job, from small pictures of its strokes in a few views."""

from dataclasses import dataclass

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.seen import some_small
from brushgs.pipeline.media.materials import IS_PAINTED, Materials, fill
from brushgs.rendering.effect import positions_of
from brushgs.rendering.render import render
from brushgs.rendering.space_noise import Anchor
from brushgs.rendering.wet_layer import ROOM_SOLID, Key, smooth
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.colors import LUMINANCE
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

SIDE, MOST_VIEWS = 480, 3  # longer side of the pictures, pixels, and their number
DARKS = 2.0  # percent of the painted pixels that become the darkest
LEAST_RANGE = 0.15  # of luma: a scene of one tone is not stretched
WHITE, LIFT = 0.95, 0.45  # luma of white things, and how far that of the paper moves towards it for objects
REACH, OF_SUBJECT = 0.17, 0.9  # of the focus, at most: of the picture's diagonal, and of the subject's radius
CENTERED = 0.35  # of the picture: standard deviation of the preference for its middle


@dataclass(frozen=True)
class Settled:
    """Constants of a job.

    Attributes:
        key: values.
        anchor: of the noise and the focus.
        is_room: whether strokes fill the pictures.
        views: small pictures of the strokes in a few views, the first first.
    """

    key: Key
    anchor: Anchor
    is_room: bool
    views: tuple[tuple[Frame, Camera], ...]

    @classmethod
    def of(cls, materials: Materials, *, paper: float) -> "Settled":
        """From the strokes of a painting; `paper` is the share of them that stays white."""
        strokes = materials.strokes
        cameras = some_small(materials.cameras, MOST_VIEWS, SIDE) if materials.cameras else []
        kernel = StrokeTexture.open("gaussian")
        frames = [render(strokes, camera, kernel) for camera in cameras]
        views = tuple(zip(frames, cameras, strict=True))
        lumas = np.concatenate([np.zeros(0), *(_lumas(frame) for frame in frames)])
        if len(lumas) == 0:
            return cls(Key(0.0, 1.0), _anchor_of(strokes), False, views)
        is_room = fill(frames)
        low, high = np.percentile(lumas, [DARKS, 100 * (1 - paper)])
        if not is_room:  # paper lies all around: only what is white is left
            high += LIFT * max(WHITE - float(high), 0)
        solid = ROOM_SOLID if is_room else Key.solid
        key = Key(float(low), float(max(high, low + LEAST_RANGE)), solid=solid)
        return cls(key, _anchor_in(frames[0], cameras[0]), is_room, views)

    def widths(self, points: Array) -> F64:
        """[N] width of the first view at the depth of points; without a view the scale of the noise."""
        if not self.views:
            return np.full(len(points), self.anchor.scale)
        _, camera = self.views[0]
        row = camera.viewmat[2]
        depths = points.astype(np.float64) @ row[:3] + row[3]
        least = max(camera.near, 0.1 * self.anchor.scale)
        return np.asarray(np.maximum(depths, least) * camera.width / camera.K[0, 0])


def _lumas(frame: Frame) -> F64:
    """Luma of the painted pixels."""
    return np.asarray(frame.straight_colors()[frame.alpha > IS_PAINTED] @ np.array(LUMINANCE), np.float64)


def _anchor_of(strokes: Gaussians) -> Anchor:
    """Around the middle of strokes, without a view."""
    if len(strokes) == 0:
        return Anchor((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0), 1.0)
    means = strokes.means.astype(np.float64)
    center = np.median(means, axis=0)
    scale = float(np.median(np.linalg.norm(means - center, axis=1))) or 1.0
    x, y, z = center.tolist()
    return Anchor((x, y, z), scale, (x, y, z), scale)


def _anchor_in(frame: Frame, camera: Camera) -> Anchor:
    """At the place of most detail near the middle of a picture: its focus."""
    assert frame.depth is not None, "it has a depth"
    height, width = frame.alpha.shape
    diagonal = float(np.hypot(height, width))
    luma = (frame.rgb + (1 - frame.alpha)[..., None]) @ np.array(LUMINANCE)
    blurred = smooth(np.ascontiguousarray(luma[..., None], np.float64), 0.003 * diagonal)[..., 0]
    detail = np.hypot(*np.gradient(blurred)) if min(height, width) > 1 else np.zeros_like(blurred)
    spread = smooth(np.ascontiguousarray(detail[..., None]), 0.03 * diagonal)[..., 0]
    y, x = (np.arange(size) + 0.5 for size in (height, width))
    middle = -((x / width - 0.5)[None] ** 2 + (y / height - 0.5)[:, None] ** 2) / (2 * CENTERED**2)
    weights = spread**2 * frame.alpha * np.exp(middle)
    total = float(weights.sum())
    if total <= 0:
        weights, total = frame.alpha.astype(np.float64), float(frame.alpha.sum())
    row, column = float((weights * y[:, None]).sum() / total), float((weights * x).sum() / total)
    apart = -((x - column)[None] ** 2 + (y - row)[:, None] ** 2) / (2 * (0.04 * diagonal) ** 2)
    near = frame.alpha * np.exp(apart)
    shown = near > 0.3 * near.max()
    depth = float(np.median(frame.depth[shown])) if shown.any() else 1.0
    i, j = min(int(row), height - 1), min(int(column), width - 1)
    point = positions_of(np.full((height, width), depth), camera)[i, j].astype(np.float64)
    a, b, c = point.tolist()
    scale = float(np.median(frame.depth[frame.alpha > IS_PAINTED]))
    focal = float(np.sqrt(camera.K[0, 0] * camera.K[1, 1]))
    radius = float(np.sqrt((frame.alpha > IS_PAINTED).sum() / np.pi))
    reach = min(REACH * diagonal, OF_SUBJECT * radius) * depth / focal
    return Anchor((a, b, c), scale, (a, b, c), reach)
