"""The first view of a page by the exact renderer, for browsers that cannot paint."""

import numpy as np

from brushgs.formats.pictures.oiio import Background
from brushgs.formats.pictures.still import encode_jpeg
from brushgs.outlets.page.columns import shown_by
from brushgs.outlets.page.images import reduced
from brushgs.outlets.page.weight import Weight, fragments_of, vertices_of
from brushgs.pipeline.drawing import warn_if_blank
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.rendering.canvas import Painting
from brushgs.rendering.constants import MIN_ALPHA
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

STILL_SIDE = 640  # px
MOST_BYTES = 80_000
ICON_SIDE = 64  # px
QUALITIES = (85, 75, 60, 45, 30)  # of JPEG, tried in turn


def paint_first_view(painting: Painting, camera: Camera) -> tuple[Frame, Weight]:
    """The picture of the first view, and its rendering cost. Warns if it is nearly blank."""
    painting = painting.with_depth(False)
    canvas = painting.canvas(camera)
    is_painted = np.zeros((camera.height, camera.width), bool)
    vertices, areas, behind, shown = 0, 0.0, 0.0, []
    for coat in painting.coats:
        boxes = coat.boxes(camera)[0]
        alpha = canvas.lay(coat, boxes).alpha
        is_painted |= alpha >= MIN_ALPHA
        vertices += vertices_of(coat, len(shown_by(coat)))
        of_coat = fragments_of(coat, boxes, camera)
        areas, behind = areas + of_coat[0], behind + of_coat[1]
        if coat.name != BACKDROP:
            shown.append((float(alpha.mean(dtype=np.float64)), len(boxes), boxes, coat))
    if shown:
        painted, _, boxes, coat = max(shown, key=lambda one: one[:2])
        warn_if_blank(coat, boxes, camera, painted)
    weight = Weight(vertices, areas + behind, areas, int(is_painted.sum()), is_painted.size)
    return canvas.finish(painting.lamp), weight


def icon_of(frame: Frame, background: Background) -> bytes:
    """The middle of the picture as a small square JPEG."""
    pixels = frame.bytes_over((1.0, 1.0, 1.0) if background is None else background)
    height, width = pixels.shape[:2]
    side = min(height, width)
    top, left = (height - side) // 2, (width - side) // 2
    square = reduced(pixels[top : top + side, left : left + side], ICON_SIDE)
    return encode_jpeg(np.rint(square).astype(np.uint8), QUALITIES[1])


def still_of(frame: Frame, background: Background) -> bytes:
    """A JPEG of at most `STILL_SIDE` pixels and `MOST_BYTES`; transparent parts are white.

    JPEG, since browsers without WebGL2 may be too old for other formats.
    """
    pixels = reduced(frame.bytes_over((1.0, 1.0, 1.0) if background is None else background), STILL_SIDE)
    whole = np.rint(pixels).astype(np.uint8)
    for quality in QUALITIES:
        content = encode_jpeg(whole, quality)
        if len(content) <= MOST_BYTES:
            break
    return content
