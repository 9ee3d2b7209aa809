"""Depth test: boxes fade out behind a depth limit of each pixel.

Transparent paint hides nothing, so the far side of a subject would show through. Tested against the depth of
the plain picture, only the near side is painted.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from brushgs.values.arrays import Array, check
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

# Alpha above which a plain picture has an occluding surface. Below lie fog and rims, whose depth mixes near
# and far.
SOLID = 0.15
SIZES = 1.6  # tolerance behind the surface, in stroke sizes; most centers lie within 1


@dataclass(frozen=True, eq=False)
class DepthTest:
    """Depth limit per pixel, and tolerance per box.

    The alpha of box i at a pixel is multiplied by s(x) = x^2 (3 - 2 x), x = (limit + tolerance_i - depth_i) /
    (tolerance_i / 2) clipped to 0 to 1: unchanged up to half the tolerance behind the limit, 0 from the full
    tolerance on. With tolerance 0, boxes end at the limit.

    Attributes:
        limit: [H, W] depth, world units; infinite for no limit.
        tolerance: [M] world units, >= 0, of each box.

    Raises:
        TypeError: if a column is not an array.
        ValueError: if a shape is wrong, a limit is NaN, or a tolerance is negative, NaN or infinite.
    """

    limit: Array  # [H, W]
    tolerance: Array  # [M]

    def __post_init__(self) -> None:
        check("DepthTest", limit=(self.limit, "H W"), tolerance=(self.tolerance, "M"))
        if np.isnan(self.limit.min(initial=0)):
            raise ValueError("DepthTest: limit must not be NaN; where there is none, it is infinite")
        if not (np.isfinite(self.tolerance) & (self.tolerance >= 0)).all():
            raise ValueError("DepthTest: tolerance must be finite and >= 0")

    @classmethod
    def by_picture(
        cls, plain: Frame, boxes: Boxes, strokes: Gaussians, *, sizes: float = SIZES
    ) -> "DepthTest":
        """A test against the surface of a plain picture.

        Args:
            plain: plain picture of the scene in the view of the boxes, with depth; no limit where its alpha
                is at most `SOLID`.
            boxes: M boxes.
            strokes: the strokes of the boxes.
            sizes: tolerance in stroke sizes, the geometric mean of its two larger standard deviations.

        Raises:
            ValueError: if the picture has no depth.
        """
        if plain.depth is None:
            raise ValueError("DepthTest: the plain picture must have a depth; render it with depth=True")
        limit = plain.depth.copy()
        np.copyto(limit, np.inf, where=plain.alpha <= SOLID)
        larger = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
        return cls(limit, sizes * np.sqrt(larger.prod(axis=1))[boxes.ids])


def depth_test_arguments(
    where: str, boxes: Boxes, test: DepthTest | None, height: int, width: int
) -> dict[str, Any]:
    """Arguments of the core for a depth test; empty without one.

    Raises:
        TypeError: if `test` is neither None nor `DepthTest`.
        ValueError: if it is of another size.
    """
    if test is None:
        return {}
    if not isinstance(test, DepthTest):
        raise TypeError(f"{where}: in_front_of must be None or DepthTest, got {type(test).__name__}")
    for name, actual, expected in (
        ("limit", test.limit.shape, (height, width)),
        ("tolerance", test.tolerance.shape, (len(boxes),)),
    ):
        if actual != expected:
            raise ValueError(
                f"{where}: {name} of in_front_of must have shape {list(expected)}, got {list(actual)}"
            )
    dtype = boxes.depths.dtype
    # In float64 and world units, independent of the unit of the soft order: only depth differences count.
    tolerance = test.tolerance.astype(np.float64)
    ends = boxes.depths.astype(np.float64) - tolerance
    steepness = 2 / np.maximum(tolerance, 4 * float(np.finfo(dtype).tiny))
    with np.errstate(over="ignore"):  # overflow becomes infinity
        fades = np.stack([ends, steepness], axis=1).astype(dtype)
        limits = np.ascontiguousarray(test.limit, dtype=dtype)
    return {"limits": limits, "fades": fades}
