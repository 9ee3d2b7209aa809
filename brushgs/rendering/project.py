"""Gaussians and one camera -> Boxes: oriented rectangles on the image plane, in pixels, nearest first.

Computed by the compiled core; the reference definition is `brushgs.rendering.reference.project`.
"""

from dataclasses import astuple, dataclass
from math import inf
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import Lock, Order, ViewLock
from brushgs.rendering.relief import Relief
from brushgs.values.arrays import F64, check
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import used_sh_degree

LOW_PASS = 0.3  # px^2, as in training
# Depth range of cross-fading in soft order, in stroke sizes: visible swaps vanish, and the error to the plain
# picture does not grow.
SOFTNESS = 0.5


@dataclass(frozen=True)
class ProjectCounts:
    """Numbers of culled Gaussians, by the first reason that applies.

    Attributes:
        behind_near: camera z at or below `camera.near`.
        not_finite: a value of the box overflows the dtype of the scene.
        faint: opacity below 1/255, which the rasteriser would skip.
        outside: the axis-aligned bounding rectangle of the box lies outside the image.
    """

    behind_near: int
    not_finite: int
    faint: int
    outside: int

    def __add__(self, other: "ProjectCounts") -> "ProjectCounts":
        return ProjectCounts(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    @property
    def total(self) -> int:
        """Total number of culled Gaussians."""
        return self.behind_near + self.not_finite + self.faint + self.outside


@dataclass(frozen=True, eq=False)
class Directions:
    """Directions of strokes in one view, chosen by `track_directions` along a path.

    A box turned off the axes of its ellipse must be larger. Its opacity is divided by its area over that of
    the smallest box around the ellipse, so that the amount of paint stays.

    Attributes:
        angles: [N] float32, direction of the u axis of each Gaussian's box, radians from +x towards +y.
        area_scales: [N] float32 >= 1, least area of each box over that of the smallest box around its
            ellipse: a stroke that turns across its ellipse grows over several frames. None: 1 for all.

    Raises:
        TypeError: if a column is not float32.
        ValueError: if lengths differ, an angle is not finite or an area scale is under 1.
    """

    angles: NDArray[np.float32]  # [N]
    area_scales: NDArray[np.float32] | None = None  # [N]

    def followed_by(self, others: "Directions") -> "Directions":
        """Those of these Gaussians, then those of others."""
        scales = None
        if self.area_scales is not None or others.area_scales is not None:
            parts = (
                np.ones_like(one.angles) if one.area_scales is None else one.area_scales
                for one in (self, others)
            )
            scales = np.concatenate(list(parts))
        return Directions(np.concatenate([self.angles, others.angles]), scales)

    def first(self, num: int) -> "Directions":
        """Those of the first Gaussians."""
        if num == len(self.angles):
            return self
        return Directions(self.angles[:num], None if self.area_scales is None else self.area_scales[:num])

    def __post_init__(self) -> None:
        columns = {"angles": self.angles} | (
            {} if self.area_scales is None else {"area_scales": self.area_scales}
        )
        for name, column in columns.items():
            if not isinstance(column, np.ndarray) or column.dtype != np.float32:
                raise TypeError(f"Directions: {name} must be a float32 array")
            column = np.ascontiguousarray(column).view()
            column.flags.writeable = False
            object.__setattr__(self, name, column)
        check("Directions", **{name: (column, "N") for name, column in columns.items()})
        if not np.isfinite(self.angles).all():
            raise ValueError("Directions: angles must be finite")
        if self.area_scales is not None and not (self.area_scales >= 1).all():
            raise ValueError("Directions: area_scales must be >= 1")

    def __len__(self) -> int:
        return len(self.angles)


@dataclass(frozen=True, kw_only=True)
class ProjectOptions:
    """The options of `project`, documented there.

    Raises:
        ValueError: if a value is out of range.
    """

    num_sigmas: float | F64 = 2.0
    low_pass: float = LOW_PASS
    lock: Lock | Directions = "off"  # "track" is refused: a single view has no path
    fade: bool = False
    order: Order = "depth"
    underpaint: bool = False
    relief: bool | Relief | None = None
    num_threads: int | None = None

    def __post_init__(self) -> None:
        if isinstance(self.num_sigmas, np.ndarray):
            check("project", num_sigmas=(self.num_sigmas, "N"))
        is_wrong = ~((np.atleast_1d(self.num_sigmas) > 0) & (np.atleast_1d(self.num_sigmas) < inf))
        if is_wrong.any():
            wrong = np.atleast_1d(self.num_sigmas)[np.argmax(is_wrong)]
            raise ValueError(f"project: num_sigmas must be positive and finite, got {wrong}")
        if not 0 <= self.low_pass < inf:
            raise ValueError(f"project: low_pass must be >= 0 and finite, got {self.low_pass}")
        if self.order not in get_args(Order):
            raise ValueError(
                f"project: order must be one of {', '.join(get_args(Order))}, got {self.order!r}"
            )
        if self.directions is None and self.lock not in get_args(ViewLock):
            raise ValueError(
                f"project: lock must be {', '.join(get_args(ViewLock))} or Directions, got {self.lock!r}"
            )

    @property
    def directions(self) -> Directions | None:
        """The directions in `lock`, if any."""
        return self.lock if isinstance(self.lock, Directions) else None

    def core_arguments(self, gaussians: Gaussians, camera: Camera) -> dict[str, Any]:
        """Core arguments common to projection and its derivative.

        Raises:
            TypeError: if an argument has another type.
            ValueError: if there are too many Gaussians, or not one direction for each.
        """
        if not isinstance(gaussians, Gaussians):
            raise TypeError(f"project: gaussians must be Gaussians, got {type(gaussians).__name__}")
        if not isinstance(camera, Camera):
            raise TypeError(f"project: camera must be a Camera, got {type(camera).__name__}")
        if len(gaussians) >= 2**31:
            raise ValueError(
                f"project: gaussians must be fewer than 2^31, got {len(gaussians)}; prune them first"
            )
        given = self.directions
        of_row = self.num_sigmas if isinstance(self.num_sigmas, np.ndarray) else None
        if of_row is not None and len(of_row) != len(gaussians):
            raise ValueError(
                f"project: num_sigmas must be one number, or one for each of {len(gaussians)} Gaussians, "
                f"got {len(of_row)}"
            )
        if given is not None and len(given) != len(gaussians):
            raise ValueError(
                f"project: lock must hold {len(gaussians)} directions, one per Gaussian, got {len(given)}"
            )
        return {
            **gaussians.columns(),
            "antialiased": bool(gaussians.antialiased),
            "view": view_of(camera),
            "num_sigmas": float(self.num_sigmas) if of_row is None else 0.0,
            "sigmas_of_row": None if of_row is None else np.ascontiguousarray(of_row, np.float64),
            "low_pass": float(self.low_pass),
            "lock": _core.Lock.given if given is not None else getattr(_core.Lock, str(self.lock)),
            "directions": None if given is None else given.angles,
            "area_scales": None if given is None else given.area_scales,
            "fades": bool(self.fade),
            "num_threads": num_threads_or_default(self.num_threads),
        }


def project(
    gaussians: Gaussians,
    camera: Camera,
    *,
    num_sigmas: float | F64 = 2.0,
    low_pass: float = LOW_PASS,
    lock: ViewLock | Directions = "off",
    fade: bool = False,
    order: Order = "depth",
    underpaint: bool = False,
    relief: bool | Relief = False,
    num_threads: int | None = None,
) -> Boxes:
    """Project Gaussians to oriented boxes on the image plane.

    The ellipse of a Gaussian is that of the projected covariance M M^T + low_pass I, M = J W R S. Its box is
    the smallest one around the ellipse at `num_sigmas` standard deviations, in the direction chosen by
    `lock`. Opacities of antialiased Gaussians are multiplied by the root of det(M M^T) / det(M M^T + low_pass
    I). Invisible Gaussians are culled, see `ProjectCounts`.
    Source: Zwicker et al. 2002, EWA Splatting (local affine projection); Kerbl et al. 2023 (the clamp of the
    Jacobian to 1.3 times the field of view, the low-pass, the spherical harmonics).

    Args:
        gaussians: N Gaussians in world space, fewer than 2^31.
        camera: one pinhole camera.
        num_sigmas: half extent of a box in standard deviations, > 0; or [N], one per Gaussian.
        low_pass: variance added to both axes, pixels squared, >= 0; 0.3 as in training.
        lock: direction of the u axis. "off": along the major axis of the ellipse, angle in (-pi/2, pi/2], as
            published; it jumps by half a turn where that axis is vertical. "anchor": the branch of the major
            axis nearer to the projection of the Gaussian's longest axis, bent toward that projection as the
            ellipse gets round; continuous except for views along the longest axis; angle in (-pi, pi].
            `Directions`: as chosen by `track_directions`.
        fade: fade strokes that would otherwise appear or vanish between frames: from eight times the near
            distance to the near plane, from 4 to 100 times the area of the picture, and as their length falls
            below a pixel (by its ratio to the length with `low_pass`; antialiased ones always do that).
        order: "depth": boxes without softness. "soft": softness is `SOFTNESS` times the geometric mean of the
            two larger scales; `rasterize` lets boxes fade into each other over it.
        underpaint: give boxes setbacks for `rasterize`: the geometric mean of the two larger scales,
            independent of the view.
        relief: give boxes reliefs, True for the default `Relief`. Both numbers of a stroke grow with the root
            of its size among all strokes, vary from row to row, and scale with the root of the picture's
            area.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        At most N boxes in the dtype of the scene, nearest first, ties by row: equal input gives equal output.
        Geometry is computed in float64 for either dtype. Boxes keep the brushes of their Gaussians.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if `num_sigmas`, `low_pass` or `num_threads` is out of range, or `lock` or `order` is
            unknown.

    For equal axes the angle of "off" is undefined: 0 is returned.

    Example:
        >>> boxes = bg.project(strokes, camera)
        >>> boxes
        Boxes(...)
        >>> bool((np.diff(boxes.depths) >= 0).all())
        True
    """
    options = ProjectOptions(
        num_sigmas=num_sigmas,
        low_pass=low_pass,
        lock=lock,
        fade=fade,
        order=order,
        underpaint=underpaint,
        relief=relief,
        num_threads=num_threads,
    )
    return project_by(gaussians, camera, options)[0]


def project_by(gaussians: Gaussians, camera: Camera, options: ProjectOptions) -> tuple[Boxes, ProjectCounts]:
    """`project` with these options, and cull counts: `len(boxes) + counts.total == len(gaussians)`."""
    arguments = options.core_arguments(gaussians, camera)
    columns, culled = _core.project(
        **arguments,
        sh_degree=used_sh_degree(gaussians),
        softness=SOFTNESS if options.order == "soft" else 0.0,
        with_setbacks=bool(options.underpaint),
    )
    if (relief := Relief.of(options.relief)) is not None:
        columns["reliefs"] = relief.of_boxes(gaussians, columns["ids"], camera)
    brushes = None if gaussians.brushes is None else gaussians.brushes[columns["ids"]]
    return Boxes(**columns, brushes=brushes), ProjectCounts(**culled)


def view_of(camera: Camera) -> _core.View:
    """A camera for the core."""
    return _core.View(
        viewmat=camera.viewmat,
        K=camera.K,
        width=int(camera.width),
        height=int(camera.height),
        near=float(camera.near),
    )
