"""Files of marks -> what is laid over the strokes of a scene, and what changes below."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from brushgs.brushes.brush_set import MOST_BRUSHES, BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.overpaint import Balls, OverpaintConfig
from brushgs.passes.marks.strokes import SIGMAS, brush_of, strokes_of
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.report import Report
from brushgs.pipeline.stroke_pass import nearest_regions
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import NO_TILE, Density, Marks, Overpaint

if TYPE_CHECKING:
    from brushgs.values.arrays import F64, Rows

MARKS = "marks"  # name of the coats
OWN_BRUSH = "dab"  # of marks without a tile
# Depth by which a mark may lie behind the paint around it and still show, in sizes of the strokes there. The
# depth of paint is that of the middles of strokes.
BEHIND = 3.0
NEAR = 4  # strokes whose sizes count


class Overpainted(NamedTuple):
    """The files of marks, in order, and all of what they change in the strokes of a scene."""

    files: tuple[Overpaint, ...]
    joined: Overpaint


def open_overpaint(config: OverpaintConfig) -> Overpainted:
    """Read the files of marks. Raises SceneError as `read_marks` does."""
    from brushgs.formats.marks import read_marks

    files = tuple(read_marks(path) for path in config.files)
    return Overpainted(files, Overpaint.joined(files))


def balls_of(overpaint: Overpaint) -> Balls:
    """The density that is painted, as values."""
    found = overpaint.density
    if found is None:
        return ()
    return tuple(map(tuple, np.column_stack([found.means, found.radii, found.factors]).tolist()))


def painted_factors(gaussians: Gaussians, balls: Balls) -> "F64":
    """[N] factors on the strokes per area, of one ball or more."""
    from brushgs.passes.reduce.focus import painted_focus

    rows = np.array(balls)
    return painted_focus(gaussians, Density(rows[:, :3], rows[:, 3], rows[:, 4]))


def overpainted(
    coats: Sequence[Coat], strokes: Gaussians, given: Overpainted, threads: int | None, report: Report
) -> list[Coat]:
    """The coats of a painting with what is painted over it.

    Args:
        coats: of the painting.
        strokes: of the scene, as laid.
        given: what is painted over.
        threads: that draw.
        report: gets the stage "marks".
    """
    from brushgs.passes.marks.changes import changed

    with report.stage("marks") as stage:
        below = [
            coat if coat.name == BACKDROP else replace(coat, strokes=changed(coat.strokes, given.joined))
            for coat in coats
        ]
        above = [
            coat
            for file in given.files
            if file.marks
            for coat in coats_of_marks(file.marks, strokes, threads)
        ]
        num = sum(len(coat.strokes) for coat in above)
        gone = sum(
            int(np.count_nonzero((after.strokes.opacities == 0) & (before.strokes.opacities > 0)))
            for before, after in zip(coats, below, strict=True)
        )
        stage.did = f"{num:,} marks over the painting"
        stage.did += f", {gone:,} strokes erased" if gone else ""
        stage.counts = {"marks": num, "erased": gone}
    return [*below, *above]


def coats_of_marks(marks: Marks, strokes: Gaussians, threads: int | None = None) -> list[Coat]:
    """The coats of the marks of one file, as many as their tiles need.

    Args:
        marks: one or more.
        strokes: of the scene: a mark shows where none of them hides it.
        threads: that draw.
    """
    laid = nearest_regions(strokes, strokes_of(marks))
    tolerances = _tolerances(laid, strokes)
    order = np.argsort(tolerances, kind="stable")
    found = []
    for start in range(0, len(order), MOST_BRUSHES - 1):
        rows = np.sort(order[start : start + MOST_BRUSHES - 1])
        found.append(_coat(marks.take(rows), laid.take(rows), float(tolerances[rows].max()), threads))
    return found


def _coat(marks: Marks, laid: Gaussians, tolerance: float, threads: int | None) -> Coat:
    textures, brushes = [StrokeTexture.open(OWN_BRUSH)], np.zeros(len(marks), np.uint8)
    is_turned = marks.widths > marks.lengths
    for row in np.flatnonzero(marks.tiles != NO_TILE):
        brushes[row] = len(textures)
        image = marks.images[marks.tiles[row]]
        textures.append(brush_of(image, f"{MARKS}-{row}", is_turned=bool(is_turned[row])))
    brush_set = BrushSet(tuple(textures), MARKS)
    options = RenderOptions.of(
        brush_set, num_sigmas=SIGMAS, lock="anchor", order="depth", num_threads=threads
    )
    return Coat(
        MARKS,
        replace(laid, brushes=brushes),
        brush_set,
        options,
        tolerance=tolerance,
        normals=marks.normals,
        is_one_sided=True,
    )


def _tolerances(laid: Gaussians, strokes: Gaussians) -> "F64":
    """[N] depth by which each mark may lie behind the paint there, in its own sizes."""
    own = _sizes(laid)
    if not len(strokes):
        return np.full(len(laid), BEHIND)
    from brushgs.passes.neighbours import nearest

    _, rows = nearest(
        strokes.means.astype(np.float64), laid.means.astype(np.float64), min(NEAR, len(strokes))
    )
    around: Rows = np.asarray(rows).reshape(len(laid), -1)
    return np.asarray(BEHIND * _sizes(strokes)[around].max(axis=1) / np.maximum(own, 1e-300))


def _sizes(strokes: Gaussians) -> "F64":
    """[N] geometric means of the two larger standard deviations, as in `DepthTest.by_picture`."""
    larger = np.sort(strokes.scales.astype(np.float64), axis=1)[:, 1:]
    return np.asarray(np.sqrt(larger.prod(axis=1)))
