"""The configurations of the temporal report: how each paints a frame, and its time."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brushes
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.stability.figures import Seconds
from brushgs.options.choices import Lock, ViewLock
from brushgs.pipeline.film_track import FilmTrack, track_strokes
from brushgs.pipeline.moving import Moving
from brushgs.pipeline.report import Stopwatch
from brushgs.rendering.canonical import Canonical, fit_canonical
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.rendering.track import Track
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

if TYPE_CHECKING:
    from brushgs.passes.motion.estimate import EstimatedMotion
    from brushgs.pipeline.prepare import Prepared
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.hand import Hand

PLAIN = "plain"
LOCKED: Mapping[Lock, str] = {  # configurations that differ only in their lock
    "track": "directions tracked along the path",
    "anchor": "directions of each view alone",
    "off": "directions of the ellipses",
}


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


@runtime_checkable
class MarkPainter(Protocol):
    """A painter with known marks on the picture."""

    def marks(self, index: int, plain: Array) -> Boxes:
        """The marks of a frame, with ids that persist between frames. Arguments as in `Painter.paint`."""


@dataclass
class StrokePainter:
    """Paints strokes of the scene, their directions in each view chosen by the lock of the options."""

    name: str
    what: str
    gaussians: Gaussians
    cameras: Sequence[Camera]
    texture: Brushes
    options: RenderOptions
    moving: Moving | None = None
    is_loop: bool = False
    timer: PaintTimer = field(default_factory=PaintTimer)
    _track: Track | FilmTrack | None = None

    @property
    def num_strokes(self) -> int:
        """One stroke per Gaussian."""
        return len(self.gaussians)

    def strokes_at(self, index: int) -> Gaussians:
        """The strokes as they are in a frame."""
        if self.moving is None:
            return self.gaussians
        return self.moving.pose(index).moved(self.gaussians, has_color=self.moving.takes_light)

    def boxes(self, index: int, lock: ViewLock | None = None) -> Boxes:
        """The boxes of a frame; with lock "off" the principal boxes of the ellipses behind them."""
        return self._projected(index, lock)

    def _projected(self, index: int, lock: ViewLock | None = None) -> Boxes:
        options = self.options if lock is None else self.options.in_direction(lock)
        if options.lock == "track":
            options = options.in_direction(self._tracked().directions(index))
        return project_with(self.strokes_at(index), self.cameras[index], options)[0]

    def all_boxes(self, lock: ViewLock | None = None) -> Iterator[Boxes]:
        """The boxes of every frame of the path."""
        return (self.boxes(index, lock) for index in range(len(self.cameras)))

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame; it does not depend on the plain picture."""
        if self.options.lock == "track":
            self._tracked()
        with self.timer.project.running():
            boxes = self._projected(index)
        with self.timer.draw.running():
            frame = self.draw(boxes, self.cameras[index])
        self.timer.frames += 1
        return frame

    def draw(self, boxes: Boxes, camera: Camera) -> Frame:
        """Rasterize boxes."""
        return rasterize_with(boxes, camera, self.texture, self.options)

    def _tracked(self) -> Track | FilmTrack:
        """The directions along the path, chosen at the first call."""
        if self._track is None:
            with self.timer.track.running():
                self._track = self._track_along(self.gaussians, self.options.low_pass)
        return self._track

    def _track_along(self, strokes: Gaussians, low_pass: float) -> Track | FilmTrack:
        return track_strokes(
            strokes,
            self.cameras,
            self.moving,
            is_loop=self.is_loop,
            low_pass=low_pass,
            num_threads=self.options.num_threads,
        )


@dataclass
class ScenePainter(StrokePainter):
    """Paints the whole scene with its own kernel."""

    at: Callable[[int], Gaussians] | None = None  # of a frame; None for a still scene
    _last: tuple[int, Gaussians] | None = None

    def strokes_at(self, index: int) -> Gaussians:
        """The Gaussians of a frame; the last ones are kept."""
        if self.at is None:
            return self.gaussians
        if self._last is None or self._last[0] != index:
            self._last = index, self.at(index)
        return self._last[1]


@dataclass
class AlonePainter(StrokePainter):
    """Paints each frame of a moving scene as a still, with strokes and fields made of that moment alone.

    Mutually nearest strokes of consecutive frames count as the same; all others die and are born.
    """

    make: Callable[[int], Gaussians] | None = None  # the strokes of a frame
    _made: dict[int, Gaussians] = field(default_factory=dict)
    _fields: dict[int, Canonical] = field(default_factory=dict)
    _ids: list[NDArray[np.int32]] = field(default_factory=list)  # by frame
    _num_ids: int = 0

    def strokes_at(self, index: int) -> Gaussians:
        """The strokes of a frame."""
        if index not in self._made:
            assert self.make is not None, "frames alone are made of something"
            self._made[index] = self.make(index)
        return self._made[index]

    def boxes(self, index: int, lock: ViewLock | None = None) -> Boxes:
        """The boxes of a frame, with ids that last from frame to frame."""
        while len(self._ids) <= index:
            self._number_next()
        boxes = self._projected(index, lock)
        return replace(boxes, ids=self._ids[index][boxes.ids])

    def _projected(self, index: int, lock: ViewLock | None = None) -> Boxes:
        options = self.options
        if lock is not None or options.lock != "canonical":
            return super()._projected(index, lock)
        strokes, camera = self.strokes_at(index), self.cameras[index]
        if index not in self._fields:
            self._fields[index] = fit_canonical(strokes, num_threads=options.num_threads)
        directions = self._fields[index].directions(strokes, camera, options)
        return project_with(strokes, camera, options.in_direction(directions))[0]

    def _number_next(self) -> None:
        frame = len(self._ids)
        now = self.strokes_at(frame).means
        ids = np.full(len(now), -1, np.int32)
        if frame:
            earlier, later = nearest_pairs(self.strokes_at(frame - 1).means, now)
            ids[later] = self._ids[frame - 1][earlier]
        is_new = ids < 0
        ids[is_new] = self._num_ids + np.arange(np.count_nonzero(is_new))
        self._num_ids += int(np.count_nonzero(is_new))
        self._ids.append(ids)


def nearest_pairs(first: Array, second: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of mutually nearest points of [n, 3] and [m, 3]."""
    from scipy.spatial import cKDTree

    if not (len(first) and len(second)):
        return np.arange(0), np.arange(0)
    of_first, of_second = cKDTree(second).query(first)[1], cKDTree(first).query(second)[1]
    rows = np.flatnonzero(of_second[of_first] == np.arange(len(first)))
    return rows, of_first[rows]


@dataclass(frozen=True)
class Comparison:
    """What all configurations have in common: the scene, its strokes and a path.

    Attributes:
        scene: the Gaussians as loaded, for the plain picture.
        strokes: the strokes in space.
        cameras: the views; the last one of a closed path equals the first.
        texture: the stroke image or kernel.
        options: of `track`, `anchor` and `off`, except for the lock.
        background: of every picture: one RGB color 0 to 1, or [H, W, 3].
        fps: frames a second, as the path is played.
        moving: how the strokes move; None for a still scene.
        truth: a moving scene with corresponding rows, for the plain pictures and the flow, mostly the scene
            of the strokes. The ids of `scene` are its rows; without ids all rows. Or an estimated motion, if
            rows do not correspond.
        is_loop: for a moving scene: whether the frame after the last is the first again, for camera and
            scene.
        remake: makes a painting of the Gaussians of one moment alone, as seen by a camera; None omits the
            configuration `alone`, which still scenes do not have.
        painting: along the path, of a look: `strokes`, `texture` and `options` are then those of its main
            coat; None for bare strokes.
        by_hand: how a film of these strokes is made by hand, and the painting; None for a steady one.
    """

    scene: Gaussians
    strokes: Gaussians
    cameras: Sequence[Camera]
    texture: Brushes
    options: RenderOptions
    background: Sequence[float] | Array
    fps: float = 24.0
    moving: Moving | None = None
    truth: "MovingScene | EstimatedMotion | None" = None
    is_loop: bool = False
    remake: "Callable[[Gaussians, Camera], Prepared] | None" = None
    painting: "Painting | None" = None
    by_hand: "tuple[Hand, Painting] | None" = None

    def scene_at(self, index: int) -> Gaussians:
        """The plain scene in a frame."""
        if self.moving is None:
            return self.scene
        assert self.truth is not None, "what moves has a truth"
        found = self.truth.at(float(self.moving.film.times[index]))
        if self.scene.ids is None or not isinstance(self.truth, MovingScene):
            return found
        return found.take(self.scene.ids.astype(np.intp))

    def earlier_means(self, then: int, now: int, means: Array) -> Array:
        """Positions [n, 3] in an earlier frame of the Gaussians that are at `means` in a frame."""
        if self.moving is None or self.truth is None or isinstance(self.truth, MovingScene):
            return means
        times = self.moving.film.times
        return self.truth.means_at(float(times[then]), float(times[now]))

    def stroke_painters(self, num_threads: int | None) -> list[StrokePainter]:
        """The configurations that paint the strokes, in the order of the table, with timers at zero."""
        painters = self._steady_painters(num_threads)
        if self.by_hand is not None:
            from brushgs.measure.stability.hand_painter import hand_painter

            painters.append(hand_painter(self, *self.by_hand, self._options("track"), num_threads))
        return painters

    def _steady_painters(self, num_threads: int | None) -> list[StrokePainter]:
        if self.painting is not None:
            return self._look_painters(self.painting, num_threads)
        texture = self.texture
        published = RenderOptions.of(
            texture,
            lock="off",
            filter="bilinear",
            num_sigmas=texture.num_sigmas,
            depth=False,
            num_threads=num_threads,
        )

        def locked(lock: Lock) -> RenderOptions:
            return replace(self._options(lock), num_threads=num_threads)

        strokes = partial(
            StrokePainter,
            gaussians=self.strokes,
            cameras=self.cameras,
            texture=texture,
            moving=self.moving,
            is_loop=self.is_loop,
        )
        painters = [strokes(lock, what, options=locked(lock)) for lock, what in LOCKED.items()]
        if self.moving is None:
            painters.append(
                strokes("published", "off, bilinear, 2 sigma", options=replace(published, fade=False))
            )
        elif self.remake is not None:
            remake = self.remake
            alone = AlonePainter(
                "alone",
                "each frame painted alone",
                self.strokes,
                self.cameras,
                texture,
                locked("canonical"),
                make=lambda index: remake(self.scene_at(index), self.cameras[index]).strokes,
            )
            painters.append(alone)
        return painters

    def _look_painters(self, painting: "Painting", num_threads: int | None) -> list[StrokePainter]:
        """The same for whole paintings; there is no published configuration of a look."""
        from brushgs.measure.stability.look_painters import (
            AloneLookPainter,
            LookPainter,
            in_threads,
            locked,
        )

        shown = in_threads(painting.with_depth(False), num_threads)
        painters: list[StrokePainter] = []
        for lock, what in LOCKED.items():
            painter = LookPainter(
                lock,
                what,
                self.strokes,
                self.cameras,
                self.texture,
                replace(self._options(lock), num_threads=num_threads),
                moving=self.moving,
                is_loop=self.is_loop,
                painting=locked(shown, lock),
            )
            painters.append(painter)
        if self.moving is not None and self.remake is not None:
            remake = self.remake
            alone = AloneLookPainter(
                "alone",
                "each frame painted alone",
                self.strokes,
                self.cameras,
                self.texture,
                replace(self._options("canonical"), num_threads=num_threads),
                prepare=lambda index: remake(self.scene_at(index), self.cameras[index]),
            )
            painters.append(alone)
        return painters

    def _options(self, lock: Lock) -> RenderOptions:
        """The options with a lock; a kernel has no direction, and is drawn as by `render`."""
        return replace(self.options, depth=False, lock=lock if self.texture.is_directed else "off")

    def plain_painter(self, num_threads: int | None) -> StrokePainter:
        """The configuration `plain`."""
        kernel = StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, num_threads=num_threads)
        what = "the whole scene with its own kernel"
        at = None if self.moving is None else self.scene_at
        return ScenePainter(PLAIN, what, self.scene, self.cameras, kernel, options, at=at)


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
