"""A chart of all built-in strokes: one mark each, with name and use."""

from pathlib import Path

import numpy as np

from brushgs.brushes.builtin import StrokeNotes, stroke_notes
from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneError
from brushgs.formats.pictures.images import write_frame
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.pipeline.outputs import check_output
from brushgs.rendering.letters import shortened
from brushgs.rendering.rasterize import rasterize
from brushgs.values.arrays import F32
from brushgs.values.boxes import Boxes
from brushgs.values.colors import rgb_of
from brushgs.values.frame import Frame
from brushgs.values.shot import Origin, Shot

COLUMNS = 4
CELL = 330, 250  # width and height, pixels
MARK = 256, 150  # that a mark fits into
KERNEL_SHAPE = 1.7  # length over width of the two marks that are no images
PAPER, INK, FADED = "#f1e8d8", "#33261c", "#7d6b59"
PAINTS = ("#26303f", "#8c3b22", "#b07a2c", "#3d5b4d", "#5a2f3c")  # indigo, sienna, ochre, green earth, madder
NAME_SIZE, NOTE_SIZE = 21, 13  # of letters, pixels
BOLD, PLAIN = "DroidSans-Bold", "DroidSans"  # fonts that come with OpenImageIO
LONGEST_NOTE = 44  # letters of a note that fit into a cell


def write_stroke_chart(path: str | Path, origin: Origin | None = None) -> None:
    """Draw the chart to a picture file.

    Args:
        path: its suffix decides the format.
        origin: metadata of the chart; or None.

    Raises:
        ValueError: if the suffix is that of no picture format.
        SceneError: if the file cannot be written, or this build of OpenImageIO draws no letters.
    """
    path = Path(path)
    check_output(path, PICTURE_SUFFIXES)
    sheet = stroke_chart()
    if sheet is None:
        raise SceneError(path, "needs letters, which this build of OpenImageIO has not; install it with pip")
    frame, white = Frame(sheet, np.ones(sheet.shape[:2], np.float32)), (1.0, 1.0, 1.0)
    write_frame(frame, path, background=white, shot=Shot(origin=origin))


def stroke_chart() -> F32 | None:
    """[H, W, 3] the chart, display-encoded; None if OpenImageIO was built without fonts."""
    import OpenImageIO

    notes = stroke_notes()
    width, height = CELL
    rows = -(-len(notes) // COLUMNS)
    sheet = np.empty((rows * height, COLUMNS * width, 3), np.float32)
    sheet[:] = rgb_of(PAPER)
    for number, note in enumerate(notes):
        x, y = number % COLUMNS * width, number // COLUMNS * height
        color = PAINTS[number % len(PAINTS)]  # one more than columns: neighbors differ
        cell = sheet[y : y + height, x : x + width]
        cell[:] = _mark(note, color).over(rgb_of(PAPER))
    picture = OpenImageIO.ImageBuf(sheet)
    for number, note in enumerate(notes):
        middle = number % COLUMNS * width + width // 2
        top = number // COLUMNS * height + 40 + MARK[1]
        for text, below, size, font, color in (
            (note.name, NAME_SIZE, NAME_SIZE, BOLD, INK),
            (
                shortened(note.good_for.split(";")[0], LONGEST_NOTE),
                NAME_SIZE + 8 + NOTE_SIZE,
                NOTE_SIZE,
                PLAIN,
                FADED,
            ),
        ):
            if text and not OpenImageIO.ImageBufAlgo.render_text(
                picture, middle, top + below, text, size, font, rgb_of(color), "center", "baseline"
            ):
                return None
    return np.asarray(picture.get_pixels(OpenImageIO.FLOAT), np.float32)


def _mark(note: StrokeNotes, color: str) -> Frame:
    """One stroke in a cell, transparent around it."""
    texture = StrokeTexture.open(note.name)
    rows, columns = texture.coverage.shape
    shape = columns / rows if texture.kind == "image" else KERNEL_SHAPE
    length = min(MARK[0], MARK[1] * shape)
    extents = 0.5 * length, 0.5 * length / shape
    boxes = Boxes(
        centers=np.array([(0.5 * CELL[0], 30 + 0.5 * MARK[1])], np.float32),
        half_extents=np.array([extents], np.float32),
        angles=np.zeros(1, np.float32),
        depths=np.ones(1, np.float32),
        colors=np.array([rgb_of(color)], np.float32),
        opacities=np.ones(1, np.float32),
        ids=np.zeros(1, np.int32),
    )
    return rasterize(boxes, texture, width=CELL[0], height=CELL[1], depth=False)
