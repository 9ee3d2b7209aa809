"""The subject of all families of the bench: one scene in one view, and how it is painted."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from brushgs.arrays import Array
from brushgs.brushes.brush_set import Brushes
from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.around import HELD_OUT, ring_views
from brushgs.measure.bench.verify import check_square
from brushgs.measure.likeness import rmse
from brushgs.options.choices import Features, Method
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.painting.background import Background, open_background
from brushgs.painting.job_views import is_from_outside
from brushgs.painting.prepare import Prepared, prepare
from brushgs.painting.report import Report
from brushgs.passes.cluster import Grouping, group
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.scene import Camera, Frame, Gaussians
from brushgs.stroke_count.view_model import KERNEL


@dataclass(frozen=True)
class Subject:
    """A scene, a view and a stroke.

    Attributes:
        source: the scene files, from which whole paintings start.
        prepared: the scene, its view, and one stroke per Gaussian that pruning keeps.
        paint: pruning, clustering and drawing.
        config: what is measured.
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
        return self.prepared.strokes

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
        """Their number: of `counts` the nearest to `config.count` by ratio; one that merges, if any does."""
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
        """How `brushgs render` draws a still picture."""
        return replace(self.prepared.options, depth=False)

    @property
    def plain_options(self) -> RenderOptions:
        """How the plain picture is drawn."""
        kernel, threads = StrokeTexture.open(KERNEL), self.paint.draw.threads
        return RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, depth=False, num_threads=threads)

    def group(self, method: Method, features: Features) -> Grouping:
        """Which Gaussians share a stroke, of `count` strokes."""
        return group(self.kept, self.count, features=features, method=method, seed=self.paint.cluster.seed)

    def cluster(self, count: int) -> Gaussians:
        """The strokes that `brushgs render` makes."""
        return self.prepared.stroke_maker(count)[0]

    def clustering_error(self, clusters: Gaussians) -> float:
        """RMSE of clusters, before the passes, drawn as the plain picture is."""
        frame = render_with(clusters, self.camera, StrokeTexture.open(KERNEL), self.plain_options)
        return rmse(self.picture(frame), self.picture(self.plain))

    def held_out_error(self, strokes: Gaussians) -> float | None:
        """RMSE of strokes over all views that they were not made for; None where there are none."""
        if not self._held_out:
            return None
        errors = [rmse(self.picture(self.draw(strokes, view)), plain) for view, plain in self._held_out]
        return float(np.sqrt(np.mean(np.square(errors))))

    @cached_property
    def _held_out(self) -> list[tuple[Camera, Array]]:
        """Views between those that strokes are made for, and the plain picture of each."""
        view, kernel = self.prepared.first_view, StrokeTexture.open(KERNEL)
        if view is None:
            return []
        from_outside = self.paint.view.camera_file is None and is_from_outside(self.paint.view)
        width, height = self.camera.width, self.camera.height
        views = ring_views(view, width, height, from_outside=from_outside, ring=HELD_OUT)
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
        prepared = prepare(self.source, paint, Report(), needs_background=False)
        return self.draw(prepared.strokes)

    def picture(self, frame: Frame) -> Array:
        """[H, W, 3] a frame on the background, clipped to 0 to 1 as in a file."""
        height, width = frame.alpha.shape
        return np.clip(frame.over(self._background(width, height)), 0, 1)

    def _background(self, width: int, height: int) -> Array | tuple[float, ...]:
        size = width, height
        if size not in self._backgrounds:
            self._backgrounds[size] = open_background(self.paint.draw.background, width, height)
        background = self._backgrounds[size]
        assert background is not None, "a transparent background is refused before"
        return background

    @cached_property
    def _backgrounds(self) -> dict[tuple[int, int], Background]:
        return {}
