"""Gaussians and one camera -> Boxes: oriented rectangles on the image plane, in pixels, nearest first.

The arithmetic is in the compiled core; its plain definition is `brushgs.raster.reference.project`.
"""

from dataclasses import dataclass
from math import inf

from brushgs import _core
from brushgs.choices import ViewLock
from brushgs.scene import Boxes, Camera, Gaussians
from brushgs.sh import used_sh_degree
from brushgs.shapes import Array
from brushgs.threads import num_threads_or_default


@dataclass(frozen=True)
class ProjectCounts:
    """How many Gaussians have no box, each under the first reason that holds.

    Attributes:
        behind_near: camera z at or below `camera.near`.
        not_finite: a value of the box is too large for the dtype of the scene.
        faint: opacity under 1/255, which the rasteriser would skip everywhere.
        outside: the upright rectangle around the box has no area in common with the image.
    """

    behind_near: int
    not_finite: int
    faint: int
    outside: int

    @property
    def total(self) -> int:
        """All that were left out."""
        return self.behind_near + self.not_finite + self.faint + self.outside


def project(
    gaussians: Gaussians,
    camera: Camera,
    *,
    num_sigmas: float = 2.0,
    low_pass: float = 0.3,
    lock: ViewLock | Array = "off",
    num_threads: int | None = None,
) -> Boxes:
    """Project Gaussians to oriented boxes on the image plane.

    A box is the principal frame of the projected covariance M M^T + low_pass I with
    M = J W R S, cut at `num_sigmas` standard deviations; its u axis is the longer one, its angle in
    (-pi/2, pi/2]. Gaussians that cannot paint are left out: see `ProjectCounts`.
    Source: Zwicker et al. 2002, EWA Splatting (local affine projection); Kerbl et al. 2023 (the clamp of
    the Jacobian to 1.3 times the field of view, the low-pass, the spherical harmonics).

    Args:
        gaussians: N Gaussians in world space, fewer than 2^31.
        camera: one pinhole camera.
        num_sigmas: half extent of a box in standard deviations, > 0.
        low_pass: variance added to both axes, pixels squared, >= 0; 0.3 is what scenes are trained with.
        num_threads: threads to run in, None for one per CPU; the result is the same, bit for bit.

    Returns:
        At most N boxes in the dtype of the scene, nearest first, ties by row: equal input gives equal
        output. Geometry is computed in float64 for either dtype.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if `num_sigmas`, `low_pass` or `num_threads` is out of range.

    Where both axes are equally long the angle is undefined: 0 is returned there.
    """
    return project_counted(
        gaussians, camera, num_sigmas=num_sigmas, low_pass=low_pass, lock=lock, num_threads=num_threads
    )[0]


def project_counted(
    gaussians: Gaussians,
    camera: Camera,
    *,
    num_sigmas: float = 2.0,
    low_pass: float = 0.3,
    lock: ViewLock | Array = "off",
    num_threads: int | None = None,
) -> tuple[Boxes, ProjectCounts]:
    """`project`, and what was left out by it and why: `len(boxes) + counts.total == len(gaussians)`."""
    if not isinstance(gaussians, Gaussians):
        raise TypeError(f"project: gaussians must be Gaussians, got {type(gaussians).__name__}")
    if not isinstance(camera, Camera):
        raise TypeError(f"project: camera must be a Camera, got {type(camera).__name__}")
    if not 0 < num_sigmas < inf:
        raise ValueError(f"project: num_sigmas must be positive and finite, got {num_sigmas}")
    if not 0 <= low_pass < inf:
        raise ValueError(f"project: low_pass must be >= 0 and finite, got {low_pass}")
    if len(gaussians) >= 2**31:
        raise ValueError(
            f"project: gaussians must be fewer than 2^31, got {len(gaussians)}; prune them first"
        )
    columns, culled = _core.project(
        gaussians.means,
        gaussians.quats,
        gaussians.scales,
        gaussians.opacities,
        gaussians.sh,
        camera.viewmat,
        camera.K,
        width=int(camera.width),
        height=int(camera.height),
        near=float(camera.near),
        num_sigmas=float(num_sigmas),
        low_pass=float(low_pass),
        sh_degree=used_sh_degree(gaussians),
        num_threads=num_threads_or_default(num_threads),
    )
    return Boxes(*columns), ProjectCounts(*culled)
