"""From files of marks to the coats laid over the strokes of a scene, and the changes of strokes below."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from brushgs.brushes.brush_set import MOST_BRUSHES, BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneWarning
from brushgs.options.overpaint import Balls, OverpaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.clip import SAME_MOMENT, Clip
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.report import Report
from brushgs.pipeline.stroke_pass import nearest_regions
from brushgs.rendering.coat import Coat
from brushgs.rendering.motion import Pose, StrokeMotion
from brushgs.rendering.options import RenderOptions
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

if TYPE_CHECKING:
    from brushgs.values.arrays import F64, Array, Rows
    from brushgs.values.marks import Marks, Overpaint

MARKS = "marks"  # name of the coats
OWN_BRUSH = "dab"  # of marks without a tile
# Depth by which a mark may lie behind the paint around it and still show, in sizes of the strokes there. The
# depth of paint is that of the middles of strokes.
BEHIND = 3.0
NEAR = 4  # strokes whose sizes count


class Overpainted(NamedTuple):
    """The files of marks, in order, and all their changes to the strokes of a scene."""

    files: "tuple[Overpaint, ...]"
    joined: "Overpaint"


def open_overpaint(
    config: OverpaintConfig, source: SceneFiles | Gaussians | Clip | None = None
) -> Overpainted:
    """Read the files of marks; those of another moment of a moving scene are carried to the one shown.

    Args:
        config: names the files.
        source: the scene; None if it does not move.

    Raises:
        SceneError: as `read_marks` does, or if the scene cannot be read.
    """
    from brushgs.formats.marks import read_marks
    from brushgs.values.marks import Overpaint

    files = tuple(read_marks(path) for path in config.files)
    if source is not None and not isinstance(source, Gaussians) and any(f.time is not None for f in files):
        paths = zip(files, config.files, strict=True)
        files = tuple(_at_shown_moment(file, path, source) for file, path in paths)
    return Overpainted(files, Overpaint.joined(files))


def _at_shown_moment(file: "Overpaint", path: Path, source: SceneFiles | Clip) -> "Overpaint":
    """The marks, at the moment of a still, or at the nearest shown moment of a clip."""
    from brushgs.formats.moving import open_moving
    from brushgs.passes.marks.moving import carried
    from brushgs.passes.motion.found_again import found_again

    if file.time is None:
        return file
    if isinstance(source, Clip):
        scene, shown = source.scene, float(np.clip(file.time, *source.ends()))
    else:
        source = SceneSource.of(source)
        opened = open_moving(source)
        if opened is None:
            return file
        scene, shown = opened, 0.0 if source.time is None else source.time.seconds(opened.duration)
    if abs(shown - file.time) < SAME_MOMENT:
        return file
    if not scene.has_rows and scene.times is not None:
        first, last = sorted((shown, file.time))
        inside = (scene.times > first) & (scene.times < last)
        again = found_again(scene, np.array([first, *scene.times[inside], last])).scene
        if again is None:
            what = "the Gaussians of one moment are not found in the next, so marks stay where they are"
            warnings.warn(SceneWarning(f"{path}: {what}; adopt paint over the moment shown"), stacklevel=2)
            return file
        scene = again
    return replace(carried(file, scene.at(file.time), scene.at(shown)), time=shown)


def balls_of(overpaint: "Overpaint") -> Balls:
    """The painted density, as values."""
    found = overpaint.density
    if found is None:
        return ()
    return tuple(map(tuple, np.column_stack([found.means, found.radii, found.factors]).tolist()))


def painted_factors(gaussians: Gaussians, balls: Balls) -> "F64":
    """[N] factors on the strokes per area, from at least one ball."""
    from brushgs.passes.reduce.focus import painted_focus
    from brushgs.values.marks import Density

    rows = np.array(balls)
    return painted_focus(gaussians, Density(rows[:, :3], rows[:, 3], rows[:, 4]))


def overpainted(
    coats: Sequence[Coat],
    strokes: Gaussians,
    given: Overpainted,
    threads: int | None,
    report: Report,
    motion: StrokeMotion | None = None,
) -> list[Coat]:
    """The coats of a painting with those of its marks.

    Args:
        coats: of the painting.
        strokes: of the scene, as laid.
        given: what is painted over.
        threads: that draw.
        report: gets the stage "marks".
        motion: of the strokes, which have ids; None for a scene that does not move.
    """
    with report.stage("marks") as stage:
        below, above = list(coats), list[Coat]()
        for file in given.files:
            pose = None
            if motion is not None:
                pose = motion.pose(float(motion.positions(np.array([file.time or 0.0]))[0]))
            below = [coat if coat.name == BACKDROP else _changed(coat, file, pose, strokes) for coat in below]
            if file.marks is not None:
                around = [coat.strokes for coat in coats if coat.name == BACKDROP]
                above += coats_of_marks(file.marks, strokes, threads, pose, around)
        num = sum(len(coat.strokes) for coat in above)
        gone = sum(int(np.count_nonzero(coat.cut.touching)) for coat in below if coat.cut is not None)
        stage.did = f"{num:,} marks over the painting"
        stage.did += f", {gone:,} strokes erased or cut" if gone else ""
        stage.counts = {"marks": num, "erased": gone}
    return [*below, *above]


def marks_continued(
    strokes: Gaussians, given: Overpainted, first_view: FirstView, report: Report
) -> Gaussians:
    """Strokes of the scene, painted like similar strokes below the marks; dissimilar ones are unchanged.

    Args:
        strokes: of the scene.
        given: what is painted over.
        first_view: of the scene.
        report: gets the stage "continue".
    """
    from brushgs.passes.marks.learn import learn

    with report.stage("continue") as stage:
        marks = given.joined.marks
        learned = None if marks is None else learn(strokes, marks, first_view)
        if learned is None:
            why = "hold no paint" if marks is None else "cover no stroke"
            stage.skipped.append(f"continue: the marks {why}, so there is nothing to learn from")
            return strokes
        after, num = learned(strokes)
        stage.did = f"{num:,} of {len(strokes):,} strokes are like those below the marks"
        stage.counts = {"strokes": num}
    return after


def _changed(coat: Coat, file: "Overpaint", pose: Pose | None, strokes: Gaussians) -> Coat:
    """A coat with strokes cut and turned where they were at the moment of the pose."""
    from brushgs.passes.marks.changes import combed, cut_of

    moved = coat.strokes if pose is None else pose.moved(coat.strokes)
    if file.combs is not None and len(moved):
        turned = combed(moved, file.combs)
        at_rest = turned if pose is None else pose.at_rest(turned)
        coat, moved = _turned(coat, at_rest.quats), turned
    if file.erased is None or not len(moved):
        return coat
    found = cut_of(moved, file.erased)
    if found is not None and pose is not None:
        from brushgs.passes.marks.moving import tied

        discs, normals = tied(found.discs, found.normals, strokes, pose)
        found = replace(found, discs=discs, normals=normals)
    return coat if found is None else replace(coat, cut=found if coat.cut is None else coat.cut + found)


def _turned(coat: Coat, quats: "Array") -> Coat:
    """A coat with new rotations of its strokes; their fields of directions turn too."""
    strokes, fields = replace(coat.strokes, quats=quats), coat.fields
    if fields is not None:
        before, after = (rotation_matrices(one.quats) for one in (coat.strokes, strokes))
        turns = after @ before.swapaxes(1, 2)
        fields = fields.turned(lambda vectors: np.einsum("nij,nj->ni", turns, vectors))
    return replace(coat, strokes=strokes, fields=fields)


def coats_of_marks(
    marks: "Marks",
    strokes: Gaussians,
    threads: int | None = None,
    pose: Pose | None = None,
    around: Sequence[Gaussians] = (),
) -> list[Coat]:
    """The coats of the marks of one file, as many as their tiles need.

    Args:
        marks: one or more.
        strokes: of the scene: a mark shows where none of them hides it.
        threads: that draw.
        pose: of the strokes at the moment of the marks, which then follow them; None if nothing moves.
        around: strokes of a backdrop or a stage, on which marks may lie too.
    """
    from brushgs.passes.marks.strokes import strokes_of

    laid = nearest_regions(strokes, strokes_of(marks))
    normals: Array = marks.normals
    if pose is not None:
        from brushgs.passes.marks.moving import tied

        laid, normals = tied(laid, normals, strokes, pose)
    tolerances = _tolerances(laid, [strokes, *around])
    order = np.argsort(marks.layers, kind="stable")
    found = []
    for start in range(0, len(order), MOST_BRUSHES - 1):
        rows = order[start : start + MOST_BRUSHES - 1]
        coat = _coat(marks.take(rows), laid.take(rows), float(tolerances[rows].max()), threads)
        found.append(replace(coat, normals=normals[rows], layers=marks.layers[rows]))
    return found


def _coat(marks: "Marks", laid: Gaussians, tolerance: float, threads: int | None) -> Coat:
    from brushgs.passes.marks.strokes import SIGMAS, brush_of
    from brushgs.values.marks import NO_TILE

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
        is_one_sided=True,
        is_flat=True,
    )


def _tolerances(laid: Gaussians, strokes: Sequence[Gaussians]) -> "F64":
    """[N] depth by which each mark may lie behind the paint there, in its own sizes."""
    own, means = _sizes(laid), np.concatenate([one.means.astype(np.float64) for one in strokes])
    if not len(means):
        return np.full(len(laid), BEHIND)
    from brushgs.passes.neighbours import nearest

    _, rows = nearest(means, laid.means.astype(np.float64), min(NEAR, len(means)))
    sizes = np.concatenate([_sizes(one) for one in strokes])
    around: Rows = np.asarray(rows).reshape(len(laid), -1)
    return np.asarray(BEHIND * sizes[around].max(axis=1) / np.maximum(own, 1e-300))


def _sizes(strokes: Gaussians) -> "F64":
    """[N] geometric means of the two larger standard deviations, as in `DepthTest.by_picture`."""
    larger = np.sort(strokes.scales.astype(np.float64), axis=1)[:, 1:]
    return np.asarray(np.sqrt(larger.prod(axis=1)))
