"""Peers that see each plain picture and nothing else."""

from collections.abc import Callable

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.formats.pictures.images import read_image
from brushgs.measure.warp import PLAIN_ALPHA
from brushgs.rendering.rasterize import rasterize
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.boxes import Boxes
from brushgs.values.colors import flatten
from examples.benchmarks.painterly import image_boxes
from examples.benchmarks.peers.search import search_boxes
from examples.benchmarks.peers.task import Task, on_white

BRUSH = "flat"  # of both painters here; long marks of oil have it too
LEAST_VARIANCE = 1e-8  # of colors along an axis, as in ARF


class PicturePainter:
    """Paints the strokes that a function lays over each plain picture."""

    def __init__(self, task: Task, boxes_of: Callable[[Array, StrokeTexture, int], Boxes]) -> None:
        self.task, self._boxes_of, self._brush = task, boxes_of, StrokeTexture.open(BRUSH)
        self.strokes: int | None = None

    def paint(self, index: int) -> F32:
        """One picture, from the plain picture of that camera."""
        plain = self.task.plain(index)
        boxes = self._boxes_of(plain, self._brush, self.task.strokes)
        self.strokes = len(boxes) if self.strokes is None else self.strokes
        height, width = plain.shape[:2]
        return on_white(rasterize(boxes, self._brush, height=height, width=width, depth=False))

    def boxes(self, index: int) -> None:
        """None: no stroke of one picture is a stroke of the next."""


def hertzmann(task: Task) -> PicturePainter:
    """Layers from coarse to fine, see `examples.benchmarks.painterly`."""
    return PicturePainter(task, lambda plain, brush, count: image_boxes(plain, brush, num_strokes=count))


def searched(task: Task) -> PicturePainter:
    """Anchors by density, strokes by search, see `examples.benchmarks.peers.search`."""
    return PicturePainter(task, lambda plain, brush, count: search_boxes(plain, brush, num_strokes=count))


class PlainScene:
    """The Gaussians as they were trained: what all others are compared with."""

    strokes = None

    def __init__(self, task: Task) -> None:
        self.task = task

    def paint(self, index: int) -> F32:
        """The plain picture."""
        return self.task.plain(index)

    def boxes(self, index: int) -> None:
        """None: there are no strokes."""


class ColorTransfer:
    """The plain pictures in the colors of a painting; no strokes.

    One affine map for all views, of their colors together, as ARF makes it before it optimizes. Source:
    Zhang et al. 2022, ARF: Artistic Radiance Fields, section 4 (whitening and coloring in closed form).
    """

    strokes = None

    def __init__(self, task: Task) -> None:
        self.task = task
        frames = [task.plain_frame(index) for index in range(len(task.cameras))]
        paint = flatten(read_image(task.style)[..., :3]).reshape(-1, 3)
        scene = np.concatenate([on_white(frame)[frame.alpha > PLAIN_ALPHA] for frame in frames])
        self._map = affine_between(scene.astype(np.float64), paint.astype(np.float64))

    def paint(self, index: int) -> F32:
        """One picture, mapped."""
        frame = self.task.plain_frame(index)
        slopes, shift = self._map
        straight = np.clip(on_white(frame) @ slopes.T + shift, 0, 1)
        alpha = np.clip(frame.alpha, 0, 1)[..., None]
        return (straight * alpha + (1 - alpha)).astype(np.float32)

    def boxes(self, index: int) -> None:
        """None: there are no strokes."""


def affine_between(colors: F64, aims: F64) -> tuple[F64, F64]:
    """(A [3, 3], b [3]): A c + b has the mean and the covariance of the aims.

    Args:
        colors: [N, 3] whose mean and covariance are carried over.
        aims: [M, 3] to those of these.
    """
    roots = [_power(np.cov(colors.T, bias=True), -0.5), _power(np.cov(aims.T, bias=True), 0.5)]
    slopes = roots[1] @ roots[0]
    return slopes, aims.mean(axis=0) - slopes @ colors.mean(axis=0)


def _power(covariance: F64, exponent: float) -> F64:
    """A symmetric matrix to a power."""
    values, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.maximum(values, LEAST_VARIANCE) ** exponent @ axes.T)
