"""The subject of the bench in a look: whole paintings of one scene in one view.

There is no true painting, so paintings are compared with the limit of the look: a stroke for each Gaussian,
made by more views, and drawn with `SAMPLES` x `SAMPLES` samples per pixel.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from brushgs.cameras.around import HELD_OUT, Ring
from brushgs.formats.pictures.images import resize
from brushgs.measure.bench.figures import Verified
from brushgs.measure.bench.subject import OnBackground, views_around, with_size
from brushgs.measure.bench.verify import check_close
from brushgs.measure.likeness import rmse
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.backdrop import with_cut_edges
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory, NoMemory, Steps
from brushgs.pipeline.steps import PAINTING
from brushgs.rendering.canvas import Painting
from brushgs.rendering.plain import PlainViews, plain_views
from brushgs.rendering.surface import Surface, flat, linen, paper
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera, FirstView
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

# Samples per pixel along each side at the limit. Of eight paintings of 480 x 270, compared with 6 samples: 1
# sample differs by 1 to 5 of 255, and 3 by 0.1 to 0.4; a painting in ink, whose marks end in hollows of the
# paper, by 18 and 4.
SAMPLES = 3
# Guide views at the limit, besides the usual ones: azimuth and elevation relative to the first view, degrees.
BETWEEN: Ring = (*((22.5 + 45.0 * step, 4.0) for step in range(8)), *HELD_OUT)
ASKS = (*PICTURE, "first_view", "view", "plain_views")
# Steps of a painting that bare strokes have too.
BARE = {"prune", "cluster", "view", "draw", "clean", "strokes", "output"}

# Makes guide views from the usual ones, the first view, and the scene.
ChangeViews = Callable[[PlainViews, FirstView | None, Gaussians], PlainViews]


def has_look(paint: PaintConfig) -> bool:
    """Whether a painting is more than bare strokes of the scene on a background."""
    bare = PaintConfig()
    is_changed = any(getattr(paint, step) != getattr(bare, step) for step in STEPS if step not in BARE)
    return is_changed or paint.strokes.edges > 0 or paint.strokes.economy > 0


@dataclass(frozen=True, eq=False)
class Picture:
    """A whole painting in the view of the bench.

    Attributes:
        painting: as a still shows it.
        camera: the view.
        num_strokes: of the scene.
    """

    painting: Painting
    camera: Camera
    num_strokes: int

    @classmethod
    def of(cls, prepared: Prepared, camera: Camera | None = None) -> "Picture":
        """The painting of `brushgs render`, in the first view or another one."""
        seen = camera or prepared.camera
        painting = with_cut_edges(prepared.painting.with_depth(False), seen, prepared.edges)
        return cls(painting, seen, len(prepared.strokes)).in_size(seen)

    def frame(self) -> Frame:
        """The painting."""
        return self.painting.frame(self.camera)

    def in_size(self, camera: Camera) -> "Picture":
        """The same strokes on the same canvas, in the size of another camera with the same view."""
        surface = self.painting.surface
        if surface is not None and surface.grain.shape != (camera.height, camera.width):
            surface = _in_size(surface, camera.width, camera.height)
        return replace(self, painting=replace(self.painting, surface=surface), camera=camera)

    def verified(self, name: str, frame: Frame) -> Verified:
        """The difference of a frame from the same painting in float64, whose kernels are compiled separately.

        Raises:
            WrongPictureError: if that is beyond the rounding of float32; names the point.
        """
        coats = tuple(
            replace(
                coat,
                strokes=coat.strokes.astype(np.float64),
                plain=None if coat.plain is None else coat.plain.astype(np.float64),
            )
            for coat in self.painting.coats
        )
        exact = replace(self.painting, coats=coats).frame(self.camera)
        return check_close(name, frame, exact, "the whole painting in float64")


@dataclass(frozen=True)
class LookSubject:
    """A scene, a view and a look.

    Attributes:
        source: the scene files, from which whole paintings start.
        prepared: the painting as `brushgs render` makes it, of `count` strokes.
        paint: all options, with the view of the picture.
        config: of the bench.
        memory: of steps common to paintings.
    """

    source: SceneSource
    prepared: Prepared
    paint: PaintConfig
    config: BenchConfig
    memory: Memory

    @classmethod
    def open(
        cls, source: SceneSource, paint: PaintConfig, config: BenchConfig, report: Report
    ) -> "LookSubject":
        """Make the painting, with the number of strokes of the look, else that of the bench.

        Raises:
            SceneError: if a file cannot be read.
            ValueError: if an option does not suit the scene.
        """
        memory = Memory()
        first = paint if paint.cluster.asked_count else _with_strokes(paint, config.count)
        prepared = prepare(source, first, report, asks=(*ASKS, "scene"), memory=memory)
        return cls(source, prepared, replace(first, view=prepared.view or paint.view), config, memory)

    @property
    def gaussians(self) -> Gaussians:
        """The scene as loaded."""
        return self.prepared.whole_scene

    @property
    def camera(self) -> Camera:
        """The view."""
        return self.prepared.camera

    @property
    def count(self) -> int:
        """The number of strokes of all families except `strokes`."""
        return len(self.prepared.strokes)

    @cached_property
    def picture(self) -> Picture:
        """The unchanged painting."""
        return Picture.of(self.prepared)

    @cached_property
    def limit(self) -> Prepared:
        """The painting with a stroke for each Gaussian, made by more views."""
        return self.made(_with_strokes(self.paint, None), change_views=self.more_views)

    @property
    def num_views(self) -> int:
        """The number of guide views; 0 if strokes are made by the scene alone."""
        return num_views_of(self.prepared)

    @cached_property
    def num_between(self) -> int:
        """The number of guide views added at the limit; 0 if strokes are made by the scene alone."""
        return len(views_around(self.prepared.first_view, self.paint.view, self.camera, BETWEEN))

    @property
    def counts(self) -> list[int]:
        """The numbers of strokes that leave something to merge; the last is that of the limit."""
        most = len(self.limit.strokes)
        return [*(count for count in sorted(self.config.strokes) if count < most), most]

    def made(
        self, paint: PaintConfig, memory: Memory | None = None, change_views: ChangeViews | None = None
    ) -> Prepared:
        """A painting in the same view; without a memory made from the files, as by `brushgs render`."""
        steps = PAINTING if change_views is None else _seen_otherwise(change_views)
        return prepare(self.source, paint, Report(), asks=ASKS, memory=memory or NoMemory(), steps=steps)

    def with_strokes(self, count: int) -> PaintConfig:
        """The options of the painting with another number of strokes."""
        return _with_strokes(self.paint, None if count >= len(self.limit.strokes) else count)

    def painted(self, paint: PaintConfig, change_views: ChangeViews | None = None) -> Frame:
        """A whole painting, from the scene file to the frame."""
        return Picture.of(self.made(paint, change_views=change_views)).frame()

    def shown(self, frame: Frame) -> Array:
        """[H, W, 3] a frame on the background, clipped to 0 to 1 as in a file."""
        return self._on_background.picture(frame)

    @cached_property
    def _on_background(self) -> OnBackground:
        return OnBackground(self.paint.draw.background)

    def sampled(self, picture: Picture) -> Array:
        """[H, W, 3] a picture as the mean of many samples per pixel."""
        camera = picture.camera
        large = with_size(camera, SAMPLES * camera.width, SAMPLES * camera.height)
        found = self.shown(picture.in_size(large).frame())
        blocks = camera.height, SAMPLES, camera.width, SAMPLES, 3
        return np.asarray(found.reshape(blocks).mean(axis=(1, 3)))

    def held_out_error(self, prepared: Prepared) -> float | None:
        """RMSE to the limit over all views that strokes were not made for; None without such views."""
        if not self._held_out:
            return None
        errors = [
            rmse(self.shown(Picture.of(prepared, view).frame()), truth) for view, truth in self._held_out
        ]
        return float(np.sqrt(np.mean(np.square(errors))))

    @cached_property
    def _held_out(self) -> list[tuple[Camera, Array]]:
        views = views_around(self.prepared.first_view, self.paint.view, self.camera, HELD_OUT)
        return [(view, self.sampled(Picture.of(self.limit, view))) for view in views]

    def more_views(self, views: PlainViews, first_view: FirstView | None, gaussians: Gaussians) -> PlainViews:
        """The views of a painting with those between them."""
        around = views_around(first_view, self.paint.view, self.camera, BETWEEN)
        has_depth, threads = self.paint.media.draws_lines, self.paint.draw.threads
        more = plain_views(gaussians, around, depth=has_depth, num_threads=threads)
        return PlainViews((*views.cameras, *more.cameras), (*views.frames, *more.frames))


def fewer_views(count: int) -> ChangeViews:
    """Keeps the first views of a painting; the order is its own, those near it, those around the scene."""

    def first(views: PlainViews, first_view: FirstView | None, gaussians: Gaussians) -> PlainViews:
        return PlainViews(views.cameras[:count], views.frames[:count])

    return first


def num_views_of(prepared: Prepared) -> int:
    """The number of guide views of a painting."""
    return 0 if prepared.plain_views is None else len(prepared.plain_views)


def _seen_otherwise(change: ChangeViews) -> Steps:
    def changed(views: PlainViews | None, needs: Mapping[str, Any]) -> PlainViews | None:
        return None if views is None else change(views, needs["guide"], needs["subject"])

    return PAINTING.altered("plain_views", changed)


def _with_strokes(paint: PaintConfig, count: int | None) -> PaintConfig:
    return replace(paint, cluster=replace(paint.cluster, strokes=count))


def _in_size(surface: Surface, width: int, height: int) -> Surface:
    """The same canvas in a picture of another size."""
    recipe = surface.recipe
    assert recipe is not None, "open_surface makes it of a recipe"
    color = recipe.color
    if color.ndim == 3:
        color = resize(color, width, height)
    if recipe.kind == "flat":
        return flat(color, height=height, width=width)
    weave = linen if recipe.kind == "linen" else paper
    return weave(color, height=height, width=width, strength=recipe.strength, seed=recipe.seed)
