"""Pen and brush in ink: the darkest masses in solid black, hatching along the form, lines by weight."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Ink
from brushgs.passes.neighbours import nearest
from brushgs.pipeline.media.flecks import without_flecks as cleared
from brushgs.pipeline.media.hatching import hatching_coats, stage
from brushgs.pipeline.media.materials import Materials, numbers_of
from brushgs.pipeline.media.tonal import ground_coat, keyed_tones, views_of, weighed_lines
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.tonal import Blacks, blacks_of, large_ones
from brushgs.values.colors import rgb_of

if TYPE_CHECKING:
    from brushgs.passes.add.tonal_view import TonalView
    from brushgs.values.arrays import F64, Mask
    from brushgs.values.gaussians import Gaussians

MOST_BLACKS, LEAST_BLACK = 25, 140.0  # regions in a picture, and px of each in one of 960 x 540
# Of blacks in films: range of tones over which ink thins out, and contrast between black strokes and others
# around half. Their edges are as sharp as in a still, and still move by less than a pixel.
FILM_SOFTNESS, CONTRAST = 0.06, 2.0

__all__ = ["cleared", "ink", "stage"]


def ink(materials: Materials) -> list[Coat]:
    """The coats of a drawing in ink."""
    tones = keyed_tones(materials)
    views = views_of(materials, tones)
    blacks, masks = _blacks(numbers_of(Ink, materials), materials, views)
    ground = ground_coat(materials, tones, blacks)
    is_film = materials.sight is not None and materials.sight.is_film
    if is_film and blacks is not None and masks is not None:
        fixed = replace(blacks, threshold=0.5, softness=FILM_SOFTNESS)
        ground = ground_coat(materials, lightness_in_space(materials.strokes, views, masks), fixed)
        masks = [_ink_in(ground, view) for view in views]
    coats = [ground, *hatching_coats(materials, views, masks)]
    return coats + weighed_lines(materials, tones)


def _blacks(
    media: Ink, materials: Materials, views: "list[TonalView]"
) -> "tuple[Blacks | None, list[Mask] | None]":
    """The effect that makes blacks, and the pixels of each view that are black."""
    if not views or media.black == 0:
        return None, None
    threshold, least = blacks_of(
        [views[0].tones], share=media.black, most_regions=MOST_BLACKS, least_pixels=LEAST_BLACK
    )
    effect = Blacks(threshold, least, rgb_of(media.color), materials.paper)
    masks = [large_ones(view.tones.is_black(threshold), least) for view in views]
    return effect, [np.asarray(mask) for mask in masks]


def lightness_in_space(strokes: "Gaussians", views: "list[TonalView]", masks: "list[Mask]") -> "F64":
    """[n] 0 for strokes that are black in most views that show them, 1 for others; little in between.

    In a film blacks must not depend on the view: a mass about as dark as the threshold would be black in one
    frame and not in the next. Strokes that no view shows are like the nearest that one does.

    Args:
        strokes: n.
        views: at least one.
        masks: [H, W] black pixels of each view.
    """
    black, shown = np.zeros((2, len(strokes)))
    for view, mask in zip(views, masks, strict=True):
        pixels, is_shown = view.at(strokes.means.astype(np.float64))
        columns, rows = pixels[is_shown].astype(np.intp).T
        black[is_shown] += view.tones.smoothed(mask)[rows, columns]
        shown[is_shown] += 1
    known = np.flatnonzero(shown)
    if not len(known):
        return np.ones(len(strokes))
    _, near = nearest(strokes.means[known], strokes.means, 1)
    shares = (black[known] / shown[known])[near[:, 0]]
    return np.asarray(1 - np.clip(0.5 + CONTRAST * (shares - 0.5), 0, 1))


def _ink_in(ground: Coat, view: "TonalView") -> "Mask":
    """[H, W] pixels of a view that a ground covers with ink."""
    frame = Painting.alone([ground]).frame(view.camera)
    assert isinstance(ground.effect, Blacks), "a ground of ink has blacks"
    (_, _), (shares, _) = ground.effect.areas(frame.over(ground.effect.paper))
    return np.asarray(shares > 0.5)
