"""Learn a style from two states of a scene: scenes before and after an edit, or pictures before and after.

Of pictures the Gaussians take up the colors that they show, before and after alike, by how much of each
pixel each makes up: so an edit that was made to pictures is learned as one of the scene. A picture of the
scene that was painted over needs none before it, and has marks too: their size, direction and contours are
learned where it shows the scene.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.options.scene_source import SceneSource
from brushgs.options.style_edit import EditSource
from brushgs.outlets.learn_style import printable, write_learnt
from brushgs.passes.color.picture_votes import votes
from brushgs.passes.style.learn_edit import LearntEdit, learn_edit, learn_from_colors, sampled
from brushgs.pipeline.masks import MaskOpener, open_with_camera
from brushgs.pipeline.outputs import check_output
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.strokes import load_scene
from brushgs.pipeline.views import default_first_view
from brushgs.rendering.plain import plain_views
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.style import Style, StyleLines, StyleMarks

MOST_SIDE = 512  # pixels: larger pictures are averaged down, which does not affect an affine map
FULLY = 0.995  # shares above this are not reported
LEAST_SEEN = 0.5  # pixels over all pictures for a known color of a Gaussian


def learn_edit_file(source: EditSource, output: Path, name: str | None, report: Report) -> Report:
    """Learn the style of an edit and write it.

    Args:
        source: the states before and after.
        output: a file *.style.
        name: of the style; None for the name of the state after the edit.
        report: collects the stages.

    Raises:
        ValueError: if the output has another suffix than .style.
        SceneError: if a file cannot be read, or before and after do not belong together.
    """
    check_output(output, (STYLE_SUFFIX,), inputs=source.inputs)
    marks, lines = None, None
    if source.scene is None:
        learned = _of_scenes(source, report)
    else:
        assert source.camera_file is not None, "see EditSource"
        learned = _of_pictures(source, source.scene, source.camera_file, report)
        if source.before is None:
            marks, lines = _marks_over(source, source.scene, source.camera_file, report)
    style = Style(printable(name or source.after.stem), None, marks, learned.edit, lines=lines)
    return write_learnt(style, output, report)


def _of_scenes(source: EditSource, report: Report) -> LearntEdit:
    assert source.before is not None, "see EditSource"
    before, notes = load_scene(SceneSource((source.before,), seeks_cameras=False), report)
    after, _ = load_scene(source.after, report)
    view = default_first_view(before, notes, report, up=source.up)
    with report.stage("edit") as stage:
        try:
            learned = learn_edit(before, after, view)
        except ValueError as error:
            raise SceneError(source.after, str(error)) from None
        _describe(stage, learned)
    return learned


def _of_pictures(source: EditSource, scene: Path, camera_file: Path, report: Report) -> LearntEdit:
    gaussians, notes = load_scene(SceneSource((scene,), seeks_cameras=False), report)
    view = default_first_view(gaussians, notes, report, up=source.up)
    opener = MaskOpener(camera_file, "picture")
    with report.stage("pictures") as stage:
        after = opener.pairs(source.after)
        before = after if source.before is None else opener.pairs(source.before)
        if len(before) != len(after):
            numbers = f"holds {len(after)} pictures after the edit for {len(before)} before it"
            raise SceneError(source.after, f"{numbers}; give each picture before one after, of the same name")
        sides = (
            _seen_colors(gaussians, before, is_own=source.before is None),
            _seen_colors(gaussians, after),
        )
        colors, weights = zip(*sides, strict=True)
        seen = np.flatnonzero(np.minimum(*weights) >= LEAST_SEEN)
        if not len(seen):
            raise SceneError(
                source.before or source.after,
                f"shows nothing of {scene.name}; give the cameras that the pictures are of",
            )
        what = "painted over" if source.before is None else "before and after"
        stage.did = f"{len(after)} {what}, which show {len(seen)} of {len(gaussians)} Gaussians"
        stage.counts = {"pictures": len(after), "seen": len(seen)}
    with report.stage("edit") as stage:
        chosen, says = sampled(np.minimum(*weights)[seen])
        rows = seen[chosen]
        learned = learn_from_colors(gaussians, rows, colors[0][rows], colors[1][rows], says, view)
        _describe(stage, learned)
    return learned


def _marks_over(
    source: EditSource, scene: Path, camera_file: Path, report: Report
) -> tuple[StyleMarks | None, StyleLines | None]:
    """The marks and contours of the first picture that was painted over, where it shows the scene."""
    from brushgs.passes.style.contours import learn_lines
    from brushgs.passes.style.marks import learn_marks

    with report.stage("marks") as stage:
        gaussians, _ = load_scene(SceneSource((scene,), seeks_cameras=False), Report())
        file, camera = MaskOpener(camera_file, "picture").pairs(source.after)[0]
        rgb, alpha, own = open_with_camera(file, camera, "give the pictures that the cameras are of")
        small = own.in_side(MOST_SIDE)
        shown = plain_views(gaussians, [small]).frames[0].alpha
        rows = (np.arange(alpha.shape[0]) * small.height // alpha.shape[0])[:, None]
        columns = np.arange(alpha.shape[1]) * small.width // alpha.shape[1]
        covered = alpha * shown[rows, columns]
        try:
            marks = learn_marks(np.concatenate([rgb, covered[..., None]], axis=-1))
        except ValueError as error:
            stage.skipped.append(f"marks: {str(error).removeprefix('learn_marks: ')}")
            return None, None
        lines = learn_lines(rgb, marks)
        stage.did = f"{marks.length:.1%} of the shorter side long, {marks.aspect:.1f} times their width"
        stage.counts = {"length": marks.length, "aspect": marks.aspect, "lines": lines is not None}
    return marks, lines


def _seen_colors(
    gaussians: Gaussians, pictures: list[tuple[Path, Camera]], *, is_own: bool = False
) -> tuple[F64, F64]:
    """[N, 3] the mean color in which pictures show each Gaussian, and [N] by how many pixels.

    Where they are `is_own`, the scene itself stands for what the pictures show.
    """
    sums, weights = np.zeros((len(gaussians), 3)), np.zeros(len(gaussians))
    for file, camera in pictures:  # one at a time, to limit memory
        rgb, alpha, own = _reduced(
            *open_with_camera(file, camera, "give the pictures that the cameras are of")
        )
        if is_own:
            frame = plain_views(gaussians, [own]).frames[0]
            rgb = frame.rgb / np.maximum(frame.alpha, 1e-6)[..., None]
        found, shares = votes(gaussians, [own], [rgb], pixel_weights=[alpha])
        sums += found
        weights += shares
    return sums / np.maximum(weights, 1e-12)[:, None], weights


def _reduced(rgb: Array, alpha: Array, camera: Camera) -> tuple[Array, Array, Camera]:
    """A picture and its camera, averaged down to `MOST_SIDE`, weighted by alpha."""
    side = -(-max(alpha.shape) // MOST_SIDE)
    if side == 1:
        return rgb, alpha, camera
    height, width = (max(length // side, 1) for length in alpha.shape)

    def means(values: Array) -> Array:
        part = values[: height * side, : width * side]
        return np.asarray(part.reshape(height, side, width, side, -1).mean(axis=(1, 3)))

    less = means(alpha)[..., 0]
    colors = means(rgb * alpha[..., None]) / np.maximum(less, 1e-6)[..., None]
    K = camera.K.copy()
    K[:2] /= side
    return colors, less, replace(camera, K=np.asarray(K), width=width, height=height)


def _describe(stage: Stage, learned: LearntEdit) -> None:
    """Report the learned style and its fit."""
    edit = learned.edit
    words = f"colors changed by {learned.changed:.1%}; an affine map leaves {learned.left:.1%}"
    if learned.kept < FULLY:
        kept = f"{learned.kept:.0%} of it is" if learned.kept > 1 - FULLY else "nothing of it is"
        words += f" ({kept} kept: what holds for colors that it was not fitted to)"
    if edit.residual is not None:
        names = ", ".join(name.replace("_", " ") for name in edit.residual.features)
        words += f", with {len(edit.residual.centers)} bumps over {names} {learned.held_out:.1%}"
        if learned.bumps_kept < FULLY:
            words += f" ({learned.bumps_kept:.0%} of them kept)"
    if edit.log_size:
        words += f"; sizes times {np.exp(edit.log_size):.3g}"
    stage.did = words
    stage.counts = {
        "pairs": learned.num_pairs,
        "changed": learned.changed,
        "left": learned.left,
        "kept": learned.kept,
        "bumps_kept": learned.bumps_kept,
        "held_out": learned.held_out,
        "bumps": 0 if edit.residual is None else len(edit.residual.centers),
        "features": [] if edit.residual is None else list(edit.residual.features),
        "log_size": edit.log_size,
    }
