"""All options of rendering in one value: everything but strokes, camera and texture.

It is resolved once, for a still or a whole path, and passed on as a whole.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brushes, Sigmas, per_row
from brushgs.options.choices import Filter, Lock, Order, ViewLock
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.project import LOW_PASS, Directions, ProjectCounts, ProjectOptions, project_by
from brushgs.rendering.rasterize import Below, RasterOptions, rasterize, rasterize_over
from brushgs.rendering.relief import Relief
from brushgs.rendering.underpaint import STROKE_REACH, Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """Options of rendering; `RenderOptions.of` resolves them for a texture.

    Attributes:
        num_sigmas: half extent of a box in standard deviations, > 0; one number, or one per brush.
        lock: direction of strokes: "anchor" or "off", or the `Directions` of one view; "track" as long as the
            directions of a frame are not set, see `in_direction`.
        order: "depth" or "soft", see `project`.
        filter: see `rasterize`.
        low_pass: variance added to every projected Gaussian, px^2, >= 0.
        fade: fade strokes that would otherwise appear or vanish, see `project`.
        depth: whether frames have a depth.
        underpaint: soft copies behind strokes, see `rasterize`; or None.
        streaks: amplitude of streaks along strokes, see `rasterize`.
        relief: height of the paint, see `project`; frames then have a height. None for none.
        min_transmittance: see `rasterize`.
        num_threads: None takes the processors available to this process. The picture does not depend on it.
    """

    num_sigmas: Sigmas
    lock: Lock | Directions = "anchor"
    order: Order = "depth"
    filter: Filter = "mip"
    low_pass: float = LOW_PASS
    fade: bool = True
    depth: bool = True
    underpaint: Underpaint | None = None
    streaks: float = 0.0
    relief: Relief | None = None
    min_transmittance: float = MIN_TRANSMITTANCE
    num_threads: int | None = None

    @classmethod
    def of(
        cls,
        texture: Brushes,
        *,
        num_sigmas: Sigmas | None = None,
        underpaint: bool | Underpaint | None = False,
        **options: Any,
    ) -> "RenderOptions":
        """The options for a texture or a set of brushes.

        A built-in kernel is drawn with lock "off", by depth, without underpaint and streaks, and never fades.

        Args:
            texture: the brush or brushes.
            num_sigmas: None takes `texture.fitted_sigmas`, with underpaint `STROKE_REACH` times that.
            underpaint: True takes that of `Underpaint.for_sigmas`.
            **options: other fields; missing ones keep their defaults.
        """
        sigmas = texture.fitted_sigmas if num_sigmas is None else num_sigmas
        if not texture.is_directed:
            plain = {"lock": "off", "order": "depth", "fade": False, "streaks": 0.0}
            return cls(num_sigmas=sigmas, **options | plain)
        if not underpaint:
            return cls(num_sigmas=sigmas, **options)
        if num_sigmas is None:
            if isinstance(sigmas, tuple):
                sigmas = tuple(STROKE_REACH * each for each in sigmas)
            else:
                sigmas *= STROKE_REACH
        layer = underpaint if isinstance(underpaint, Underpaint) else Underpaint.for_sigmas(sigmas)
        return cls(num_sigmas=sigmas, underpaint=layer, **options)

    def in_direction(self, lock: ViewLock | Directions) -> "RenderOptions":
        """The same for one view of a path, with these directions."""
        return replace(self, lock=lock)

    def as_still(self) -> "RenderOptions":
        """The same for a picture that belongs to no path and is not lit, by depth order."""
        return replace(self, lock="anchor" if self.lock == "track" else self.lock, order="depth", relief=None)

    def for_marks(self, texture: Brushes) -> "RenderOptions":
        """The same for marks of another texture, without underpaint and streaks."""
        return replace(self, num_sigmas=texture.fitted_sigmas, underpaint=None, streaks=0.0)

    def projection_of(self, count: int, brushes: NDArray[np.uint8] | None = None) -> ProjectOptions:
        """Options for `project`.

        Args:
            count: number of strokes.
            brushes: of the strokes, see `Gaussians`.

        Raises:
            ValueError: if a value is out of range, `lock` is "track" (a frame needs its directions), or a
                brush is beyond the set.
        """
        sigmas = self.num_sigmas
        return ProjectOptions(
            num_sigmas=per_row("project", sigmas, brushes, count) if isinstance(sigmas, tuple) else sigmas,
            low_pass=self.low_pass,
            lock="anchor" if self.lock == "canonical" else self.lock,  # of strokes without fields
            fade=self.fade,
            order=self.order,
            underpaint=self.underpaint is not None,
            relief=self.relief,
            num_threads=self.num_threads,
        )


def check_arguments(
    where: str, gaussians: object, cameras: Iterable[object], layers: object = (), **numbers: object
) -> None:
    """Check the types of arguments of a painting function.

    Raises:
        TypeError: names the argument and its type.
    """
    if not isinstance(gaussians, Gaussians):
        cure = "; load the file first, with brushgs.load" if isinstance(gaussians, str | Path) else ""
        cure = "; the camera comes second" if isinstance(gaussians, Camera) else cure
        raise TypeError(f"{where}: gaussians must be Gaussians, got {type(gaussians).__name__}{cure}")
    for camera in cameras:
        if not isinstance(camera, Camera):
            raise TypeError(f"{where}: camera must be a Camera, got {type(camera).__name__}")
    if isinstance(layers, str):
        raise TypeError(f"{where}: layers must be a list of names such as [{layers!r}], got text")
    for name, value in numbers.items():
        if isinstance(value, str | bytes | bool) or not hasattr(type(value), "__float__"):
            raise TypeError(f"{where}: {name} must be a number, got {value!r:.80}")


def project_with(gaussians: Gaussians, camera: Camera, options: RenderOptions) -> tuple[Boxes, ProjectCounts]:
    """`project` with these options, and cull counts. Raises the same."""
    return project_by(gaussians, camera, options.projection_of(len(gaussians), gaussians.brushes))


def rasterize_with(
    boxes: Boxes,
    camera: Camera,
    texture: Brushes,
    options: RenderOptions,
    *,
    below: Below | None = None,
    **given: Any,
) -> Frame:
    """`rasterize` with these options, in the size of a camera. Raises the same.

    Args:
        boxes: as of `rasterize`.
        camera: gives the size.
        texture: as of `rasterize`.
        options: of rendering.
        below: what the boxes are painted over, see `rasterize_over`; or None.
        **given: `blend`, `in_front_of`, `part` and `dpi` of `rasterize`, unless they have their defaults.
    """
    given |= {
        "height": camera.height,
        "width": camera.width,
        "filter": options.filter,
        "depth": options.depth,
        "underpaint": options.underpaint,
        "streaks": options.streaks,
        "relief": options.relief is not None,
        "min_transmittance": options.min_transmittance,
        "num_threads": options.num_threads,
    }
    if below is None:
        return rasterize(boxes, texture, **given)
    return rasterize_over(boxes, texture, RasterOptions(**given), below)


def draw_with(
    gaussians: Gaussians, camera: Camera, texture: Brushes, options: RenderOptions
) -> tuple[Boxes, Frame]:
    """The boxes of one view, and their frame. Raises as `render` does."""
    boxes, _ = project_with(gaussians, camera, options)
    return boxes, rasterize_with(boxes, camera, texture, options)


def render_with(gaussians: Gaussians, camera: Camera, texture: Brushes, options: RenderOptions) -> Frame:
    """`render` with these options. Raises the same."""
    return draw_with(gaussians, camera, texture, options)[1]
