"""Watercolour on white paper: one wet layer of washes, a few touches of the brush on it, pencil at the focus.

Strokes are not washes: as soft paint they say where pigment goes. The paper does the rest, see `WetLayer`.
"""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Watercolour
from brushgs.pipeline.media.looking import kept_by, looked_at
from brushgs.pipeline.media.materials import BACKDROP, Materials, numbers_of, scaled
from brushgs.pipeline.media.wetting import Settled
from brushgs.rendering.coat import Coat
from brushgs.rendering.wet_layer import ShadowWash, Washes, WetLayer, in_focus
from brushgs.values.arrays import F64, Rows
from brushgs.values.colors import LUMINANCE, rgb_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

SHADOW_LAB = (0.68, 0.004, -0.035)  # OKLab of the wash of a cast shadow: a cool violet
TOUCHED = (0.08, 0.80)  # luma of the keyed colors that get touches
TOUCH_LENGTH = 0.025  # of the view's width: standard deviation along a touch
LARGEST_TOUCH = 6.0  # times the stroke that it comes from
CANDIDATES = 12  # strokes looked at for a touch
APART = 0.03  # of the view's width: least distance of touches
BORDER = 0.08  # of the picture, in which marks thin out where the washes end
LEAST_FOCUS = 0.45  # of pencil lines
# In films paper is at rest in the picture, so its grain flickers over what moves; and so does what outlines
# lose, which is where they are in a view: it slides over a form, and along a leaf.
GRAIN_IN_FILMS, LOST_IN_FILMS = 0.3, 0.5


def watercolour(materials: Materials) -> list[Coat]:
    """The coats of a watercolour."""
    media, strokes = numbers_of(Watercolour, materials), materials.strokes
    settled = Settled.of(materials, paper=media.paper)
    lamp, foot = (None if one is None else tuple(one.tolist()) for one in (materials.towards, materials.foot))
    layer = WetLayer(settled.key, settled.anchor, settled.is_room, _washes(media, materials))
    layer = replace(layer, towards=lamp, ground=foot)
    layer, wets = looked_at(layer, settled.views)
    has_border = _has_border(materials)
    layer = replace(layer, losing=LOST_IN_FILMS if materials.is_film else 1.0, has_border=has_border)
    settled = replace(settled, key=layer.key)
    coats = [replace(materials.smudge("wash", strokes), effect=layer)]
    kept = partial(kept_by, layer, wets, [camera for _, camera in settled.views])
    rows = _touched(materials, settled, media.touches)
    if len(rows):
        chosen = strokes.take(rows)
        touches = _touches(chosen, settled, media.marks * kept(chosen.means))
        coats.append(materials.glaze("touches", touches, dry=media.dry))
    for coat in materials.line_coat(rgb_of(media.line_color), opacity=media.lines, dry=media.line_dry):
        focus = in_focus(settled.anchor.distances(coat.strokes.means))
        near = np.clip((focus - LEAST_FOCUS) / (1 - LEAST_FOCUS), 0, 1) * kept(coat.strokes.means)
        faded = (near * coat.strokes.opacities).astype(coat.strokes.opacities.dtype)
        rows = np.flatnonzero(near > 0)
        assert coat.normals is not None, "lines are seen edge-on"
        drawn = replace(coat.strokes, opacities=faded).take(rows)
        if len(rows):
            coats.append(replace(coat, strokes=drawn, normals=coat.normals[rows]))
    return [coats[0], *(replace(coat, border=BORDER if has_border else 0.0) for coat in coats[1:])]


def stage(materials: Materials, staging: "Staging") -> Coat:
    """White paper with one wash of shadow."""
    from brushgs.passes.add.stage_marks import WASH

    media = numbers_of(Watercolour, materials)
    color = np.clip(rgb_of_oklab(np.array([SHADOW_LAB])), 0, 1)[0]
    strokes = staging.finished(in_colors(staging.shadow(WASH), color))
    anchor = Settled.of(materials, paper=media.paper).anchor
    wash = ShadowWash(anchor, _washes(media, materials), _has_border(materials))
    return replace(materials.smudge(BACKDROP, strokes), blend="glaze", effect=wash)


def _has_border(materials: Materials) -> bool:
    """Whether washes end before the edge of the sheet: not while the camera moves, or all passes below it."""
    return not (materials.is_film and len(materials.cameras) > 1)


def _washes(media: Watercolour, materials: Materials) -> Washes:
    """Numbers of the washes by the options."""
    usual = Washes()

    def by(factor: float, numbers: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(factor * number for number in numbers)

    return replace(
        usual,
        shares=by(media.wash, usual.shares),
        rims=by(media.rims, usual.rims),
        flows=by(media.flow, usual.flows),
        dips=(media.flow * usual.dips[0], *usual.dips[1:]),
        crests=(media.flow * usual.crests[0], *usual.crests[1:]),
        grain=media.grain * usual.grain * (GRAIN_IN_FILMS if materials.is_film else 1),
    )


def _touched(materials: Materials, settled: Settled, count: int) -> Rows:
    """Rows of the strokes that get touches: scattered evenly, large ones first, none in the lights."""
    strokes = materials.strokes
    luma = settled.key.base_colors(strokes) @ np.array(LUMINANCE)
    widths = settled.widths(strokes.means)
    scales = np.sort(strokes.scales.astype(np.float64), axis=1)[:, 1:]
    areas = scales[:, 0] * scales[:, 1] * materials.solidity / widths**2
    areas = np.where((luma > TOUCHED[0]) & (luma < TOUCHED[1]), areas, 0)
    order = np.argsort(-areas, kind="stable")
    order = order[areas[order] > 0][: CANDIDATES * count]
    points, apart = strokes.means[order].astype(np.float64), APART * widths[order]
    kept: list[int] = []
    is_free = np.ones(len(order), bool)
    for i in range(len(order)):
        if len(kept) == count:
            break
        if is_free[i]:
            kept.append(i)
            is_free &= np.linalg.norm(points - points[i], axis=1) > apart[i]
    return np.sort(order[kept])


def _touches(strokes: Gaussians, settled: Settled, opacity: F64) -> Gaussians:
    """Strokes as loose marks of about one length in the picture, keyed, fainter at the focus."""
    solid = 1 - in_focus(settled.anchor.distances(strokes.means))
    lengths: F64 = strokes.scales.astype(np.float64).max(axis=1)
    wanted = TOUCH_LENGTH * settled.widths(strokes.means)
    factors = np.clip(wanted / np.maximum(lengths, 1e-30), 0.5, LARGEST_TOUCH)
    larger = replace(strokes, scales=(strokes.scales * factors[:, None]).astype(strokes.scales.dtype))
    colored = in_colors(larger, settled.key.base_colors(strokes))
    return scaled(colored, 1.0, 0.6, opacities=opacity * solid)
