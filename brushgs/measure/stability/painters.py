"""The configurations that the temporal report compares: what each paints a frame with, and what it takes."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial

from brushgs.arrays import Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.image_strokes import paint_image
from brushgs.measure.stability.figures import Seconds
from brushgs.options.choices import Filter, Lock, ViewLock
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.rendering.track import Track, track_directions
from brushgs.scene import Boxes, Camera, Frame, Gaussians


@dataclass
class Clock:
    """Wall-clock seconds spent on a kind of work, and how often."""

    seconds: dict[str, float] = field(default_factory=lambda: {"track": 0.0, "project": 0.0, "draw": 0.0})
    frames: int = 0

    @contextmanager
    def of(self, kind: str) -> Iterator[None]:
        """Add the time of the block."""
        start = time.perf_counter()
        yield
        self.seconds[kind] += time.perf_counter() - start

    def per_frame(self, num_frames: int) -> Seconds:
        """Of a path of so many frames, not all of which were painted."""
        painted = max(1, self.frames)
        project, draw = (self.seconds[kind] / painted for kind in ("project", "draw"))
        return Seconds(self.seconds["track"] / num_frames, project, draw)


@dataclass
class StrokePainter:
    """Paints the strokes of a scene, each view's directions chosen by a lock."""

    name: str
    what: str
    gaussians: Gaussians
    cameras: Sequence[Camera]
    texture: StrokeTexture
    options: RenderOptions
    clock: Clock = field(default_factory=Clock)
    _track: Track | None = None

    def boxes(self, index: int, lock: ViewLock | None = None) -> Boxes:
        """The boxes of a frame; with lock "off" the ellipses behind them."""
        options = self.options if lock is None else self.options.in_direction(lock)
        if options.lock == "track":
            options = options.in_direction(self._followed().directions(index))
        return project_with(self.gaussians, self.cameras[index], options)[0]

    def all_boxes(self, lock: ViewLock | None = None) -> Iterator[Boxes]:
        """The boxes of every frame of the path."""
        return (self.boxes(index, lock) for index in range(len(self.cameras)))

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame; the plain picture is not looked at."""
        if self.options.lock == "track":
            self._followed()
        with self.clock.of("project"):
            boxes = self.boxes(index)
        with self.clock.of("draw"):
            frame = self.draw(boxes, self.cameras[index])
        self.clock.frames += 1
        return frame

    def draw(self, boxes: Boxes, camera: Camera) -> Frame:
        """Boxes to a picture."""
        return rasterize_with(boxes, camera, self.texture, self.options)

    def _followed(self) -> Track:
        """The track, followed when it is first asked for."""
        if self._track is None:
            with self.clock.of("track"):
                self._track = track_directions(
                    self.gaussians, self.cameras, num_threads=self.options.num_threads
                )
        return self._track


@dataclass
class ImagePainter:
    """Paints a plain picture by itself, with strokes on the image plane."""

    name: str
    what: str
    texture: StrokeTexture
    num_strokes: int
    filter: Filter
    seed: int
    ground: Sequence[float] | Array
    num_threads: int | None
    clock: Clock = field(default_factory=Clock)

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame, from the plain picture of that frame on its ground, and nothing else."""
        assert plain is not None
        with self.clock.of("draw"):
            frame = paint_image(
                plain,
                self.texture,
                num_strokes=self.num_strokes,
                seed=self.seed,
                filter=self.filter,
                ground=self.ground,
                num_threads=self.num_threads,
            )
        self.clock.frames += 1
        return frame


@dataclass(frozen=True)
class Comparison:
    """All that is painted with: the scene, its strokes and a path.

    Attributes:
        scene: the Gaussians as loaded, for the plain picture.
        strokes: the Gaussians that became strokes.
        cameras: the views; of a closed path the last equals the first.
        texture: the stroke.
        options: of `track`, `anchor` and `off`, but for the lock.
        ground: under every picture.
        seed: of the strokes on the image plane.
    """

    scene: Gaussians
    strokes: Gaussians
    cameras: Sequence[Camera]
    texture: StrokeTexture
    options: RenderOptions
    ground: Sequence[float] | Array
    seed: int

    def painters(self, num_threads: int | None) -> dict[str, StrokePainter | ImagePainter]:
        """One painter per configuration by name, in the order of the table, each with a clock at zero."""
        texture, kernel = self.texture, StrokeTexture.open("gaussian")
        asked = replace(self.options, depth=False, num_threads=num_threads)
        published = RenderOptions.of(
            texture,
            lock="off",
            filter="bilinear",
            num_sigmas=texture.num_sigmas,
            depth=False,
            num_threads=num_threads,
        )
        plain = RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, num_threads=num_threads)

        def locked(lock: Lock) -> RenderOptions:
            """A kernel has no direction, and is drawn as `render` does."""
            return replace(asked, lock=lock if texture.is_directed else "off")

        strokes = partial(StrokePainter, gaussians=self.strokes, cameras=self.cameras, texture=texture)
        painters: list[StrokePainter | ImagePainter] = [
            strokes("track", "directions tracked along the path", options=locked("track")),
            strokes("anchor", "directions of each view by itself", options=locked("anchor")),
            strokes("off", "directions of the ellipses", options=locked("off")),
            strokes("published", "off, bilinear, 2 sigma", options=replace(published, fade=False)),
            ImagePainter(
                "image",
                "each plain picture painted alone",
                texture,
                len(self.strokes),
                asked.filter,
                self.seed,
                self.ground,
                num_threads,
            ),
            StrokePainter(
                "plain", "the whole scene with its own kernel", self.scene, self.cameras, kernel, plain
            ),
        ]
        return {painter.name: painter for painter in painters}
