"""What strokes that see gain: likeness and seconds with and without them, each measure, and equal seconds.

    python -m examples.benchmarks.strokes [SCENE ...] [--arms ARM ...] [--json FOLDER] [--page FILE]
                                          [--repeats 3]

Strokes are made by `brushgs.pipeline.prepare`, as the commands make them, for one picture of 800 x 600. The
arms: "off" has no pass that sees and draws strokes alone, "on" is the default of the command, "no X" leaves
out one measure X of "on" (seen weights, splits and seen colors are the three parts of "views"), and "off N"
are N strokes of "off", for what it would take to reach "on" without.
Each is compared on white with the plain picture of the scene without floaters:
- at 0, 25 and 160 degrees from the picture, the last two 2 degrees higher;
- on a ring of 8 views that no pass has used, 400 x 300, mean of the PSNRs: 22, 67, 112 ... degrees, 4 higher.
"Unpainted" is the share of the plain picture's alpha that stays unpainted at 0 degrees. Seconds are those of
the stages from pruning on, median of the repeats, and of one frame, median of 7.

The rows of a scene are kept in FOLDER/SCENE.json; arms that are not asked for stay as they are there, and
--arms alone measures nothing. FILE gets the tables between its marks: <!-- likeness --> and so on.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import cache, partial
from itertools import pairwise
from math import log, radians
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import numpy as np

import brushgs as bg
from brushgs.cameras.first_view import framed_camera, framing
from brushgs.measure.likeness import psnr, ssim, unpainted
from brushgs.options.direction import Direction
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.passes.reduce.cluster import cluster_weights
from brushgs.passes.seen import Seen, seen_in
from brushgs.pipeline.drawing import render_options
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.still_life import still_life
from brushgs.values.camera import FirstView
from examples.benchmarks.curves import placed
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present

WHITE = (1.0, 1.0, 1.0)
SIZE, RING_SIZE = (800, 600), (400, 300)
TESTS = ((0.0, 0.0), (25.0, 2.0), (160.0, 2.0))  # degrees from the picture: azimuth, elevation
RING = tuple((22.0 + 45.0 * k, 4.0) for k in range(8))
MAX_ELEVATION = radians(85.0)
BRUSHES = ("flat", "swirl")
COUNTS = (2000, 6000)
LADDER = (3000, 4000, 8000, 12000, 16000, 24000, 32000, 48000)  # of "off", beside the counts
BEFORE_STROKES = {"stroke", "load", "clean", "first view", "camera", "background"}  # stages
FRAMES = 7  # of which the median time is taken
# The upper third of the subject, magnified, would be the chest: up by 0.62 pictures is the face.
FACE = ViewConfig(size=SIZE, look_at="part", zoom=3.0, pan=(0.03, 0.62))


@dataclass(frozen=True)
class Scene:
    """A scene, its picture and the counts of its strokes."""

    file: str | None  # None: the example scene
    counts: tuple[int, ...] = COUNTS
    view: ViewConfig = field(default_factory=lambda: ViewConfig(size=SIZE))

    def source(self) -> Any:
        return _still_life() if self.file is None else FOLDER / self.file


SCENES = {
    "koala": Scene("koala.ply"),
    "truck": Scene("truck.splat"),
    "skull": Scene("skull.sog"),
    "biker": Scene("biker.compressed.ply"),
    "face": Scene("biker.compressed.ply", (2000, 4000), FACE),
    "chair": Scene("chair.splat"),
    "campsite": Scene("campsite_sog"),
    "playbot": Scene("playbot_sog"),
    "still life": Scene(None),
}
FILES = {name: scene.file for name, scene in SCENES.items()}


@cache
def _still_life() -> bg.Gaussians:
    return still_life(60_000)


# -- arms --------------------------------------------------------------------------------------------------

OFF: dict[str, dict[str, Any]] = {  # the options of a painting that leave a measure out
    "views": {"see": "off"},
    "solid paint": {"solid": False},
    "direction": {"direction": Direction("own")},
    "broken color": {"broken_color": 0.0},
    "underpaint": {"underpaint": False},
    "streaks": {"streaks": 0.0},
}
ALL_OFF = {name: value for options in OFF.values() for name, value in options.items()}


def _own_colors(gaussians: bg.Gaussians, views: Any) -> Seen | None:
    """`seen_in`, the Gaussians in their own colors."""
    seen = seen_in(gaussians, views)
    return None if seen is None else replace(seen, gaussians=gaussians)


# Parts of "views", which have no switch: names in the package, and what stands in their place.
PATCHED: dict[str, dict[str, Any]] = {
    "seen weights": {"brushgs.passes.seen.Seen.weights": lambda seen, focus: cluster_weights(seen.gaussians)},
    "splits": {"brushgs.passes.reduce.cluster.FIRST_SHARE": 1.0},
    "seen colors": {
        "brushgs.passes.reduce.cluster.seen_in": _own_colors,
        "brushgs.passes.color.repaint.repaint": lambda strokes, *_, **__: strokes,
    },
}
MEASURES = ["views", *PATCHED, *(name for name in OFF if name != "views")]


def painting(arm: str, scene: Scene, count: int) -> PaintConfig:
    """What the command would be told for an arm."""
    values = ALL_OFF if arm.startswith("off") else OFF.get(arm.removeprefix("no "), {})
    paint = PaintConfig(cluster=ClusterConfig(count), view=scene.view, draw=DrawConfig(stroke=BRUSHES[0]))
    for part in ("strokes", "draw"):
        config = getattr(paint, part)
        own = {name: value for name, value in values.items() if hasattr(config, name)}
        paint = replace(paint, **{part: replace(config, **own)})
    return paint


@contextmanager
def patched(arm: str) -> Iterator[None]:
    """With a part of the program replaced, if the arm has one."""
    with ExitStack() as stack:
        for target, value in PATCHED.get(arm.removeprefix("no "), {}).items():
            stack.enter_context(patch(target, value))
        yield


def arms_of(scene: Scene) -> list[str]:
    """All arms, those of every count first."""
    ladder = [f"off {count}" for count in sorted({*LADDER} - {*scene.counts})]
    return ["off", "on", *ladder, *(f"no {name}" for name in MEASURES)]


def counts_of(arm: str, scene: Scene) -> Sequence[int]:
    """The counts that an arm is measured with: all of them, its own, or the largest."""
    if arm in ("off", "on"):
        return scene.counts
    return scene.counts[-1:] if arm.startswith("no ") else (int(arm.split()[1]),)


# -- measuring ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Row:
    """One arm with one brush: how near it comes, and what it costs."""

    arm: str
    count: int  # of strokes asked for
    made: int
    brush: str
    psnr: list[float]  # dB at 0, 25 and 160 degrees
    ssim: list[float]
    ring_psnr: float
    ring_ssim: float
    unpainted: float  # share, 0 to 1
    seconds: dict[str, float]  # by stage, from pruning on
    frame_seconds: float

    @property
    def total(self) -> float:
        return sum(self.seconds.values()) + self.frame_seconds


class Truth:
    """The views of a scene and its plain pictures."""

    def __init__(self, prepared: Prepared, view: ViewConfig) -> None:
        first_view = prepared.known_view
        self.cameras = [turned(first_view, view, SIZE, *place) for place in TESTS]
        # Of a part, too, the ring shows the whole subject.
        whole = replace(view, look_at=None, zoom=1.0, pan=(0.0, 0.0))
        self.ring = [turned(first_view, whole, RING_SIZE, *place) for place in RING]
        kernel = bg.StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, depth=False)
        self.frames, self.ring_frames = (
            [render_with(prepared.whole_scene, camera, kernel, options) for camera in cameras]
            for cameras in (self.cameras, self.ring)
        )

    def judge(self, paint: Callable[[bg.Camera], bg.Frame]) -> dict[str, Any]:
        """The figures of likeness of a row."""
        frames = [paint(camera) for camera in self.cameras]
        near = [_likeness(frame, plain) for frame, plain in zip(frames, self.frames, strict=True)]
        ring = [_likeness(paint(c), plain) for c, plain in zip(self.ring, self.ring_frames, strict=True)]
        psnrs, ssims = zip(*near, strict=True)
        return {
            "psnr": list(psnrs),
            "ssim": list(ssims),
            "ring_psnr": float(np.mean([p for p, _ in ring])),
            "ring_ssim": float(np.mean([s for _, s in ring])),
            "unpainted": unpainted(frames[0].alpha, self.frames[0].alpha),
        }


def turned(
    first_view: FirstView, view: ViewConfig, size: tuple[int, int], azimuth: float, elevation: float
) -> bg.Camera:
    """The camera of a picture, turned by so many degrees; the picture's own where both are 0."""
    given = framing(first_view, view)
    raised = min(max(given["elevation"] + radians(elevation), -MAX_ELEVATION), MAX_ELEVATION)
    place = {"azimuth": given["azimuth"] + radians(azimuth), "elevation": raised}
    if azimuth == elevation == 0:
        place = {}
    return framed_camera(first_view, replace(view, size=size, **place))


def _likeness(frame: bg.Frame, plain: bg.Frame) -> tuple[float, float]:
    picture, truth = (np.clip(f.over(WHITE), 0, 1) for f in (frame, plain))
    return psnr(picture, truth), ssim(picture, truth)


def prepared_by(scene: Scene, paint: PaintConfig) -> tuple[Prepared, dict[str, float]]:
    """The strokes of a painting, and the seconds of each stage that makes them."""
    report = Report()
    prepared = prepare(scene.source(), paint, report, asks=(*PICTURE, "first_view", "scene"))
    seconds: dict[str, float] = {}
    for stage in report.stages:
        if stage.name not in BEFORE_STROKES:
            seconds[stage.name] = seconds.get(stage.name, 0.0) + stage.seconds
    return prepared, seconds


@dataclass
class Work:
    """One arm at one count: what is measured of it."""

    arm: str
    count: int
    prepared: Prepared | None = None
    seconds: list[dict[str, float]] = field(default_factory=list)

    def prepare(self, scene: Scene) -> Prepared:
        """Make the strokes once more."""
        with patched(self.arm):
            self.prepared, seconds = prepared_by(scene, painting(self.arm, scene, self.count))
        self.seconds.append(seconds)
        return self.prepared


def measure(
    scene: Scene, arms: Sequence[str], repeats: int, brushes: Sequence[str] = BRUSHES
) -> Iterator[Row]:
    """One row per arm, count and brush. Strokes do not depend on the brush."""
    works = [Work(arm, count) for arm in arms for count in counts_of(arm, scene)]
    truth = None
    for _ in range(repeats):
        for work in works:  # in turns: the machine is not equally fast at all times
            prepared = work.prepare(scene)
            truth = truth or Truth(prepared, scene.view)
    assert truth is not None
    drawn = [(work, brush, _drawing(work, scene, brush)) for work in works for brush in brushes]
    frames: dict[tuple[int, str], list[float]] = {}
    for _ in range(FRAMES):
        for work, brush, draw in drawn:
            frames.setdefault((id(work), brush), []).append(_seconds(partial(draw, truth.cameras[0])))
    for work, brush, draw in drawn:
        assert work.prepared is not None
        seconds = {name: median(run[name] for run in work.seconds) for name in work.seconds[0]}
        yield Row(
            work.arm,
            work.count,
            len(work.prepared.strokes),
            brush,
            **truth.judge(draw),
            seconds=seconds,
            frame_seconds=median(frames[id(work), brush]),
        )


def _drawing(work: Work, scene: Scene, brush: str) -> Callable[[bg.Camera], bg.Frame]:
    """What paints the strokes of an arm with a brush."""
    assert work.prepared is not None
    strokes, texture = work.prepared.strokes, bg.StrokeTexture.open(brush)
    draw = replace(painting(work.arm, scene, work.count).draw, stroke=brush)
    options = render_options(draw, texture, along_path=False)
    return lambda camera: render_with(strokes, camera, texture, options)


def _seconds(run: Callable[[], object]) -> float:
    begun = time.perf_counter()
    run()
    return time.perf_counter() - begun


# -- tables ------------------------------------------------------------------------------------------------

Rows = dict[str, list[Row]]  # by scene


def row_of(rows: list[Row], arm: str, count: int, brush: str) -> Row | None:
    return next((r for r in rows if (r.arm, r.count, r.brush) == (arm, count, brush)), None)


def pairs(found: Rows) -> Iterator[tuple[str, Row, Row]]:
    """Scene, off and on, at equal strokes with one brush."""
    for name, rows in found.items():
        for count in SCENES[name].counts:
            for brush in BRUSHES:
                off, on = (row_of(rows, arm, count, brush) for arm in ("off", "on"))
                if off and on:
                    yield name, off, on


def likeness_table(found: Rows) -> list[list[str]]:
    head = "scene, strokes, brush, 0°, 25°, 160°, ring, SSIM 0°, SSIM ring, unpainted"
    table = [head.split(", ")]
    for name, off, on in pairs(found):
        cells = [f"{a:.1f} -> {b:.1f}" for a, b in zip(off.psnr, on.psnr, strict=True)]
        cells += [f"{off.ring_psnr:.1f} -> {on.ring_psnr:.1f}"]
        cells += [f"{off.ssim[0]:.3f} -> {on.ssim[0]:.3f}", f"{off.ring_ssim:.3f} -> {on.ring_ssim:.3f}"]
        cells += [f"{off.unpainted:.1%} -> {on.unpainted:.1%}"]
        table.append([name, f"{on.count:,}", on.brush, *cells])
    return table


def seconds_table(found: Rows) -> list[list[str]]:
    """Every stage of "on", and both totals."""
    shown = [(name, off, on) for name, off, on in pairs(found) if on.brush == BRUSHES[0]]
    stages = list(dict.fromkeys(stage for _, _, on in shown for stage in on.seconds))
    table = [["scene", "strokes", *stages, "all", "off: prune + cluster", "ratio", "frame, ms"]]
    for name, off, on in shown:
        cells = [f"{on.seconds.get(stage, 0):.2f}" for stage in stages]
        whole, before = sum(on.seconds.values()), sum(off.seconds.values())
        frames = f"{1000 * off.frame_seconds:.0f} -> {1000 * on.frame_seconds:.0f}"
        cells += [f"{whole:.2f}", f"{before:.2f}", f"{whole / before:.2f}", frames]
        table.append([name, f"{on.count:,}", *cells])
    return table


def equal_table(found: Rows) -> list[list[str]]:
    """What "off" would need to come as near, and how near it comes in as much time."""
    head = "scene, strokes, on: 0°; ring, off takes for 0°, for the ring, off in equal seconds, 0°; ring"
    table = [head.split(", ")]
    for name, _, on in pairs(found):
        if on.brush != BRUSHES[0]:
            continue
        ladder = [row for row in found[name] if row.arm.startswith("off") and row.brush == on.brush]
        ladder.sort(key=lambda row: row.count)
        cells = [_both(on), _reach(ladder, lambda row: row.psnr[0], on.psnr[0])]
        cells += [_reach(ladder, lambda row: row.ring_psnr, on.ring_psnr)]
        row = max((row for row in ladder if row.total <= on.total), key=lambda row: row.count, default=None)
        cells += ["-", "-"] if row is None else [f"{row.made:,}", _both(row)]
        table.append([name, f"{on.count:,}", *cells])
    return table


def _both(row: Row) -> str:
    """Its PSNR at 0 degrees and on the ring."""
    return f"{row.psnr[0]:.1f}; {row.ring_psnr:.1f}"


def _reach(ladder: list[Row], figure: Callable[[Row], float], wanted: float) -> str:
    """The count at which a figure is reached, between two counts by its logarithm."""
    if figure(ladder[0]) >= wanted:
        return f"at most {ladder[0].count:,}"
    for low, high in pairwise(ladder):
        if figure(high) >= wanted:
            share = (wanted - figure(low)) / (figure(high) - figure(low))
            count = np.exp(log(low.count) + share * log(high.count / low.count))
            return f"{float(f'{count:.2g}'):,.0f}"
    return f"above {ladder[-1].count:,}"


def ablation_table(found: Rows) -> list[list[str]]:
    """The change of PSNR at 0 degrees and on the ring by leaving out one measure."""
    table = [["scene", "strokes", "brush", "on: 0°; ring", *(f"no {name}" for name in MEASURES)]]
    for name, _, on in pairs(found):
        if on.count != SCENES[name].counts[-1]:
            continue
        cells = [_both(on)]
        for measure in MEASURES:
            row = row_of(found[name], f"no {measure}", on.count, on.brush)
            if row is None:
                cells.append("-")
                continue
            cells.append(f"{row.psnr[0] - on.psnr[0]:+.1f}; {row.ring_psnr - on.ring_psnr:+.1f}")
        table.append([name, f"{on.count:,}", on.brush, *cells])
    return table


def markdown(table: list[list[str]]) -> str:
    rows = ["| " + " | ".join(cells) + " |" for cells in table]
    return "\n".join([rows[0], "|" + "---|" * len(table[0]), *rows[1:]])


TABLES = {
    "likeness": likeness_table,
    "seconds": seconds_table,
    "equal": equal_table,
    "ablation": ablation_table,
}


# -- files -------------------------------------------------------------------------------------------------


def read_rows(folder: Path | None, name: str) -> list[Row]:
    path = None if folder is None else folder / f"{name}.json"
    return [Row(**row) for row in json.loads(path.read_text())] if path and path.exists() else []


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], metavar="SCENE")
    parser.add_argument("--arms", nargs="*", help='such as on, off, "no solid", "off 8000"; default all')
    parser.add_argument("--json", type=Path, help="folder of the rows")
    parser.add_argument("--page", type=Path, help="gets the tables")
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    print(describe(), flush=True)
    found: Rows = {}
    for name in present(asked.scenes or SCENES, FILES):
        scene = SCENES[name]
        found[name] = read_rows(asked.json, name)
        arms = arms_of(scene) if asked.arms is None else asked.arms
        for row in measure(scene, arms, asked.repeats) if arms else ():
            place = row.arm, row.count, row.brush
            found[name] = [*(r for r in found[name] if (r.arm, r.count, r.brush) != place), row]
            print(tell(name, row), flush=True)
        if asked.json:
            asked.json.mkdir(parents=True, exist_ok=True)
            text = json.dumps([asdict(row) for row in found[name]], indent=1)
            (asked.json / f"{name}.json").write_text(text + "\n")
    for title, make in TABLES.items():
        table = markdown(make(found))
        print(f"\n{table}")
        if asked.page:
            asked.page.write_text(placed(asked.page.read_text(), title, table))


def tell(name: str, row: Row) -> str:
    near = " ".join(f"{value:5.2f}" for value in row.psnr)
    stages = " ".join(f"{stage} {seconds:.2f}" for stage, seconds in row.seconds.items())
    return (
        f"{name:10} {row.arm:16} {row.made:6} {row.brush:6} {near} ring {row.ring_psnr:5.2f} "
        f"unpainted {row.unpainted:5.1%} frame {1000 * row.frame_seconds:4.0f} ms; {stages}"
    )


if __name__ == "__main__":
    main()
