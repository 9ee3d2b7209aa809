"""Pen and brush in ink: the darkest masses in solid black, hatching along the form, lines by weight."""

from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Ink
from brushgs.pipeline.media.hatching import hatching_coats, stage
from brushgs.pipeline.media.materials import Materials, numbers_of
from brushgs.pipeline.media.tonal import ground_coat, keyed_tones, views_of, weighed_lines
from brushgs.rendering.coat import Coat
from brushgs.rendering.tonal import Blacks, blacks_of, large_ones
from brushgs.values.colors import rgb_of

if TYPE_CHECKING:
    from brushgs.passes.add.tonal_view import TonalView
    from brushgs.values.arrays import Mask

# Of the edges of blacks in films. Along an orbit the truck flickers by 14.3 of 255 more than its plain
# picture, by 21.2 with sharp edges.
FILM_SOFTNESS = 0.06
MOST_BLACKS, LEAST_BLACK = 25, 140.0  # regions in a picture, and px of each in one of 960 x 540

__all__ = ["ink", "stage"]


def ink(materials: Materials) -> list[Coat]:
    """The coats of a drawing in ink."""
    media = numbers_of(Ink, materials)
    tones = keyed_tones(materials)
    views = views_of(materials, tones)
    blacks, masks = _blacks(media, materials, views)
    coats = [ground_coat(materials, tones, blacks)]
    coats += hatching_coats(materials, views, masks)
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
    softness = FILM_SOFTNESS if materials.sight is not None and materials.sight.is_film else 0.0
    effect = Blacks(threshold, least, rgb_of(media.color), materials.paper, softness)
    masks = [large_ones(view.tones.is_black(threshold), least) for view in views]
    return effect, [np.asarray(mask) for mask in masks]
