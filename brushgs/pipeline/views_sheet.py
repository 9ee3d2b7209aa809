"""A contact sheet of a scene: small plain pictures from all around, each with the flags that give it.

Columns are azimuths, beginning with that of the first view. Rows are elevations; if the up axis is in doubt,
they are the possible up axes, most probable first. If the positions of the photographer are known, azimuths
and elevations far from them come last. For a scene seen from inside, the first row holds the other usable
views from there, and the rest shows it from outside.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import degrees, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.cameras.first_view import flags_of, framed_camera, up_text
from brushgs.cameras.framing import AXES, INSIDE_NEAR_SHARE, NEAR_SHARE, camera_axes
from brushgs.cameras.framing import with_up as turned
from brushgs.core.threads import at_most, num_threads_or_default
from brushgs.errors import SceneWarning
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.clean import clean_scene
from brushgs.pipeline.outputs import check_output, scene_inputs
from brushgs.pipeline.prepare import Prepared
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import load_scene, name_of
from brushgs.pipeline.views import choose_first_view, doubt_in_words, in_doubt
from brushgs.rendering.letters import BOLD, Words, with_words
from brushgs.values.arrays import F32, F64
from brushgs.values.camera import FirstView
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.shot import Origin, Shot

if TYPE_CHECKING:
    from brushgs.first_view.walk import Stand
    from brushgs.rendering.options import RenderOptions

NUM_AZIMUTHS = 8
RISES = (0.0, 30.0, -12.0)  # degrees from the elevation of the first view, one per row
LOWEST, HIGHEST = -30.0, 80.0  # degrees of elevation
STOOD_WITHIN = 15.0  # degrees from an elevation to the nearest photographer
MOST_UPS, LEAST_PROBABLE = 4, 0.01  # of rows if up is in doubt
FIRST, INSIDE = "the first view", "from inside"
DIGITS = 3  # of positions, relative to the size of a scene
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
        first_view: of the scene in this row.
        config: the view.
        flags: flags for this view on the command line.
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
    origin: Origin | None = None,
) -> ViewsReport:
    """Show a scene file from all around on one sheet.

    Args:
        scene: a trained 3D Gaussian scene, or strokes.
        output: picture to write; the suffix decides the format.
        config: `up`, `fov_y`, `zoom`, `look_at`, `pan` and `roll` of its `view` are for all pictures, `size`
            is that of one, 256 x 192 if None; `clean` and `draw.threads` are used too.
        report: gets the stages and the cells; None makes a new one.
        origin: metadata of the sheet, or None.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene.
    """
    config, report, output = config or PaintConfig(), report or ViewsReport(), Path(output)
    view, threads = config.view, config.draw.threads
    check_output(output, PICTURE_SUFFIXES, inputs=scene_inputs(scene))
    gaussians, notes = load_scene(scene, report)
    gaussians = clean_scene(gaussians, config.clean, report, is_strokes=notes.is_strokes)
    with warnings.catch_warnings():  # the title of the sheet says if up is in doubt
        warnings.simplefilter("ignore", SceneWarning)
        first_view = choose_first_view(gaussians, view, notes, report)
    report.cells = write_sheet(
        gaussians,
        first_view,
        output,
        report,
        name=name_of(scene, notes),
        view=view,
        threads=threads,
        origin=origin,
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
    origin: Origin | None = None,
) -> list[Cell]:
    """Paint and write the sheet of a scene, as one stage of a report.

    Args:
        gaussians: the scene.
        first_view: of the scene.
        output: picture to write.
        report: gets the stage.
        name: of the scene, for the title.
        view: see `PaintConfig.view` of `paint_views`.
        threads: None takes all available processors; the picture does not depend on it.
        origin: see `paint_views`.

    Returns:
        The cells of the sheet.
    """
    view = view or ViewConfig()
    others: list[Stand] = []
    if first_view.eye is not None and view.look_at is None:
        from brushgs.first_view.walk import other_stands

        with at_most(num_threads_or_default(threads)):
            others = other_stands(gaussians, first_view)
    rows = plan_sheet(first_view, view, others)
    cells = [cell for row in rows for cell in row]
    with report.stage("views", total=len(cells), unit="pictures") as stage:
        from brushgs.brushes.texture import StrokeTexture
        from brushgs.formats.pictures.images import write_frame
        from brushgs.rendering.options import RenderOptions

        kernel = StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, num_sigmas=kernel.num_sigmas, depth=False, num_threads=threads)
        pictures = {}
        for cell in cells:
            pictures[cell.row, cell.column] = _picture(gaussians, cell, options)
            report.advance()
        sheet, has_words = _lay_out(rows, pictures, _title(name, first_view))
        frame, white = Frame(sheet, np.ones(sheet.shape[:2], np.float32)), (1.0, 1.0, 1.0)
        write_frame(frame, output, background=white, shot=Shot(origin=origin))
        stage.did = f"{output}, {len(cells)} pictures in {len(rows)} rows"
        stage.counts = {"path": str(output), "pictures": len(cells), "rows": len(rows)}
        if not has_words:
            stage.skipped.append(
                "captions: this build of OpenImageIO draws no letters; --json lists the flags"
            )
    return cells


def sheet_beside(output: str | Path, name: str) -> Path:
    """The path of a painting's sheet, in the same folder; numbered frames have a folder of their own."""
    path = Path(output)
    folder = path.parent.parent if "%" in path.name else path.parent
    return folder / f"{name}-views{PICTURE_SUFFIXES[0]}"


def write_sheet_of(
    prepared: Prepared,
    output: Path,
    config: PaintConfig,
    report: Report,
    *,
    name: str,
    origin: Origin | None = None,
) -> None:
    """Write the sheet of a painted scene, prepared with its first view and the Gaussians.

    The view of the options is ignored: the sheet is for choosing one.
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
        origin=origin,
    )


def plan_sheet(first_view: FirstView, view: ViewConfig, others: "Sequence[Stand]" = ()) -> list[list[Cell]]:
    """The views of a sheet, row by row; the first is the first view, `others` from inside come next."""
    size = view.fixed_size or CELL
    view = replace(view, size=size, camera_file=None, azimuth=None, elevation=None, side=None)
    if view.up is None and in_doubt(first_view):
        rows: list[list[Cell]] = []
        for name, probability in first_view.ups[:MOST_UPS]:
            if probability < LEAST_PROBABLE and len(rows) > 1:
                break
            is_known = bool(first_view.up @ AXES[name] > 0.7)  # up may be tilted
            # With the eye the flags of these views say that they are from outside.
            seen = first_view if is_known else replace(turned(first_view, name), eye=first_view.eye)
            words = f"up is {name}: {probability:.2f}"
            says_up = not is_known or seen.eye is None  # the flag would lose the eye of a view from inside
            stands = others if is_known else ()
            rows.append(_row(len(rows), seen, view, 0.0, words, stands, with_up=says_up, is_first=is_known))
        return rows
    says_up = view.up is not None
    return [
        _row(number, first_view, view, rise, "", () if rise else others, with_up=says_up, is_first=not rise)
        for number, rise in enumerate(_rises(first_view))
    ]


def _row(
    number: int,
    seen: FirstView,
    view: ViewConfig,
    rise: float,
    note: str = "",
    others: "Sequence[Stand]" = (),
    *,
    with_up: bool,
    is_first: bool,
) -> list[Cell]:
    """One row of a sheet; `is_first` if it begins with the first view.

    The first view and `others` are from inside, all others from outside.
    """
    elevation = _raised(seen, rise)
    cells = []
    for column, azimuth in enumerate(_azimuths(seen)):
        is_this = is_first and column == 0
        config = replace(view, azimuth=azimuth, elevation=elevation)
        is_other = 0 < column <= len(others)
        if is_other:
            config = _seen_from(seen, view, others[column - 1])
        elif seen.eye is not None and not is_this and config.look_at is None:
            config = replace(config, look_at="subject")
        flags = flags_of(seen, config, with_up=with_up)
        says = [note if column == 0 else "", FIRST if is_this else "", INSIDE if is_other else ""]
        words = ", ".join(filter(None, says))
        cells.append(Cell(number, column, seen, config, flags, words))
    return cells


def _seen_from(seen: FirstView, view: ViewConfig, stand: "Stand") -> ViewConfig:
    """The options, in few digits, of a view from another position inside a scene.

    The distance of the target gives the same near plane as a view from the eye of the scene.
    """
    azimuth, elevation = (radians(round(degrees(a), 1)) for a in (stand.azimuth, stand.elevation))
    turned_view = replace(view, azimuth=azimuth, elevation=elevation)
    if seen.eye is not None and np.array_equal(stand.eye, seen.eye):
        return turned_view
    size = float(np.linalg.norm(np.ptp(seen.points, axis=0)))
    digits = DIGITS - 1 - int(np.floor(np.log10(max(size, 1e-300))))
    distance = round(INSIDE_NEAR_SHARE / NEAR_SHARE * size, digits)
    point = stand.eye + distance * camera_axes(seen.up, azimuth, elevation)[2]
    x, y, z = (round(float(number), digits) for number in point)
    return replace(turned_view, look_at=(x, y, z), distance=distance)


def _raised(seen: FirstView, rise: float) -> float:
    """The elevation of a row, radians."""
    if not rise:
        return seen.elevation
    return radians(round(min(max(degrees(seen.elevation) + rise, LOWEST), HIGHEST), 1))


def _rises(seen: FirstView) -> list[float]:
    """`RISES`, with elevations far from all photographers last."""
    stood = None if seen.stood is None else seen.stood[:, 1]
    return sorted(RISES, key=lambda rise: _is_strange(_raised(seen, rise), stood, STOOD_WITHIN))


def _azimuths(seen: FirstView) -> list[float]:
    """The azimuth of each column, radians, from that of the first view, far from all photographers last."""
    turns = (360 / NUM_AZIMUTHS * column for column in range(1, NUM_AZIMUTHS))
    others = [radians(round((degrees(seen.azimuth) + turn) % 360, 1)) for turn in turns]
    stood = None if seen.stood is None else seen.stood[:, 0]
    others.sort(key=lambda azimuth: _is_strange(azimuth, stood, 180 / NUM_AZIMUTHS))
    return [seen.azimuth, *others]


def _is_strange(angle: float, stood: F64 | None, reach: float) -> bool:
    """Whether an angle is known to be further than `reach` from all photographers."""
    if stood is None:
        return False
    away = np.abs((stood - angle + np.pi) % (2 * np.pi) - np.pi)
    return bool(away.min() > radians(reach))


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
            flags, place = cell.flags, ""
            if cell.config.distance is not None:  # too long for one line
                flags, look_at, place = cell.flags.partition("--look-at")
                place = look_at + place
            words.append(Words(flags, left, top + height + 15, 12, INK))
            words.append(Words(place or cell.note, left, top + height + 30, 12, INK if place else ACCENT))
    drawn = with_words(sheet, words)
    return (sheet, False) if drawn is None else (drawn, True)
