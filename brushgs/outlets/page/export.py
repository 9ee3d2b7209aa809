"""`brushgs export`: a scene file -> a page. Stages: those of `prepare`, then picture and page."""

from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from msgspec.structs import replace

from brushgs.cameras.first_view import framing
from brushgs.errors import SceneError
from brushgs.options.moment import Moment
from brushgs.options.page import PAGE_SUFFIXES
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.outlets.page.contents import Stop
from brushgs.outlets.page.html import Preview
from brushgs.outlets.page.motion import PageMotion
from brushgs.outlets.page.view import PageView
from brushgs.outlets.page.write import write_page
from brushgs.pipeline.clip import Clip, files_of
from brushgs.pipeline.outputs import check_output, input_files
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import name_of

if TYPE_CHECKING:
    from brushgs.values.notes import LoadNotes

MOST_STOPS = 99  # of a page


def export_file(
    scene: SceneFiles | Clip,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    title: str | None = None,
    options: Sequence[str] = (),
    preview: Preview | None = None,
    stops: Path | None = None,
    report: Report | None = None,
) -> Report:
    """Paint a scene file to a page, whose first view is the picture of `paint_file`.

    Args:
        scene: the files of a trained 3D Gaussian scene, or of strokes; or a moving scene, whose page plays.
        output: .html file to write.
        config: see `PaintConfig`.
        title: of the page, any text; None for the name of the scene.
        options: the words after `brushgs render SCENE` that paint this, but for the view: the page offers
            them with the view that it shows.
        preview: see `write_page`.
        stops: camera file of views that the page leads through, in its order; or None.
        report: gets the stages; a new one if None.

    Returns:
        The report, one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene; before long work if possible.
    """
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    files = files_of(scene)
    assert files is not None, "a clip in memory has no name, and no command paints it"
    source = SceneSource.of(files)
    inputs = input_files(source, config)
    check_output(output, PAGE_SUFFIXES, inputs=inputs if stops is None else (*inputs, stops))
    led_to = [] if stops is None else read_stops(stops)
    of_scene: SceneSource | Clip = source
    if isinstance(scene, Clip):
        of_scene, config = scene, of_stills(config)
    prepared = prepare(of_scene, config, report, asks=(*PICTURE, "first_view"))
    motion = None if prepared.moving is None else PageMotion.of(prepared.moving)
    write_page(
        prepared.painting,
        prepared.camera,
        output,
        view=view_of(prepared, config),
        title=name_of(source, prepared.notes) if title is None else title,
        command=command_of(source, options, prepared.notes),
        background=prepared.background,
        regions=prepared.region_names,
        preview=preview,
        stops=led_to,
        motion=motion,
        report=report,
    )
    report.output = str(output)
    return report


def of_stills(config: PaintConfig) -> PaintConfig:
    """The options of a moving scene for a page, which knows no path: it paints every moment as a still."""
    draw = config.draw
    stills = replace(draw, lock=draw.lock_of(along_path=False), order=draw.order_of(along_path=False))
    return replace(config, draw=stills)


def read_stops(path: Path) -> list[Stop]:
    """The views of a camera file as stops: the key views of a path, else all; by the names of their pictures.

    Raises:
        SceneError: if the file cannot be read, or has more than `MOST_STOPS` views.
    """
    from brushgs.formats.cameras.read import read_cameras

    file = read_cameras(path)
    cameras = file.keys or file.cameras
    if len(cameras) > MOST_STOPS:
        most = f"a page leads through at most {MOST_STOPS}"
        raise SceneError(path, f"has {len(cameras):,} views, and {most}; leave some out")
    names = file.names if len(file.names) == len(cameras) else ("",) * len(cameras)
    titles = (PurePath(name).stem or f"View {number}" for number, name in enumerate(names, 1))
    return [Stop(title, camera) for title, camera in zip(titles, cameras, strict=True)]


def view_of(prepared: Prepared, config: PaintConfig) -> PageView:
    """The target of the page's camera, for a painting with a known first view."""
    assert prepared.first_view is not None, "ask for first_view"
    view = prepared.first_view
    is_framed = config.view.camera_file is None
    return PageView.of(view, prepared.camera, framing(view, config.view)["look_at"] if is_framed else None)


def command_of(
    source: SceneSource, options: Sequence[str], notes: "LoadNotes | None" = None
) -> tuple[str, list[str]]:
    """Scene and options of `brushgs render SCENE OPTIONS`; further files of a scene are part of the options.

    Args:
        source: its files.
        options: the words of the options.
        notes: of the scene; the moment of a moving scene is added to the options, as `render` would paint a
            film.
    """
    first, *more = map(str, source.paths)
    lod = [] if source.lod is None else ["--lod", str(source.lod)]
    moment = source.time
    if moment is None and notes is not None and notes.moment is not None:
        moment = Moment(notes.moment)
    time = [] if moment is None else ["--time", moment.word]
    rate = source.moments_per_second
    moments = [] if rate is None else ["--moments-per-second", str(rate)]
    return first, [*more, *lod, *time, *moments, *options]
