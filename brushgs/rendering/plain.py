"""Plain pictures of a scene in a few small views, which strokes are fitted to.

They are drawn once for a painting, and passed to every pass that needs views of the scene.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Union

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.render import render
from brushgs.rendering.view_by_view import view_by_view
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class PlainViews:
    """V cameras, and the plain picture of the scene in each.

    Attributes:
        cameras: the views.
        frames: one for each, in the size of its camera.

    Raises:
        ValueError: if there are not as many frames as cameras, or sizes differ.
    """

    cameras: tuple[Camera, ...]
    frames: tuple[Frame, ...]

    def __post_init__(self) -> None:
        if len(self.cameras) != len(self.frames):
            counts = f"{len(self.frames)} and {len(self.cameras)}"
            raise ValueError(f"PlainViews: there must be one frame per camera, got {counts}")
        for index, (camera, frame) in enumerate(zip(self.cameras, self.frames, strict=True)):
            if frame.alpha.shape != (camera.height, camera.width):
                height, width = frame.alpha.shape
                raise ValueError(
                    f"PlainViews: frame {index} must have the size of its camera, "
                    f"{camera.width}x{camera.height}, got {width}x{height}"
                )

    def __len__(self) -> int:
        return len(self.cameras)

    def __repr__(self) -> str:
        sizes = {f"{camera.width}x{camera.height}" for camera in self.cameras}
        return f"PlainViews({len(self)} views, {' '.join(sorted(sizes))})"

    def pairs(self) -> Iterator[tuple[Camera, Frame]]:
        """Each camera with its frame."""
        return zip(self.cameras, self.frames, strict=True)

    @classmethod
    def of(cls, gaussians: Gaussians, views: Union[Sequence[Camera], "PlainViews"]) -> "PlainViews":
        """`views` itself, or plain pictures of the Gaussians for cameras."""
        return views if isinstance(views, PlainViews) else plain_views(gaussians, views)


def plain_views(
    gaussians: Gaussians, cameras: Sequence[Camera], *, depth: bool = False, num_threads: int | None = None
) -> PlainViews:
    """Draw the plain picture of a scene in each view.

    Args:
        gaussians: the whole scene, N Gaussians.
        cameras: the views; about 100,000 pixels each are enough for comparisons.
        depth: whether the pictures have a depth, which only `find_lines` uses.
        num_threads: None takes the processors available to this process. The pictures do not depend on it.

    Example:
        >>> bg.plain_views(gaussians, [camera])
        PlainViews(1 views, 320x240)
    """
    kernel = StrokeTexture.open("gaussian")
    draw = partial(render, gaussians, texture=kernel, depth=depth)
    frames = view_by_view(draw, cameras, len(gaussians), num_threads)
    return PlainViews(tuple(cameras), tuple(frames))
