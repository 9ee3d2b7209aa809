"""Leave out marks of a drawing in ink of which its view shows only a fleck, as something hides the rest."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage

from brushgs.options.media import Ink
from brushgs.pipeline.media.materials import Materials, numbers_of
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.nested import scale_of
from brushgs.values.arrays import Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import rgb_of

FLECK = 48.0  # px^2 in a picture of `PIXELS`, up to which ink that stands alone is a fleck
INKED = 0.5  # share of ink from which a pixel counts
PLACES = np.linspace(-0.95, 0.95, 11)  # along a mark, in half lengths, at which it is looked for


def without_flecks(
    materials: Materials, behind: list[Coat], drawn: list[Coat]
) -> tuple[list[Coat], list[Coat]]:
    """The coats behind and of a drawing, without the marks of flecks; in films as they are.

    Of `drawn` the first hides what lies below, and stays as it is.
    """
    media, sight = numbers_of(Ink, materials), materials.sight
    if sight is None or sight.is_film:
        return behind, drawn
    camera = sight.cameras[0]
    paper = np.asarray(materials.paper)
    frame = Painting.alone((*behind, *drawn)).frame(camera)
    tint = np.asarray(rgb_of(media.color)) - paper
    shares = (frame.rgb - frame.alpha[..., None] * paper) @ tint / max(float(tint @ tint), 1e-12)
    labels, _ = ndimage.label(shares > INKED, np.ones((3, 3)))
    areas = np.bincount(labels.ravel())
    is_small = areas < FLECK * scale_of(camera) ** 2
    is_small[0] = False
    if not is_small.any():
        return behind, drawn
    flecks, whole = (
        ndimage.maximum_filter(mask, 3) for mask in (is_small[labels], (labels > 0) & ~is_small[labels])
    )

    def cleared(coats: Sequence[Coat]) -> list[Coat]:
        return [_without(coat, camera, flecks, whole) for coat in coats]

    return cleared(behind), [drawn[0], *cleared(drawn[1:])]


def _without(coat: Coat, camera: Camera, flecks: Mask, whole: Mask) -> Coat:
    """A coat without the marks that show on flecks more than on other ink."""
    boxes = coat.boxes(camera)[0]
    along = np.stack([np.cos(boxes.angles), np.sin(boxes.angles)], axis=1) * boxes.half_extents[:, :1]
    columns, rows = np.floor(boxes.centers[:, None] + PLACES[:, None] * along[:, None]).astype(np.intp).T
    is_inside = (rows >= 0) & (columns >= 0) & (rows < len(flecks)) & (columns < flecks.shape[1])
    rows, columns = np.where(is_inside, rows, 0), np.where(is_inside, columns, 0)
    on_flecks, on_whole = ((is_inside & mask[rows, columns]).sum(axis=0) for mask in (flecks, whole))
    opacities = coat.strokes.opacities.copy()
    opacities[boxes.ids[on_flecks > on_whole]] = 0
    return replace(coat, strokes=replace(coat.strokes, opacities=opacities))
