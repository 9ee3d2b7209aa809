"""Details of the published method that the package does not offer, for comparison."""

from dataclasses import replace

import numpy as np

from brushgs.values.boxes import Boxes


def whole_pixels(boxes: Boxes) -> Boxes:
    """The boxes with half extents rounded up to whole pixels."""
    return replace(boxes, half_extents=np.ceil(boxes.half_extents))
