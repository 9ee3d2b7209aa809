"""What all families of the bench paint: one scene in one view, and how."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from brushgs.arrays import Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.bench.verify import check_square
from brushgs.options.choices import Features, Method
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import PaintConfig
from brushgs.painting.background import Ground, open_background
from brushgs.painting.stages import box_sigmas, view_lock
from brushgs.passes.cluster import Grouping, cluster, group
from brushgs.passes.prune import prune
from brushgs.rendering.render import render
from brushgs.scene import Camera, Frame, Gaussians

KERNEL = "gaussian"  # of the plain picture


@dataclass(frozen=True)
class Subject:
    """A scene, a view and a stroke.

    Attributes:
        path: of the scene file, which whole paintings start from.
        gaussians: the scene as loaded.
        camera: the view.
        texture: the stroke.
        paint: pruning, clustering and drawing.
        config: what is measured.
    """

    path: Path
    gaussians: Gaussians
    camera: Camera
    texture: StrokeTexture
    paint: PaintConfig
    config: BenchConfig

    @cached_property
    def kept(self) -> Gaussians:
        """The scene, pruned."""
        return self.prune(self.gaussians)

    @cached_property
    def counts(self) -> list[int]:
        """The stroke counts that leave something to merge, and last one stroke per Gaussian that is kept."""
        num_kept = len(self.kept)
        return [*(count for count in sorted(self.config.strokes) if count < num_kept), num_kept]

    @cached_property
    def strokes(self) -> Gaussians:
        """The strokes that all families but that of their count paint."""
        return self.cluster(self.kept, self.count)

    @property
    def count(self) -> int:
        """How many: the count of the list next to `config.count`, as a factor, that merges if one does."""
        merging = self.counts[:-1] or self.counts
        return min(merging, key=lambda count: abs(np.log(count / self.config.count)))

    @cached_property
    def plain(self) -> Frame:
        """The whole scene with its own kernel, in the view. Verified.

        Raises:
            WrongPictureError: if it is not what it should be.
        """
        kernel = StrokeTexture.open(KERNEL)
        how = self.plain_how
        frame = render(self.gaussians, self.camera, kernel, depth=False, **how)
        check_square("the plain picture", frame, self.gaussians, self.camera, kernel, how)
        return frame

    @property
    def how(self) -> dict[str, Any]:
        """Options of `render`, as `brushgs render` has them for one picture."""
        draw = self.paint.draw
        return {
            "lock": view_lock(draw),
            "order": draw.order or "depth",
            "filter": draw.filter,
            "num_sigmas": box_sigmas(self.texture, draw),
            "num_threads": draw.threads,
        }

    @property
    def plain_how(self) -> dict[str, Any]:
        """The same for the plain picture."""
        return self.how | {"num_sigmas": StrokeTexture.open(KERNEL).num_sigmas}

    def prune(self, gaussians: Gaussians) -> Gaussians:
        """As `brushgs render` does."""
        keep = self.paint.prune.share()
        return prune(gaussians, keep, weight=self.paint.prune.weight) if keep < 1 else gaussians

    def group(self, method: Method, features: Features) -> Grouping:
        """Which Gaussians share a stroke, for all families but that of their count."""
        return group(self.kept, self.count, features=features, method=method, seed=self.paint.cluster.seed)

    def cluster(self, kept: Gaussians, count: int) -> Gaussians:
        """As `brushgs render` does."""
        config = self.paint.cluster
        if count >= len(kept):
            return kept
        return cluster(
            kept,
            count,
            features=config.features,
            merge=config.merge,
            method=config.method,
            seed=config.seed,
        )

    def draw(self, strokes: Gaussians, camera: Camera | None = None, **changed: Any) -> Frame:
        """One frame of strokes, as `brushgs render` draws it, but for what is changed."""
        return render(strokes, camera or self.camera, self.texture, depth=False, **self.how | changed)

    def picture(self, frame: Frame) -> Array:
        """[H, W, 3] a frame on the ground, in the values that a file has."""
        height, width = frame.alpha.shape
        return np.clip(frame.over(self._ground(width, height)), 0, 1)

    def _ground(self, width: int, height: int) -> Array | tuple[float, ...]:
        size = width, height
        if size not in self._grounds:
            self._grounds[size] = open_background(self.paint.draw.background, width, height)
        ground = self._grounds[size]
        assert ground is not None, "a transparent ground is refused before"
        return ground

    @cached_property
    def _grounds(self) -> dict[tuple[int, int], Ground]:
        return {}
