"""`brushgs bench --peers`: all peers on one scene, as table, JSON and plot.

1. **Views.** The first view of the scene, and a film of ten frames on an orbit of 480 (0.75 degrees a frame).
2. **Turns.** Each peer paints the still in some rounds, in a process of its own; every other round goes the
   other way through the list. Seconds are medians: from the start of the process until the picture is here,
   so with what Python takes to start and with the scene file. Memory is the most over the rounds.
3. **The film** is painted once, in a process of its own, for errors between frames and flips.
4. **Pictures** have 8 bits a channel, as files have. Subject, histogram, structure and range: see `columns`.
"""

from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, ClassVar

import numpy as np

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.measure.bench.run import describe_machine
from brushgs.measure.report import ExperimentReport, plain_camera
from brushgs.measure.warp import View
from brushgs.options.painting import CleanConfig, PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.colors import flatten
from examples.benchmarks.peers import columns
from examples.benchmarks.peers.figures import COLUMNS, SCHEMA, Peers, Row, cells, reasons
from examples.benchmarks.peers.original import check_checkout, paint_original
from examples.benchmarks.peers.plot import write_plot
from examples.benchmarks.peers.registry import PEERS, PLAIN, Peer
from examples.benchmarks.peers.task import ORBIT, Task, on_white
from examples.benchmarks.peers.work import Painted, in_own_process
from tests.kit.paintings import write as write_paintings

if TYPE_CHECKING:
    from rich.console import Console

NUM_FRAMES = 10  # of the film: three pairs at the long range
SHORT, LONG = 1, 7  # frames between pictures
OWN_STYLE = "night"  # of the project's own paintings, where no other is named
ORIGINAL = "Im2Oil, original"
NO_STROKES = "it lays no strokes"
NOT_LASTING = "its strokes are others in each picture, so none can be followed"
ONE_PICTURE = "it was run on one picture"
UNSEEN = "no two frames show the same surface"


@dataclass
class PeersReport(ExperimentReport):
    """The stages of a run and its figures: `result` is a `Peers`."""

    name: ClassVar[str] = "peers"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """One table for each number of strokes, and why there are dashes."""
        from rich.box import SIMPLE_HEAD
        from rich.table import Table

        found = self.result.as_dict()
        for count in self.result.rows:
            table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
            table.add_column(f"{count:,} strokes")
            for column in COLUMNS:
                table.add_column(column, justify="right")
            rows = [row for row in found["rows"] if row["asked"] == count]
            for row in rows:
                table.add_row(*cells(row))
            console.print(table, markup=False)
        for reason in reasons(found["rows"]):
            console.print(reason, markup=False, soft_wrap=True)


@dataclass(frozen=True)
class Ask:
    """What is measured.

    Attributes:
        view: of the first picture.
        strokes: numbers that each peer may lay.
        style: a painting; those beside it in its folder are what it is ranked among. None for the project's.
        im2oil: a checkout of the original; None to leave it out.
        rounds: of stills.
        names: of the peers that paint; the plain scene always does.
    """

    view: ViewConfig
    strokes: tuple[int, ...] = (2000,)
    style: Path | None = None
    im2oil: Path | None = None
    rounds: int = 3
    names: tuple[str, ...] = tuple(PEERS)


def report_peers(
    scene: SceneSource | None,
    output: Path,
    ask: Ask,
    *,
    report: PeersReport,
    wants_plot: bool = True,
) -> PeersReport:
    """Measure, and write the figures.

    Args:
        scene: the files of a scene; None for the example scene.
        output: a folder, or one file that ends in .json or .png.
        ask: see `Ask`.
        report: gets stages and figures.
        wants_plot: whether a folder gets the plot.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene.
    """
    inputs = () if scene is None else scene.paths
    outputs = report.plan_outputs(
        output, (*inputs, *([ask.style] if ask.style else ())), wants_plot=wants_plot
    )
    if ask.im2oil is not None:
        check_checkout(ask.im2oil)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        paintings, own = paintings_of(ask.style, folder)
        name = "still life" if scene is None else scene.name
        source = scene or _still_life(folder)
        cameras = cameras_of(source, ask.view)
        task = Task(source, ask.view, cameras, 1, str(paintings[own]))
        rows = {count: _measure(task, count, paintings, own, ask, report) for count in ask.strokes}
        report.settings = {
            "machine": describe_machine(),
            "camera": plain_camera(cameras[0]),
            "frames": NUM_FRAMES,
            "degrees": 360 / ORBIT,
            "rounds": ask.rounds,
            "gaussians": len(task.scene),
        }
    report.result = Peers(name, own, tuple(paintings), rows)
    report.output = str(output)
    report.write(outputs, lambda file: write_plot(report.result, file))
    return report


def paintings_of(style: Path | None, folder: Path) -> tuple[dict[str, Path], str]:
    """Paintings by name, and the name of the style; without one the project's own, written to a folder."""
    if style is None:
        return write_paintings(folder / "paintings"), OWN_STYLE
    read_image(style)  # what cannot be read is told of before any painting
    files = sorted(each for each in style.parent.iterdir() if each.suffix.lower() in PICTURE_SUFFIXES)
    return {each.stem: each for each in files} | {style.stem: style}, style.stem


def _still_life(folder: Path) -> SceneSource:
    file = folder / "still_life.ply"
    bg.save(still_life(), file)
    return SceneSource((file,))


def cameras_of(source: SceneSource, view: ViewConfig) -> tuple[Camera, ...]:
    """The views of the film; the first is that of the still."""
    config = PaintConfig(view=view, clean=CleanConfig("off"))
    found = prepare(source, config, Report(), views=PathConfig(orbit=ORBIT), asks=("path",)).path
    assert found is not None
    return tuple(found.cameras[:NUM_FRAMES])


def _measure(
    task: Task, count: int, paintings: dict[str, Path], own: str, ask: Ask, report: PeersReport
) -> list[Row]:
    """The rows of one number of strokes."""
    names = [PLAIN, *(name for name in ask.names if name != PLAIN)]
    film = replace(task, strokes=count)
    still = replace(film, cameras=film.cameras[:1])
    stills: dict[str, list[Painted]] = {name: [] for name in names}
    films: dict[str, Painted] = {}
    with report.stage("paint", total=len(names) * (ask.rounds + 1)) as stage:
        for number in range(ask.rounds):
            for name in names if number % 2 == 0 else names[::-1]:
                stills[name].append(in_own_process(name, still))
                report.advance()
        for name in names:
            films[name] = in_own_process(name, film)
            report.advance()
        stage.did = f"{len(names)} peers, {count:,} strokes, {ask.rounds} rounds"
    meter = Meter(task, paintings, own)
    rows = [_row(meter, name, PEERS[name], stills[name], films[name]) for name in names]
    if ask.im2oil is not None:
        painted = paint_original(ask.im2oil, task.plain(0))
        row = Row(ORIGINAL, f"the program of {ask.im2oil.name}", strokes=painted.strokes)
        row.seconds, row.processor = painted.seconds, painted.processor
        row.memory_mb = painted.memory_mb
        row.why = dict.fromkeys(("short_range", "long_range", "flips"), ONE_PICTURE)
        meter.compare(row, painted)
        rows.append(row)
    return rows


def _row(meter: "Meter", name: str, peer: Peer, stills: list[Painted], film: Painted) -> Row:
    row = Row(name, peer.note, weights_mb=peer.weights_mb, photographs=peer.photographs)
    row.strokes, row.flips = stills[0].strokes, film.flips
    row.seconds = median(painted.seconds for painted in stills)
    row.processor = median(painted.processor for painted in stills)
    row.memory_mb = max((painted.memory_mb for painted in stills if painted.memory_mb), default=None)
    if row.strokes is None:
        row.why["strokes"] = row.why["flips"] = NO_STROKES
    elif row.flips is None:
        row.why["flips"] = NOT_LASTING
    meter.compare(row, stills[0])
    meter.follow(row, film)
    return row


class Meter:
    """Compares pictures with the plain scene and with the paintings."""

    def __init__(self, task: Task, paintings: dict[str, Path], own: str) -> None:
        frames = [task.plain_frame(index) for index in range(len(task.cameras))]
        self._plain, self._alpha = on_white(frames[0]), frames[0].alpha
        self._views = []
        for frame, camera in zip(frames, task.cameras, strict=True):
            assert frame.depth is not None
            self._views.append(View(on_white(frame), frame.depth, frame.alpha, camera))
        pixels = {name: flatten(read_image(path)[..., :3]) for name, path in paintings.items()}
        self._structures: dict[str, list[F64]] = {
            name: columns.structure(each) for name, each in pixels.items()
        }
        self._histogram, self._own = columns.color_histogram(pixels[own]), own

    def compare(self, row: Row, painted: Painted) -> None:
        """The figures of a still."""
        picture = _values(painted.pictures[0])
        if row.peer == PLAIN:
            row.why["psnr"] = row.why["ssim"] = "all others are compared with it"
        else:
            row.psnr, row.ssim = columns.nearness(picture, self._plain, self._alpha)
        row.histogram = columns.histogram_loss(columns.color_histogram(picture), self._histogram)
        found = columns.structure(picture)
        row.structure = columns.structure_distance(found, self._structures[self._own])
        row.rank = columns.blind_rank(found, self._structures, self._own)

    def follow(self, row: Row, painted: Painted) -> None:
        """The figures of a film."""
        pictures = [_values(each) for each in painted.pictures]
        row.short_range, row.long_range = (
            columns.range_error(pictures, self._views, gap) for gap in (SHORT, LONG)
        )
        for name in ("short_range", "long_range"):
            if getattr(row, name) is None:
                row.why[name] = UNSEEN


def _values(eight_bits: Array) -> Array:
    return np.asarray(eight_bits / np.float32(255), np.float32)
