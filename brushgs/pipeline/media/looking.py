"""Darks and lost outlines of a watercolour: decided once per job, by looking at it in small views.

Both go by rank, as shares of what a scene has: the darkest of the picture gets dark, and the lightest part of
the outline is lost, first on the side of the lamp, where the paper of the light side runs into that around.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from brushgs.passes.color.squint import lab_of
from brushgs.rendering.wet_layer import Wet, WetLayer
from brushgs.values.arrays import F64, Array, Rows
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

DARK, DARKEST = 25.0, 2.4  # L* below which this percentage of a small view is to be; a large one has fewer
MUTED = 0.35  # power of the exponent by which colors are weaker: darker and as strong, wood would be red
# Of the tone curve, tried in this order until it is: factor of its exponent, and share of its range that gets
# as dark as its darkest.
CURVES = (
    *((1.0, 0.0), (1.1, 0.02), (1.3, 0.05), (1.5, 0.1), (1.7, 0.16)),
    *((1.9, 0.22), (2.1, 0.28), (2.3, 0.34), (2.5, 0.42), (2.7, 0.5)),
)
LOST = 0.33  # share of the outline of washes that is lost; touches and grain keep some
FAINT = 6.0  # CIELAB: difference across an outline up to which it is lost
SOLID = 0.5  # least coverage by strokes inside of an outline
ACROSS = 0.0036  # of the diagonal, at least 1.5 px: from an outline to what is compared across it
SMOOTH = 0.0018, 0.0014  # of the diagonal: blur of an outline for its direction, and of what is compared
STEPS = 7  # of the bisection of ranks

View = tuple[Frame, Camera]


def looked_at(layer: WetLayer, views: Sequence[View]) -> tuple[WetLayer, list[Wet]]:
    """The layer with darks and lost outlines by pictures of its strokes, and what it mixes each of them from.

    The pictures have a depth.
    """
    if not views:
        return layer, []
    outlines, usual = [_Outline.of(frame.alpha) for frame, _ in views], layer.key
    for gamma, crushed in CURVES:
        low = usual.low + crushed * (usual.high - usual.low)
        chroma = usual.chroma / gamma**MUTED
        layer = replace(layer, key=replace(usual, gamma=gamma * usual.gamma, low=low, chroma=chroma))
        wets = [layer.wet(*views[0])]
        found = _losing(layer, wets, outlines[:1])
        picture = _on_white(wets[0], found)
        if np.percentile(lab_of(picture.reshape(-1, 3))[:, 0], DARKEST) < DARK:
            break
    wets += [layer.wet(*view) for view in views[1:]]
    return (_losing(layer, wets, outlines) if len(views) > 1 else found), wets


def _losing(layer: WetLayer, wets: Sequence[Wet], outlines: Sequence["_Outline"]) -> WetLayer:
    """The layer that loses its share of the outline: the lightest, beside the lamp, away from the focus.

    The score from which outlines are lost is one number for all frames, and what it is compared with lies in
    space, so that no outline pops as the camera moves.
    """
    if layer.is_room:
        return layer
    pairs = [(wet, one) for wet, one in zip(wets, outlines, strict=True) if len(one.edge[0])]
    if not pairs:
        return layer
    scores = np.sort(np.concatenate([layer.scores(wet)[one.edge] for wet, one in pairs]))[::-1]
    _, over, *others = layer.washes.lost

    def from_rank(rank: int) -> WetLayer:
        first = float(scores[min(rank, len(scores) - 1)]) - over
        return replace(layer, washes=replace(layer.washes, lost=(first, over, *others)))

    low, high = 0, len(scores)
    for _ in range(STEPS):
        rank = (low + high) // 2
        if np.concatenate([one.is_lost(_on_white(wet, from_rank(rank))) for wet, one in pairs]).mean() < LOST:
            low = rank
        else:
            high = rank
    return from_rank(high)


def _on_white(wet: Wet, layer: WetLayer) -> F64:
    """[H, W, 3] a picture on white paper."""
    rgb, covered = wet.mixed(layer.washes)
    return np.asarray(rgb + (1 - covered)[..., None], np.float64)


@dataclass(frozen=True, eq=False)
class _Outline:
    """The outline of strokes in a view.

    Attributes:
        edge: its n pixels, as rows and columns.
        sides: those inside and outside of it.
        blur: of what is compared, pixels.
    """

    edge: tuple[Rows, ...]
    sides: tuple[tuple[Rows, ...], ...]
    blur: float

    @classmethod
    def of(cls, alpha: Array) -> "_Outline":
        """In a picture with this coverage [H, W]."""
        diagonal, inside = float(np.hypot(*alpha.shape)), np.pad(alpha > SOLID, 1, mode="edge")
        soft = ndimage.gaussian_filter(inside.astype(np.float64), SMOOTH[0] * diagonal)
        slopes = np.stack(np.gradient(soft))[:, 1:-1, 1:-1]
        steep = np.hypot(*slopes)
        is_edge = (inside & ~ndimage.binary_erosion(inside, border_value=1))[1:-1, 1:-1] & (steep > 1e-6)
        edge = np.nonzero(is_edge)
        step = max(ACROSS * diagonal, 1.5) * np.stack([one[edge] for one in slopes]) / steep[edge]
        last = np.array(alpha.shape)[:, None] - 1
        inner, outer = (np.clip(np.rint(edge + side * step).astype(np.int64), 0, last) for side in (1, -1))
        return cls(edge, (tuple(inner), tuple(outer)), SMOOTH[1] * diagonal)

    def is_lost(self, picture: F64) -> Array:
        """[n] whether a picture [H, W, 3] hardly changes across the outline."""
        soft = np.clip(ndimage.gaussian_filter(picture, (self.blur, self.blur, 0)), 0, 1)
        inner, outer = (lab_of(soft[side]) for side in self.sides)
        return np.asarray(np.linalg.norm(inner - outer, axis=1) < FAINT)


def kept_by(layer: WetLayer, wets: Sequence[Wet], cameras: Sequence[Camera], points: Array) -> F64:
    """[N] how much of its pigment the layer keeps at points, 0 where a view loses an outline."""
    kept = np.ones(len(points))
    for wet, camera in zip(wets, cameras, strict=True):
        open_at = 1 - layer.lost(wet)
        at = points.astype(np.float64) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        x, y = (at[:, :2] / np.maximum(at[:, 2:], 1e-9) @ camera.K[:2, :2].T + camera.K[:2, 2]).T
        is_seen = (at[:, 2] > camera.near) & (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
        kept[is_seen] = np.minimum(kept[is_seen], open_at[y[is_seen].astype(int), x[is_seen].astype(int)])
    return kept
