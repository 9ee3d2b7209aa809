"""Verification of a picture before it is timed: no curve may contain a fast but wrong picture.

A square of the picture with many strokes is painted again from the same strokes by the float64 definition of
drawing (`brushgs.rendering.reference`). The two may differ by the rounding of float32. A few pixels may
differ more, if rounding moves them across a box edge, the skip of faint paint or the early stop.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from brushgs.brushes.brush_set import Brushes
from brushgs.measure.bench.figures import Verified
from brushgs.rendering import reference
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.rasterize import RasterOptions
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

SIDE = 32  # pixels of the square
STEP = 1 / 255  # of an 8-bit picture


class WrongPictureError(RuntimeError):
    """A picture that does not agree with its definition, so its time is meaningless."""


@dataclass(frozen=True)
class Bound:
    """The maximum difference of a picture from its definition.

    Attributes:
        mean: difference of a channel, 0 to 1, over all pixels except those beyond a step.
        beyond_step: share of the pixels off by more than 1/255.
    """

    mean: float
    beyond_step: float


# The worst measured in any family of real scenes: 1.9e-6, and no pixel beyond a step. The bound allows 2 of
# 32 x 32.
SINGLE = Bound(mean=2e-5, beyond_step=2e-3)
DOUBLE = Bound(mean=1e-9, beyond_step=0.0)


def bound_of(frame: Frame) -> Bound:
    """The bound for the dtype of a picture."""
    return SINGLE if frame.rgb.dtype == np.float32 else DOUBLE


def check_close(
    name: str, frame: Frame, expected: Frame, against: str, bound: Bound | None = None
) -> Verified:
    """Measure the difference of a picture from the expected one.

    Raises:
        WrongPictureError: if that is beyond `bound` (None: the one for its dtype); names the point.
    """
    bound = bound or bound_of(frame)
    planes = [np.abs(np.subtract(frame.rgb, expected.rgb, dtype=np.float64))]
    planes.append(np.abs(np.subtract(frame.alpha, expected.alpha, dtype=np.float64))[..., None])
    off = np.concatenate(planes, axis=2)
    is_far = off.max(axis=2) > STEP
    mean = float(off[~is_far].mean()) if not is_far.all() else float(off.mean())
    found = Verified(against, mean, float(is_far.mean()), float(off.max()))
    if not (found.mean <= bound.mean and found.beyond_step <= bound.beyond_step):
        raise WrongPictureError(
            f"bench: {name} paints another picture than {against}: mean difference {found.mean:.1e} (at most "
            f"{bound.mean:.0e}), {found.beyond_step:.2%} of the pixels off by a step (at most "
            f"{bound.beyond_step:.1%})"
        )
    return found


def check_equal(name: str, result: Any, verified: Any) -> None:
    """Check that a repeated run gave the verified result, bit for bit: two values of one dataclass of arrays.

    Raises:
        WrongPictureError: if they differ; names the point.
    """
    for field in fields(verified):
        one, other = getattr(result, field.name), getattr(verified, field.name)
        if isinstance(one, Gaussians) and isinstance(other, Gaussians):
            check_equal(name, one, other)
        # Other values, not arrays, are the same object.
        elif one is not other and (one is None or not np.array_equal(one, other)):
            raise WrongPictureError(f"bench: {name} gave another result when it ran again: {field.name}")


def check_square(
    name: str,
    frame: Frame,
    gaussians: Gaussians,
    camera: Camera,
    texture: Brushes,
    options: RenderOptions,
    *,
    side: int = SIDE,
) -> Verified:
    """Verify a square of a frame of `render_with(gaussians, camera, texture, options)` by its definition.

    Raises:
        WrongPictureError: see `check_close`.
    """
    boxes = expected_boxes(gaussians, camera, options)
    x, y = busiest_square(boxes, camera, side)
    width, height = min(side, camera.width - x), min(side, camera.height - y)
    reach = 2.0 if options.underpaint is None else 2.0 * max(1.0, np.max(options.underpaint.reach))
    near = replace(boxes, centers=boxes.centers - (x, y)).take(touching(boxes, x, y, side, reach))
    expected = reference.rasterize(
        near,
        texture,
        RasterOptions(
            width=width,
            height=height,
            filter=options.filter,
            underpaint=options.underpaint,
            streaks=options.streaks,
            min_transmittance=options.min_transmittance,
        ),
    )
    square = Frame(frame.rgb[y : y + height, x : x + width], frame.alpha[y : y + height, x : x + width])
    return check_close(name, square, expected, f"the reference, {width}x{height} pixels from ({x}, {y})")


def expected_boxes(gaussians: Gaussians, camera: Camera, options: RenderOptions) -> Boxes:
    """The float64 boxes that `render_with` should paint by these options."""
    return reference.project(
        gaussians, camera, **vars(options.projection_of(len(gaussians), gaussians.brushes))
    )


def busiest_square(boxes: Boxes, camera: Camera, side: int) -> tuple[int, int]:
    """Upper left corner (x, y) of the square of a regular grid that contains the most box centers."""
    columns, rows = -(-camera.width // side), -(-camera.height // side)
    column, row = (boxes.centers // side).astype(np.int64).T
    is_inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    counts = np.bincount(row[is_inside] * columns + column[is_inside], minlength=rows * columns)
    y, x = divmod(int(np.argmax(counts)), columns)
    return x * side, y * side


def touching(boxes: Boxes, x: int, y: int, side: int, reach: float = 2.0) -> Any:
    """[M] whether a box may reach into a square; filtered stroke images, and underpaint, reach beyond it."""
    middle = np.array([x, y]) + 0.5 * side
    farthest = reach * np.hypot(*boxes.half_extents.T)[:, None] + side
    return (np.abs(boxes.centers - middle) < farthest).all(axis=1)
