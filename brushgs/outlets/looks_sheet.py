"""A sheet of looks: one scene painted in each look, side by side, with names.

Pictures are painted by `paint_file`, as by `brushgs render --look`; the default scene is the example still
life.
"""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.formats.files import scratch_folder
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.look import Look
from brushgs.options.painting import ViewConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.outputs import check_output, input_files, scene_inputs
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_file
from brushgs.pipeline.strokes import write_scene
from brushgs.pipeline.views_sheet import FADED, GAP, INK, PAPER
from brushgs.rendering.letters import BOLD, Words, shortened, with_words
from brushgs.still_life import still_life, still_life_camera
from brushgs.values.arrays import F32
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.shot import Origin, Shot

COLUMNS = 4
CELL = (640, 480)  # pixels of a picture: strokes are visible from this size
NAME_SIZE, NOTE_SIZE, CAPTION = 18, 13, 62  # pixels
LETTER = 0.53  # mean width of a letter over its height


def paint_looks(
    looks: Sequence[Look],
    output: str | Path,
    *,
    scene: SceneFiles | None = None,
    view: ViewConfig | None = None,
    threads: int | None = None,
    report: Report | None = None,
    origin: Origin | None = None,
) -> Report:
    """Paint a scene in several looks, on one sheet.

    Args:
        looks: at least one.
        output: picture to write; the suffix decides the format.
        scene: the files of a trained 3D Gaussian scene; None for the example still life.
        view: of the scene; its `size` is that of one picture, 640 x 480 if None. Of the still life only the
            size is used.
        threads: None takes every processor available; the picture does not depend on it.
        report: gets one stage per look; a new one if None.
        origin: metadata of the sheet; or None.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if a look does not suit the scene.
    """
    report, output, view = report or Report(), Path(output), view or ViewConfig()
    inputs = () if scene is None else scene_inputs(scene)
    check_output(output, PICTURE_SUFFIXES, inputs=inputs)
    for look in looks:
        check_output(output, PICTURE_SUFFIXES, inputs=input_files(inputs or output, look.config))
    width, height = view.fixed_size or CELL
    view = replace(view, size=(width, height))
    pictures = []
    with scratch_folder() as folder:
        camera = None
        if scene is None:
            scene, camera = folder / "still_life.ply", still_life_camera(width=width, height=height)
            with report.stage("build") as stage:
                gaussians = still_life()
                stage.did = f"a still life of {len(gaussians):,} Gaussians, SH degree 3"
                stage.counts = {"gaussians": len(gaussians)}
                write_scene(gaussians, scene, Report())
            del gaussians
        for number, look in enumerate(looks):
            pictures.append(
                _painted(look, scene, view, camera, threads, folder, report, repeats_notes=number == 0)
            )
    with report.stage("sheet") as stage:
        sheet, has_words = _lay_out(looks, pictures)
        frame, white = Frame(sheet, np.ones(sheet.shape[:2], np.float32)), (1.0, 1.0, 1.0)
        write_frame(frame, output, background=white, shot=Shot(origin=origin))
        stage.did = f"{output}, {len(looks)} looks"
        stage.counts = {"path": str(output), "looks": [look.name for look in looks]}
        if not has_words:
            stage.skipped.append("names: this build of OpenImageIO draws no letters")
    report.output = str(output)
    return report


def _painted(
    look: Look,
    scene: SceneFiles,
    view: ViewConfig,
    camera: Camera | None,
    threads: int | None,
    folder: Path,
    report: Report,
    *,
    repeats_notes: bool,
) -> F32:
    """[H, W, 3] the scene in a look; scene warnings are issued once."""
    config = replace(look.config, view=view)
    config = replace(config, draw=replace(config.draw, threads=threads))
    picture = folder / "picture.png"
    with report.stage(look.name) as stage, warnings.catch_warnings():
        if not repeats_notes:
            warnings.simplefilter("ignore", SceneWarning)
        painted = paint_file(scene, picture, config, camera=camera)
        # Each coat is projected by itself; marks are made of strokes, some of none.
        of_coats = [one.counts["before"] for one in painted.stages if one.name.split()[0] == "project"]
        num_strokes = max(of_coats)
        stage.did = f"{look.title}, {num_strokes:,} strokes"
        stage.counts = {"strokes": num_strokes}
        stage.details = [f"{one.name} {one.seconds:.3f} s" for one in painted.stages]
        return read_image(picture)[..., :3]


def _lay_out(looks: Sequence[Look], pictures: Sequence[F32]) -> tuple[F32, bool]:
    """[H, W, 3] the sheet, and whether it has text."""
    height, width = pictures[0].shape[:2]
    columns = min(COLUMNS, len(looks))
    across, down = width + GAP, height + CAPTION
    sheet = np.empty((GAP + down * -(-len(looks) // columns), GAP + across * columns, 3), np.float32)
    sheet[:] = PAPER
    words = []
    for number, (look, picture) in enumerate(zip(looks, pictures, strict=True)):
        left, top = GAP + number % columns * across, GAP + number // columns * down
        sheet[top : top + height, left : left + width] = picture
        below = top + height + 4 + NAME_SIZE
        words.append(Words(look.name, left, below, NAME_SIZE, INK, BOLD))
        indent = round((len(look.name) + 2) * NAME_SIZE * 0.6)
        title = shortened(look.title, int((width - indent) / (NOTE_SIZE * LETTER)))
        words.append(Words(title, left + indent, below, NOTE_SIZE, INK))
        note = shortened(look.good_for, int(width / (NOTE_SIZE * LETTER)))
        words.append(Words(note, left, below + 8 + NOTE_SIZE, NOTE_SIZE, FADED))
    drawn = with_words(sheet, words)
    return (sheet, False) if drawn is None else (drawn, True)
