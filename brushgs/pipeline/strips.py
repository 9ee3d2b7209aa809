"""Large pictures are painted strip by strip while they are written, so that no plane of the whole is held.

A strip is a part of the picture, see `Painting.part`: the file is that of a picture painted in one piece.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from brushgs.core.memory import machine_memory
from brushgs.formats.pictures.oiio import Strips
from brushgs.options.memory_size import memory_words
from brushgs.pipeline.drawing import project_coat, warn_if_blank
from brushgs.pipeline.look import MOST_PIXELS
from brushgs.pipeline.media.materials import BACKDROP, CUT_IN
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.part import TILE, Part

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting

UNCHECKED = 1 << 25  # pixels of a picture in one piece that is tried on any machine
OF_WHOLE = ("watercolour", "ink")  # media whose washes and blacks need the whole picture
STRIP_PIXELS = 1 << 22  # with some 100 bytes each while it is painted
LEAST_ROWS = 4  # of a strip, relative to the rows that are painted beside each of its borders
# Bytes that a pixel of a picture in one piece takes: of oil 100, of ink 120, of washes 220.
BYTES, BYTES_OF_WHOLE = 120, 220


def needs_strips(painting: "Painting", camera: Camera) -> bool:
    """Whether a picture is too large for one piece, and can be painted in several."""
    part = painting.part
    num = camera.width * camera.height if part is None else part.width * part.height
    return num > MOST_PIXELS and painting.reach(camera) is not None


def check_memory(painting: "Painting", camera: Camera) -> None:
    """Refuse a large picture in one piece that the memory of this machine does not hold.

    Raises:
        ValueError: if it does not.
    """
    num, known, is_whole = camera.width * camera.height, machine_memory(), painting.reach(camera) is None
    needed = num * (BYTES_OF_WHOLE if is_whole else BYTES)
    if num <= UNCHECKED or known is None or needed <= known or (painting.part and not is_whole):
        return
    cure = "take another look" if is_whole else "write a PNG, TIFF or JPEG without layers"
    reason = "its washes or blacks need " if is_whole else "it takes "
    size = f"{camera.width}x{camera.height}"
    raise ValueError(
        f"size must suit the memory: {reason}some {memory_words(needed)} for {size} pixels at once, and this "
        f"machine has {memory_words(known)}; {cure}, or fewer pixels"
    )


def strips(
    painting: "Painting", camera: Camera, report: Report, *, advice: str = "", is_whole: bool = True
) -> Strips:
    """A painting in strips; its strokes are projected at once.

    Args:
        painting: whose pictures depend on parts of it alone.
        camera: the view.
        report: gets the stages.
        advice: see `project_coat`.
        is_whole: whether an almost empty picture is worth a warning.
    """
    among = len(painting.coats)
    laid = [(coat, project_coat(coat, camera, report, advice=advice, among=among)) for coat in painting.coats]
    whole = painting.part or Part.whole(camera.width, camera.height)
    margin = painting.reach(camera) or 0  # painted as well at both borders of a strip
    rows = max(STRIP_PIXELS // whole.width, LEAST_ROWS * margin) // TILE[1] * TILE[1] or TILE[1]
    parts = [
        Part(whole.left, top, whole.width, min(rows, whole.rows.stop - top))
        for top in range(whole.top, whole.rows.stop, rows)
    ]

    def frames() -> Iterator[Frame]:
        most = 0.0
        for part in parts:
            canvas = replace(painting, part=part).canvas(camera)
            for coat, boxes in laid:
                frame = canvas.lay(coat, boxes)
                if coat.name not in (BACKDROP, CUT_IN):
                    most = max(most, float(frame.alpha.mean()))
            yield canvas.finish(painting.lamp)
        coat, boxes = max(laid, key=lambda one: len(one[1]))
        if is_whole:
            warn_if_blank(coat, boxes, camera, most)

    with report.stage("strips") as stage:
        stage.did = f"{len(parts)} of {whole.width} x {rows} pixels, painted as they are written"
        stage.counts = {"strips": len(parts), "rows": rows}
    return Strips(whole.height, whole.width, frames)
