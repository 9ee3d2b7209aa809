"""Stroke directions of styles: those of the marks in their paintings, by share."""

from collections.abc import Sequence

import numpy as np

from brushgs.passes.form.mark_directions import Marks, marks_at
from brushgs.passes.form.orient import ASPECT
from brushgs.values.camera import Camera
from brushgs.values.style import Style

CELLS = 64  # along the longer side of a picture: finer than the direction fields of styles


def direction_field(styles: Sequence[tuple[Style, float]], camera: Camera) -> Marks:
    """The marks of styles over the picture of a camera.

    Each style covers the picture as its painting would, scaled to fill it. Overlapping directions are added
    as vectors with the shares as weights, so opposite ones cancel. The strength of a direction grows with its
    share and its clearness. The aspect of marks is a geometric mean; if shares sum to less than 1, the rest
    counts as strokes without a style.

    Args:
        styles: with their shares, 0 to 1, at most 1 in all. Those without marks are ignored.
        camera: of the picture.
    """
    scale = CELLS / max(camera.width, camera.height)
    rows, columns = max(2, round(camera.height * scale)), max(2, round(camera.width * scale))
    y, x = ((np.arange(n) + 0.5) * size / n for n, size in ((rows, camera.height), (columns, camera.width)))
    across, down = (values.ravel() for values in np.meshgrid(x, y))
    pairs, aspect = np.zeros((len(down), 2)), np.log(ASPECT)
    for style, share in styles:
        if style.marks is not None:
            field = style.marks.directions.astype(np.float64)
            if min(field.shape[:2]) < 2:  # interpolation needs two cells a side
                field = field.repeat(2, axis=0).repeat(2, axis=1)
            pairs += share * marks_at(Marks(camera, field), across, down)
            aspect += share * (np.log(style.marks.aspect) - np.log(ASPECT))
    return Marks(camera, pairs.reshape(rows, columns, 2), float(np.exp(aspect)))
