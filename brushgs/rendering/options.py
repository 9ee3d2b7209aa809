"""One value for all that decides how strokes become a frame: everything but strokes, camera and texture.

It is resolved once, for a still or for a whole path, and handed on whole.
"""

from dataclasses import dataclass, replace
from typing import Any

from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Filter, Lock, Order, ViewLock
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.project import LOW_PASS, Directions, ProjectCounts, ProjectOptions, project_by
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.underpaint import STROKE_REACH, Underpaint
from brushgs.scene import Boxes, Camera, Frame, Gaussians


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """How strokes become a frame; `RenderOptions.of` resolves it for a texture.

    Attributes:
        num_sigmas: half extent of a box in standard deviations, > 0.
        lock: which way strokes point: "anchor" or "off", or the `Directions` of one view; "track" where
            every frame of a path still has to take its own, see `in_direction`.
        order: "depth" or "soft", see `project`.
        filter: see `rasterize`.
        low_pass: variance added to every projected Gaussian, px^2, >= 0.
        fade: whether strokes fade where they would otherwise appear or vanish, see `project`.
        depth: whether frames have a depth.
        underpaint: what lies behind each stroke, see `rasterize`; None for nothing.
        streaks: amplitude of the streaks along strokes, see `rasterize`.
        min_transmittance: see `rasterize`.
        num_threads: None takes the processors available to this process. The picture does not depend on it.
    """

    num_sigmas: float
    lock: Lock | Directions = "anchor"
    order: Order = "depth"
    filter: Filter = "mip"
    low_pass: float = LOW_PASS
    fade: bool = True
    depth: bool = True
    underpaint: Underpaint | None = None
    streaks: float = 0.0
    min_transmittance: float = MIN_TRANSMITTANCE
    num_threads: int | None = None

    @classmethod
    def of(
        cls,
        texture: StrokeTexture,
        *,
        num_sigmas: float | None = None,
        underpaint: bool | Underpaint | None = False,
        **options: Any,
    ) -> "RenderOptions":
        """The options for a texture.

        A built-in kernel is drawn with lock "off", by depth, without underpaint and streaks, and never fades.

        Args:
            texture: what strokes are painted with.
            num_sigmas: None takes `texture.fitted_sigmas`, over underpaint `STROKE_REACH` times that.
            underpaint: True takes that of `Underpaint.for_sigmas`.
            **options: other fields; what is not given keeps its default.
        """
        sigmas = texture.fitted_sigmas if num_sigmas is None else num_sigmas
        if not texture.is_directed:
            plain = {"lock": "off", "order": "depth", "fade": False, "streaks": 0.0}
            return cls(num_sigmas=sigmas, **options | plain)
        if not underpaint:
            return cls(num_sigmas=sigmas, **options)
        if num_sigmas is None:
            sigmas *= STROKE_REACH
        layer = underpaint if isinstance(underpaint, Underpaint) else Underpaint.for_sigmas(sigmas)
        return cls(num_sigmas=sigmas, underpaint=layer, **options)

    def in_direction(self, lock: ViewLock | Directions) -> "RenderOptions":
        """The same for one view of a path, whose strokes point in these directions."""
        return replace(self, lock=lock)

    @property
    def projection(self) -> ProjectOptions:
        """Those that `project` takes.

        Raises:
            ValueError: if a value is out of range, or `lock` is "track": a frame needs its directions.
        """
        return ProjectOptions(
            num_sigmas=self.num_sigmas,
            low_pass=self.low_pass,
            lock=self.lock,
            fade=self.fade,
            order=self.order,
            underpaint=self.underpaint is not None,
            num_threads=self.num_threads,
        )


def project_with(gaussians: Gaussians, camera: Camera, options: RenderOptions) -> tuple[Boxes, ProjectCounts]:
    """`project` by these options, and what was culled. Raises the same."""
    return project_by(gaussians, camera, options.projection)


def rasterize_with(boxes: Boxes, camera: Camera, texture: StrokeTexture, options: RenderOptions) -> Frame:
    """`rasterize` by these options, in the size of a camera. Raises the same."""
    return rasterize(
        boxes,
        texture,
        height=camera.height,
        width=camera.width,
        filter=options.filter,
        depth=options.depth,
        underpaint=options.underpaint,
        streaks=options.streaks,
        min_transmittance=options.min_transmittance,
        num_threads=options.num_threads,
    )


def draw_with(
    gaussians: Gaussians, camera: Camera, texture: StrokeTexture, options: RenderOptions
) -> tuple[Boxes, Frame]:
    """The boxes of one view, and the frame that they paint. Raises what `render` does."""
    boxes, _ = project_with(gaussians, camera, options)
    return boxes, rasterize_with(boxes, camera, texture, options)


def render_with(
    gaussians: Gaussians, camera: Camera, texture: StrokeTexture, options: RenderOptions
) -> Frame:
    """`render` by these options. Raises the same."""
    return draw_with(gaussians, camera, texture, options)[1]
