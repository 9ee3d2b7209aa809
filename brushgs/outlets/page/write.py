"""Write a painting as a page."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from brushgs.formats.files import replacing
from brushgs.formats.pictures.oiio import Background
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import Stop, page_contents
from brushgs.outlets.page.html import Preview, page_html
from brushgs.outlets.page.motion import PageMotion
from brushgs.outlets.page.still import icon_of, paint_first_view, still_of
from brushgs.outlets.page.view import PageView
from brushgs.outlets.page.weight import Weight, warnings_of
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from brushgs.values.camera import Camera


def write_page(
    painting: Painting,
    camera: Camera,
    output: str | Path,
    *,
    view: PageView,
    title: str,
    command: tuple[str, Sequence[str]],
    background: Background = None,
    regions: Sequence[str] = (),
    preview: Preview | None = None,
    stops: Sequence[Stop] = (),
    motion: PageMotion | None = None,
    report: Report | None = None,
) -> Weight:
    """Write a page; the file appears when it is complete.

    Args:
        painting: see `page_contents`, also for other arguments.
        camera: the first view.
        output: the name of the file.
        view: target of the page's camera.
        title: any text.
        command: the scene and the options of `brushgs render`.
        background: one RGB color, a picture [H, W, 3], or None for transparent.
        regions: the names of the regions of the strokes from 1 on.
        preview: what the page tells of itself. A picture that it names is written beside the page; one that
            has an address has a picture in any case. Its icon is made here.
        stops: views that the page leads through.
        motion: of the strokes; None if nothing moves.
        report: gets the stages "first view" and "page", and notes where a device would suffer.

    Raises:
        SceneError: if the file cannot be written.
    """
    report = report or Report()
    with report.stage("picture") as stage:
        first = painting if motion is None else motion.first(painting)
        frame, weight = paint_first_view(first, camera)
        still = still_of(frame, background)
        stage.did = (
            f"first view: {weight.fragments / 1e6:.1f} million fragments, {weight.overdraw:.1f} on a "
            f"painted pixel; moving, {weight.moving:.1f} on a pixel"
        )
        stage.counts = {
            "fragments": round(weight.fragments),
            "overdraw": round(weight.overdraw, 3),
            "fragments_per_pixel": round(weight.per_pixel, 3),
            "fragments_per_pixel_moving": round(weight.moving, 3),
            "painted": round(weight.painted / weight.pixels, 6),
            "still_bytes": len(still),
        }
    with report.stage("page") as stage:
        contents = page_contents(
            painting,
            camera,
            view=view,
            title=title,
            command=command,
            background=None if background is None else np.asarray(background),
            regions=regions,
            stops=stops,
            motion=motion,
        )
        told = preview or Preview()
        picture = told.picture or (Path(output).with_suffix(".jpg").name if told.address else "")
        told = replace(told, picture=picture, icon=icon_of(frame, background))
        text = page_html(write_container(contents), title=title, still=still, preview=told)
        if picture:
            with replacing(Path(output).with_name(picture)) as temporary:
                temporary.write_bytes(still)
        with replacing(output) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
        num_bytes = Path(output).stat().st_size
        stage.did = (
            f"{output}: {num_bytes / 1e6:.2f} MB, {contents.num_strokes:,} strokes, "
            f"{weight.vertices:,} vertices"
        )
        stage.counts = {
            "path": str(output),
            "bytes": num_bytes,
            "strokes": contents.num_strokes,
            "vertices": weight.vertices,
            "brushes": len(contents.header["brushes"]),
            "coats": len(contents.header["coats"]),
        }
        stage.skipped += contents.omitted
    for warning in warnings_of(weight, num_bytes):
        report.tell(warning)
    return weight
