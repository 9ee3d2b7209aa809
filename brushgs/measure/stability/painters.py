"""The configurations that the temporal report compares: how each paints a frame, and how long that takes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Protocol

from brushgs.arrays import Array
from brushgs.brushes.brush_set import Brushes
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.stability.figures import Seconds
from brushgs.options.choices import Lock, ViewLock
from brushgs.painting.report import Stopwatch
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.rendering.track import Track, track_directions
from brushgs.scene import Boxes, Camera, Frame, Gaussians

PLAIN = "plain"


@dataclass
class PaintTimer:
    """The time of each kind of work, and the number of frames painted."""

    track: Stopwatch = field(default_factory=Stopwatch)
    project: Stopwatch = field(default_factory=Stopwatch)
    draw: Stopwatch = field(default_factory=Stopwatch)
    frames: int = 0

    def per_frame(self, num_frames: int) -> Seconds:
        """Seconds per frame on a path of `num_frames` frames, not all of which were painted."""
        painted = max(1, self.frames)
        return Seconds(
            self.track.seconds / num_frames, self.project.seconds / painted, self.draw.seconds / painted
        )


class Painter(Protocol):
    """A configuration: anything that paints the frames of a path."""

    @property
    def name(self) -> str:
        """Head of its column."""

    @property
    def what(self) -> str:
        """What it paints, in a few words."""

    @property
    def num_strokes(self) -> int:
        """The number of strokes, at most, of a frame."""

    @property
    def timer(self) -> PaintTimer:
        """The time of its work."""

    def paint(self, index: int, plain: Array) -> Frame:
        """One frame; `plain` is the plain picture [H, W, 3] of that frame on its background."""


@dataclass
class StrokePainter:
    """Paints strokes of the scene, their directions in each view chosen by the lock of the options."""

    name: str
    what: str
    gaussians: Gaussians
    cameras: Sequence[Camera]
    texture: Brushes
    options: RenderOptions
    timer: PaintTimer = field(default_factory=PaintTimer)
    _track: Track | None = None

    @property
    def num_strokes(self) -> int:
        """One stroke per Gaussian."""
        return len(self.gaussians)

    def boxes(self, index: int, lock: ViewLock | None = None) -> Boxes:
        """The boxes of a frame; with lock "off" the principal boxes of the ellipses behind them."""
        options = self.options if lock is None else self.options.in_direction(lock)
        if options.lock == "track":
            options = options.in_direction(self._tracked().directions(index))
        return project_with(self.gaussians, self.cameras[index], options)[0]

    def all_boxes(self, lock: ViewLock | None = None) -> Iterator[Boxes]:
        """The boxes of every frame of the path."""
        return (self.boxes(index, lock) for index in range(len(self.cameras)))

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame; it does not depend on the plain picture."""
        if self.options.lock == "track":
            self._tracked()
        with self.timer.project.running():
            boxes = self.boxes(index)
        with self.timer.draw.running():
            frame = self.draw(boxes, self.cameras[index])
        self.timer.frames += 1
        return frame

    def draw(self, boxes: Boxes, camera: Camera) -> Frame:
        """Rasterise boxes."""
        return rasterize_with(boxes, camera, self.texture, self.options)

    def _tracked(self) -> Track:
        """The directions along the path, chosen at the first call."""
        if self._track is None:
            with self.timer.track.running():
                self._track = track_directions(
                    self.gaussians, self.cameras, num_threads=self.options.num_threads
                )
        return self._track


@dataclass(frozen=True)
class Comparison:
    """What all configurations have in common: the scene, its strokes and a path.

    Attributes:
        scene: the Gaussians as loaded, for the plain picture.
        strokes: the strokes in space.
        cameras: the views; the last one of a closed path equals the first.
        texture: the stroke image or kernel.
        options: of `track`, `anchor` and `off`, except for the lock.
        background: of every picture: one RGB colour 0 to 1, or [H, W, 3].
    """

    scene: Gaussians
    strokes: Gaussians
    cameras: Sequence[Camera]
    texture: Brushes
    options: RenderOptions
    background: Sequence[float] | Array

    def stroke_painters(self, num_threads: int | None) -> list[StrokePainter]:
        """The configurations that paint the strokes, in the order of the table, with timers at zero."""
        texture = self.texture
        current = replace(self.options, depth=False, num_threads=num_threads)
        published = RenderOptions.of(
            texture,
            lock="off",
            filter="bilinear",
            num_sigmas=texture.num_sigmas,
            depth=False,
            num_threads=num_threads,
        )

        def locked(lock: Lock) -> RenderOptions:
            """With a lock; a kernel has no direction, and is drawn as `render` does."""
            return replace(current, lock=lock if texture.is_directed else "off")

        strokes = partial(StrokePainter, gaussians=self.strokes, cameras=self.cameras, texture=texture)
        return [
            strokes("track", "directions tracked along the path", options=locked("track")),
            strokes("anchor", "directions of each view alone", options=locked("anchor")),
            strokes("off", "directions of the ellipses", options=locked("off")),
            strokes("published", "off, bilinear, 2 sigma", options=replace(published, fade=False)),
        ]

    def plain_painter(self, num_threads: int | None) -> StrokePainter:
        """The configuration `plain`."""
        kernel = StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, num_threads=num_threads)
        what = "the whole scene with its own kernel"
        return StrokePainter(PLAIN, what, self.scene, self.cameras, kernel, options)


# Makes further painters for a comparison, given the number of threads (None: all).
MakePainters = Callable[[Comparison, int | None], Sequence[Painter]]


def no_painters(comparison: Comparison, num_threads: int | None) -> Sequence[Painter]:
    """No painters beyond those of the report."""
    return ()


def all_painters(
    comparison: Comparison, num_threads: int | None, make_extra: MakePainters = no_painters
) -> dict[str, Painter]:
    """All painters by name, in the order of the table: strokes, extra ones, and `plain` last."""
    painters = [
        *comparison.stroke_painters(num_threads),
        *make_extra(comparison, num_threads),
        comparison.plain_painter(num_threads),
    ]
    return {painter.name: painter for painter in painters}
