"""The subject of all families of the bench: one scene in one view, and how it is painted."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from brushgs.brushes.brush_set import Brushes
from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.around import HELD_OUT, Ring, ring_views
from brushgs.measure.bench.verify import check_square
from brushgs.measure.likeness import rmse
from brushgs.options.choices import Features, Method
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.passes.reduce.cluster import Grouping, group
from brushgs.pipeline.background import Background, open_background
from brushgs.pipeline.job_views import is_from_outside
from brushgs.pipeline.prepare import STROKES, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import NoMemory
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.stroke_count.view_model import KERNEL
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera, FirstView
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians


class OnBackground:
    """Makes pictures of frames, on the background of a painting."""

    def __init__(self, background: str) -> None:
        """The background as `DrawConfig` names it; it is not transparent."""
        self._name = background
        self._opened: dict[tuple[int, int], Background] = {}

    def picture(self, frame: Frame) -> Array:
        """[H, W, 3] a frame on the background, clipped to 0 to 1 as in a file."""
        height, width = frame.alpha.shape
        if (width, height) not in self._opened:
            self._opened[width, height] = open_background(self._name, width, height)
        background = self._opened[width, height]
        assert background is not None, "a transparent background is refused before"
        return np.clip(frame.over(background), 0, 1)


ASKS = ("cameras", "background", "first_view", "scene", "texture", "options", "pruned", "maker")


@dataclass(frozen=True)
class Subject:
    """A scene, a view and a stroke.

    Attributes:
        source: the scene files, from which whole paintings start.
        prepared: the scene, its view, and what pruning keeps.
        paint: pruning, clustering and drawing.
        config: of the bench.
    """

    source: SceneSource
    prepared: Prepared
    paint: PaintConfig
    config: BenchConfig

    @property
    def gaussians(self) -> Gaussians:
        """The scene as loaded."""
        return self.prepared.whole_scene

    @property
    def kept(self) -> Gaussians:
        """The scene after pruning."""
        assert self.prepared.pruned is not None, "it was asked for"
        return self.prepared.pruned

    @property
    def camera(self) -> Camera:
        """The view."""
        return self.prepared.camera

    @property
    def texture(self) -> Brushes:
        """The stroke."""
        return self.prepared.texture

    @cached_property
    def counts(self) -> list[int]:
        """The numbers of strokes that leave something to merge; the last is one stroke per kept Gaussian."""
        num_kept = len(self.kept)
        return [*(count for count in sorted(self.config.strokes) if count < num_kept), num_kept]

    @cached_property
    def strokes(self) -> Gaussians:
        """The strokes of all families except `strokes` and `sh`."""
        return self.cluster(self.count)

    @property
    def count(self) -> int:
        """Their number: of `counts` the nearest to `config.count` by ratio; one with merging, if there is
        one.
        """
        merging = self.counts[:-1] or self.counts
        return min(merging, key=lambda count: abs(np.log(count / self.config.count)))

    @cached_property
    def plain(self) -> Frame:
        """The whole scene with its own kernel, verified.

        Raises:
            WrongPictureError: if it does not agree with its definition.
        """
        kernel, options = StrokeTexture.open(KERNEL), self.plain_options
        frame = render_with(self.gaussians, self.camera, kernel, options)
        check_square("the plain picture", frame, self.gaussians, self.camera, kernel, options)
        return frame

    @property
    def options(self) -> RenderOptions:
        """The options of `brushgs render` for a still."""
        return replace(self.prepared.options, depth=False)

    @property
    def plain_options(self) -> RenderOptions:
        """The options of the plain picture."""
        kernel, threads = StrokeTexture.open(KERNEL), self.paint.draw.threads
        return RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, depth=False, num_threads=threads)

    def group(self, method: Method, features: Features) -> Grouping:
        """The grouping for `count` strokes."""
        return group(self.kept, self.count, features=features, method=method, seed=self.paint.cluster.seed)

    def cluster(self, count: int) -> Gaussians:
        """The strokes that `brushgs render` makes."""
        return self.prepared.stroke_maker(count)[0]

    def clustering_error(self, clusters: Gaussians) -> float:
        """RMSE of clusters, before the passes, drawn as the plain picture is."""
        frame = render_with(clusters, self.camera, StrokeTexture.open(KERNEL), self.plain_options)
        return rmse(self.picture(frame), self.picture(self.plain))

    def held_out_error(self, strokes: Gaussians) -> float | None:
        """RMSE of strokes over all views that they were not made for; None without such views."""
        if not self._held_out:
            return None
        errors = [rmse(self.picture(self.draw(strokes, view)), plain) for view, plain in self._held_out]
        return float(np.sqrt(np.mean(np.square(errors))))

    @cached_property
    def _held_out(self) -> list[tuple[Camera, Array]]:
        """Views between those that strokes are made for, and the plain picture of each."""
        kernel = StrokeTexture.open(KERNEL)
        views = views_around(self.prepared.first_view, self.paint.view, self.camera, HELD_OUT)
        return [
            (camera, self.picture(render_with(self.gaussians, camera, kernel, self.plain_options)))
            for camera in views
        ]

    def draw(self, strokes: Gaussians, camera: Camera | None = None, **changed: Any) -> Frame:
        """One frame of strokes, as `brushgs render` draws it, with the options in `changed` replaced."""
        return render_with(strokes, camera or self.camera, self.texture, replace(self.options, **changed))

    def painting(self, count: int) -> Frame:
        """A whole painting of `count` strokes, from the scene file to the frame."""
        paint = replace(self.paint, cluster=replace(self.paint.cluster, strokes=count))
        prepared = prepare(self.source, paint, Report(), asks=STROKES, memory=NoMemory())
        return self.draw(prepared.strokes)

    def picture(self, frame: Frame) -> Array:
        """[H, W, 3] a frame on the background, clipped to 0 to 1 as in a file."""
        return self._on_background.picture(frame)

    @cached_property
    def _on_background(self) -> OnBackground:
        return OnBackground(self.paint.draw.background)


def views_around(first_view: FirstView | None, view: ViewConfig, camera: Camera, ring: Ring) -> list[Camera]:
    """Small views of a scene from a ring around it, in the aspect of a camera; none without a first view."""
    if first_view is None:
        return []
    from_outside = view.camera_file is None and is_from_outside(view)
    return ring_views(first_view, camera.width, camera.height, from_outside=from_outside, ring=ring)


def with_size(camera: Camera, width: int, height: int) -> Camera:
    """The same view in another size, edge to edge in spite of rounded sides."""
    scale = np.diag([width / camera.width, height / camera.height, 1.0])
    return replace(camera, K=scale @ camera.K, width=width, height=height)
