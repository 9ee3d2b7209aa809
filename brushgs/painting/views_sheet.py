"""A contact sheet of a scene: small plain pictures from all around, each with the flags that give it.

Columns are azimuths, beginning with that of the first view. Rows are elevations; where it is not sure which
way is up, they are the up axes in question, the most probable first.
"""

import warnings
from dataclasses import dataclass, field, replace
from math import degrees, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.arrays import F32
from brushgs.cameras.first_view import flags_of, framed_camera, up_text
from brushgs.cameras.framing import AXES
from brushgs.cameras.framing import with_up as turned
from brushgs.errors import SceneWarning
from brushgs.io.pictures.formats import PICTURE_SUFFIXES
from brushgs.io.pictures.letters import BOLD, Words, with_words
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.painting.clean import clean_scene
from brushgs.painting.outputs import check_output, scene_inputs
from brushgs.painting.prepare import Prepared
from brushgs.painting.report import Report
from brushgs.painting.strokes import load_scene, name_of
from brushgs.painting.views import choose_first_view, doubt_in_words, in_doubt
from brushgs.scene import FirstView, Frame, Gaussians

if TYPE_CHECKING:
    from brushgs.rendering.options import RenderOptions

NUM_AZIMUTHS = 8
RISES = (0.0, 30.0, -12.0)  # degrees from the elevation of the first view, one a row
LOWEST, HIGHEST = -30.0, 80.0  # degrees of elevation
MOST_UPS, LEAST_PROBABLE = 4, 0.01  # rows where up is in doubt
FIRST = "the first view"
CELL = (256, 192)  # pixels of a picture
GAP, CAPTION, TITLE = 10, 40, 52  # pixels
PAPER, INK = (0.945, 0.910, 0.847), (0.200, 0.149, 0.110)
FADED, ACCENT = (0.490, 0.420, 0.349), (0.549, 0.231, 0.133)


@dataclass(frozen=True)
class Cell:
    """One picture of a sheet.

    Attributes:
        row: from the top, from 0.
        column: from the left, from 0.
        first_view: how the scene is seen in this row.
        config: the view.
        flags: what gives the view on the command line.
        note: words beside them.
    """

    row: int
    column: int
    first_view: FirstView
    config: ViewConfig
    flags: str
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        azimuth, elevation = self.config.azimuth, self.config.elevation
        assert azimuth is not None
        assert elevation is not None
        return {
            "row": self.row,
            "column": self.column,
            "up": up_text(self.first_view.up),
            "azimuth_deg": round(degrees(azimuth), 6),
            "elevation_deg": round(degrees(elevation), 6),
            "flags": self.flags,
            "note": self.note,
        }


@dataclass
class ViewsReport(Report):
    """The report of a sheet.

    Attributes:
        cells: of the sheet, row by row.
    """

    cells: list[Cell] = field(default_factory=list)

    def as_json(self) -> str:
        """Stages and cells as one JSON object."""
        import json

        return json.dumps(
            json.loads(super().as_json()) | {"cells": [cell.as_dict() for cell in self.cells]}, indent=2
        )


def paint_views(
    scene: SceneFiles,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    report: ViewsReport | None = None,
) -> ViewsReport:
    """Show a scene file from all around on one sheet.

    Args:
        scene: a trained 3D Gaussian scene, or strokes.
        output: picture to write; the suffix decides the format.
        config: of its `view` `up`, `fov_y`, `zoom`, `look_at`, `pan` and `roll` are those of all pictures,
            and `size` is that of one, 256 x 192 if None; `clean` and `draw.threads` are used too.
        report: gets the stages and the cells; a new one if None.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene.
    """
    config, report, output = config or PaintConfig(), report or ViewsReport(), Path(output)
    view, threads = config.view, config.draw.threads
    check_output(output, PICTURE_SUFFIXES, inputs=scene_inputs(scene))
    gaussians, notes = load_scene(scene, report)
    gaussians = clean_scene(gaussians, config.clean, report, is_strokes=notes.is_strokes)
    with warnings.catch_warnings():  # the title of the sheet says it if up is in doubt
        warnings.simplefilter("ignore", SceneWarning)
        first_view = choose_first_view(gaussians, view, notes, report)
    report.cells = write_sheet(
        gaussians, first_view, output, report, name=name_of(scene, notes), view=view, threads=threads
    )
    report.output = str(output)
    return report


def write_sheet(
    gaussians: Gaussians,
    first_view: FirstView,
    output: Path,
    report: Report,
    *,
    name: str,
    view: ViewConfig | None = None,
    threads: int | None = None,
) -> list[Cell]:
    """Paint and write the sheet of a scene, as one stage of a report.

    Args:
        gaussians: the scene.
        first_view: how it is seen.
        output: picture to write.
        report: gets the stage.
        name: of the scene, for the title.
        view: see `PaintConfig.view` of `paint_views`.
        threads: None takes every processor available; the picture does not depend on it.

    Returns:
        The cells of the sheet.
    """
    view = view or ViewConfig()
    rows = plan_sheet(first_view, view)
    cells = [cell for row in rows for cell in row]
    with report.stage("views", total=len(cells), unit="pictures") as stage:
        from brushgs.brushes.texture import StrokeTexture
        from brushgs.io.pictures.images import write_frame
        from brushgs.rendering.options import RenderOptions

        kernel = StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, depth=False, num_threads=threads)
        pictures = {}
        for cell in cells:
            pictures[cell.row, cell.column] = _picture(gaussians, cell, options)
            report.advance()
        sheet, has_words = _lay_out(rows, pictures, _title(name, first_view))
        write_frame(Frame(sheet, np.ones(sheet.shape[:2], np.float32)), output, background=(1.0, 1.0, 1.0))
        stage.did = f"{output}, {len(cells)} pictures in {len(rows)} rows"
        stage.counts = {"path": str(output), "pictures": len(cells), "rows": len(rows)}
        if not has_words:
            stage.skipped.append(
                "captions: this build of OpenImageIO draws no letters; --json lists the flags"
            )
    return cells


def sheet_beside(output: str | Path, name: str) -> Path:
    """The sheet of a painting, in the same folder; numbered frames have a folder for themselves."""
    path = Path(output)
    folder = path.parent.parent if "%" in path.name else path.parent
    return folder / f"{name}-views{PICTURE_SUFFIXES[0]}"


def write_sheet_of(
    prepared: Prepared, output: Path, config: PaintConfig, report: Report, *, name: str
) -> None:
    """Write the sheet of a scene that is being painted, prepared with its first view and kept.

    A view that options ask for does not matter: the sheet is there to choose one.
    """
    view = ViewConfig(up=config.view.up, fov_y=config.view.fov_y)
    write_sheet(
        prepared.whole_scene,
        prepared.known_view,
        output,
        report,
        name=name,
        view=view,
        threads=config.draw.threads,
    )


def plan_sheet(first_view: FirstView, view: ViewConfig) -> list[list[Cell]]:
    """The views of a sheet, row by row; the first is the first view."""
    view = replace(view, size=view.size or CELL, camera_file=None, azimuth=None, elevation=None, side=None)
    if view.up is None and in_doubt(first_view):
        rows: list[list[Cell]] = []
        for name, probability in first_view.ups[:MOST_UPS]:
            if probability < LEAST_PROBABLE and len(rows) > 1:
                break
            is_known = bool(first_view.up @ AXES[name] > 0.7)  # it may be tilted
            seen = first_view if is_known else turned(first_view, name)
            words = f"up is {name}: {probability:.2f}"
            says_up = not is_known or seen.eye is None  # of a view from inside the flag would lose the eye
            rows.append(_row(len(rows), seen, view, 0.0, words, with_up=says_up, is_first=is_known))
        return rows
    says_up = view.up is not None
    return [
        _row(number, first_view, view, rise, with_up=says_up, is_first=not rise)
        for number, rise in enumerate(RISES)
    ]


def _row(
    number: int,
    seen: FirstView,
    view: ViewConfig,
    rise: float,
    note: str = "",
    *,
    with_up: bool,
    is_first: bool,
) -> list[Cell]:
    """One row of a sheet; `is_first` if it begins with the first view. From inside only that one is seen."""
    elevation = seen.elevation
    if rise:
        elevation = radians(round(min(max(degrees(elevation) + rise, LOWEST), HIGHEST), 1))
    cells = []
    for column in range(NUM_AZIMUTHS):
        is_this = is_first and column == 0
        azimuth = seen.azimuth
        if column:
            azimuth = radians(round((degrees(azimuth) + 360 / NUM_AZIMUTHS * column) % 360, 1))
        config = replace(view, azimuth=azimuth, elevation=elevation)
        if seen.eye is not None and not is_this and config.look_at is None:
            config = replace(config, look_at="subject")
        flags = flags_of(seen, config, with_up=with_up)
        words = ", ".join(filter(None, [note if column == 0 else "", FIRST if is_this else ""]))
        cells.append(Cell(number, column, seen, config, flags, words))
    return cells


def _picture(gaussians: Gaussians, cell: Cell, options: "RenderOptions") -> F32:
    """[H, W, 3] one plain picture."""
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.rendering.options import render_with

    camera = framed_camera(cell.first_view, cell.config)
    frame = render_with(gaussians, camera, StrokeTexture.open("gaussian"), options)
    return np.clip(frame.over(PAPER), 0, 1).astype(np.float32)


def _title(name: str, view: FirstView) -> str:
    if in_doubt(view):
        return f"{name}: {doubt_in_words(view)}"
    sure = "" if view.probability is None else f" (probability {view.probability:.2f})"
    return f"{name}: up is {up_text(view.up)}{sure}"


def _lay_out(rows: list[list[Cell]], pictures: dict[tuple[int, int], F32], title: str) -> tuple[F32, bool]:
    """[H, W, 3] the sheet, and whether it has words."""
    height, width = pictures[0, 0].shape[:2]
    across, down = width + GAP, height + CAPTION
    num_columns = max(len(row) for row in rows)
    sheet = np.empty((TITLE + down * len(rows) + GAP, GAP + across * num_columns, 3), np.float32)
    sheet[:] = PAPER
    words = [Words(title, GAP, 26, 18, INK, BOLD)]
    words.append(Words("Under each picture the flags that give it.", GAP, 44, 12, FADED))
    for row in rows:
        for cell in row:
            left, top = GAP + across * cell.column, TITLE + down * cell.row
            if FIRST in cell.note:
                sheet[top - 3 : top + height + 3, left - 3 : left + width + 3] = ACCENT
            sheet[top : top + height, left : left + width] = pictures[cell.row, cell.column]
            before, azimuth, after = cell.flags.rpartition("--azimuth")
            words.append(Words(before + azimuth + after, left, top + height + 15, 12, INK))
            words.append(Words(cell.note, left, top + height + 30, 12, ACCENT))
    drawn = with_words(sheet, words)
    return (sheet, False) if drawn is None else (drawn, True)
