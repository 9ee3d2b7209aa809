"""A depth test: boxes fade out behind a limit that each pixel sets.

Transparent paint covers nothing, so what lies on the far side of a subject would show through its near side.
Tested against the depth of the plain picture, only the near side is painted.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from brushgs.values.arrays import Array, check
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

# From this alpha on a plain picture has a surface that hides what lies behind. Less is fog and the rims of a
# subject, whose depth is a mean of near and far.
SOLID = 0.15
SIZES = 1.6  # of a stroke: how far behind the surface it may lie; most centres lie within 1


@dataclass(frozen=True, eq=False)
class DepthTest:
    """How far back boxes are seen, and how softly they end there.

    The alpha of box i at a pixel is multiplied by s(x) = x^2 (3 - 2 x), where x is (limit + tolerance_i -
    depth_i) / (tolerance_i / 2) clipped to 0 to 1: all of it is left where the box lies at most half its
    tolerance behind the limit, nothing where it lies its tolerance behind. Without tolerance it ends at the
    limit.

    Attributes:
        limit: [H, W] depth, world units; infinite where boxes are seen all the way.
        tolerance: [M] world units, >= 0, of each box.

    Raises:
        TypeError: if a column is no array.
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
        """That of the surface which a plain picture shows.

        Args:
            plain: the plain picture of the scene in the view of the boxes, with depth. Where its alpha is at
                most `SOLID` there is no limit.
            boxes: M boxes.
            strokes: what the boxes are the boxes of.
            sizes: tolerance in sizes of a stroke, the geometric mean of its two larger standard deviations.

        Raises:
            ValueError: if the picture has no depth.
        """
        if plain.depth is None:
            raise ValueError("DepthTest: the plain picture must have a depth; render it with depth=True")
        limit = np.where(plain.alpha > SOLID, plain.depth, np.inf).astype(plain.depth.dtype)
        larger = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
        return cls(limit, sizes * np.sqrt(larger.prod(axis=1))[boxes.ids])


def depth_test_arguments(
    where: str, boxes: Boxes, test: DepthTest | None, height: int, width: int
) -> dict[str, Any]:
    """What the core takes of a depth test; nothing where there is none.

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
    # In float64, and in units of the world whatever the soft order needs: only differences of depths count.
    tolerance = test.tolerance.astype(np.float64)
    ends = boxes.depths.astype(np.float64) - tolerance
    steepness = 2 / np.maximum(tolerance, 4 * float(np.finfo(dtype).tiny))
    with np.errstate(over="ignore"):  # beyond what the dtype can say is infinite
        fades = np.stack([ends, steepness], axis=1).astype(dtype)
        limits = np.ascontiguousarray(test.limit, dtype=dtype)
    return {"limits": limits, "fades": fades}
