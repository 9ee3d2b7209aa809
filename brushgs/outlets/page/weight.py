"""Cost of a page for the device that shows it: bytes, vertices, fragments; and warnings for slow devices."""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.options.page import HEADSET_FRAGMENTS, PHONE_BYTES, PHONE_FRAGMENTS, UNDERPAINT_STEP
from brushgs.rendering.areas import seen_areas
from brushgs.rendering.coat import Coat
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera

CORNERS = 4  # of a quad


@dataclass(frozen=True)
class Weight:
    """What a page costs.

    Attributes:
        vertices: of one picture: four per stroke, and four more for its underpaint.
        fragments: of the first view: areas of all boxes within the picture, including underpaint.
        fragments_bare: without underpaint.
        painted: pixels of the first view that strokes paint.
        pixels: of the first view.
    """

    vertices: int
    fragments: float
    fragments_bare: float
    painted: int
    pixels: int

    @property
    def overdraw(self) -> float:
        """Mean number of fragments per painted pixel."""
        return self.fragments / max(self.painted, 1)

    @property
    def moving(self) -> float:
        """Mean number of fragments per pixel of a picture that moves, whose underpaint is a small layer."""
        behind = self.fragments - self.fragments_bare
        return (self.fragments_bare + behind / UNDERPAINT_STEP**2) / self.pixels + (behind > 0)

    @property
    def per_pixel(self) -> float:
        """Mean number of fragments per pixel of the picture, which hardly depends on its size."""
        return self.fragments / self.pixels


def vertices_of(coat: Coat, count: int) -> int:
    """Vertices of `count` strokes of a coat."""
    return count * CORNERS * (1 if coat.options.underpaint is None else 2)


def fragments_of(coat: Coat, boxes: Boxes, camera: Camera) -> tuple[float, float]:
    """Areas within the picture of the boxes of a coat, and of their underpaint, pixels."""
    areas = float(seen_areas(boxes, camera.width, camera.height).sum())
    underpaint = coat.options.underpaint
    if underpaint is None:
        return areas, 0.0
    reaches = underpaint.reaches(boxes)
    reach = np.asarray(underpaint.reach, np.float64) if reaches is None else reaches[:, None]
    behind = replace(boxes, half_extents=(boxes.half_extents * reach).astype(boxes.half_extents.dtype))
    return areas, float(seen_areas(behind, camera.width, camera.height).sum())


def warnings_of(weight: Weight, num_bytes: int) -> list[str]:
    """Sentences on devices for which a page is too heavy; usually none.

    The limits are estimates, not measured on devices. A phone takes some seconds to load 8 MB (`PHONE_BYTES`)
    on a mobile network. 24 fragments a pixel (`PHONE_FRAGMENTS`) of 1280 x 720 pixels at 30 frames a second
    are 0.7 billion per second, each with two or three texture reads and blended into half floats. A headset
    has two eyes of about 1.4 million pixels at 72 frames per second: 6 fragments per pixel
    (`HEADSET_FRAGMENTS`) are 1.2 billion per second. A million small splats run on a Quest 3, 47 thousand
    large ones lag.
    """
    found = []
    if num_bytes > PHONE_BYTES:
        found.append(
            f"the page has {num_bytes / 1e6:.1f} MB, much for a phone (over {PHONE_BYTES / 1e6:g}); fewer "
            "--strokes make it smaller"
        )
    limits = (("a phone", PHONE_FRAGMENTS), ("a headset", HEADSET_FRAGMENTS))
    slow = [f"{name} (over {limit:g})" for name, limit in limits if weight.moving > limit]
    if slow:
        fact = (
            f"a moving pixel is painted {weight.moving:.1f} times in the mean, slow on {' and '.join(slow)}"
        )
        bare = weight.fragments_bare / weight.pixels
        found.append(fact if bare == weight.moving else f"{fact}; --underpaint off leaves {bare:.1f}")
    return found
