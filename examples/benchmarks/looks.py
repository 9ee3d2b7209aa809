"""What looks cost and how near they come to the scene: likeness, seconds, memory, parts of a frame, orbits.

    python -m examples.benchmarks.looks [SCENE ...] [--tables NAME ...] [--json FILE] [--page FILE]

Paintings are those that `brushgs render` makes, 1280 x 720; plain has 6000 strokes here, as oil has.
- likeness: PSNR in dB and SSIM of the painting without broken color, relief and canvas to the plain picture
  of the scene on the same ground and backdrop; those of one color are compared in grey.
- seconds: of the stages and of a frame (median of 5), and the peak memory of a process that paints it;
  of koala.
- parts: a frame of oil with one part left out, medians of 15 rounds in which all take turns.
- orbits: 12 frames of an orbit of 240, tracked: flips, spins, strokes whose brush changes, and flicker at a
  step of one frame over that of the plain picture, of 255: of the look, of the look without canvas (at rest
  in the picture, it counts as flicker where the subject moves), of the same strokes flat, and of frames that
  are lit as stills are.

Likeness and seconds are kept in the JSON file; scenes that are not asked for stay as they are there.
"""

import argparse
import json
import multiprocessing
import re
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import brushgs as bg
from brushgs.measure.box_events import orientation_events
from brushgs.measure.likeness import psnr, ssim
from brushgs.measure.warp import View
from brushgs.options.choices import LOOKS, PLAIN_LOOK
from brushgs.options.look import Look
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_view
from brushgs.rendering.canvas import Painting
from brushgs.rendering.track import track_directions
from brushgs.values.arrays import Array
from examples.benchmarks.curves import placed
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import present
from examples.benchmarks.strokes import FILES, SCENES, markdown
from tests.measure.warped import warp_error

SIZE = 1280, 720
FACE = ViewConfig(size=SIZE, look_at="part", zoom=1.9, pan=(0.0, 0.1))
PICKED = "koala", "truck", "skull", "chair", "biker", "face", "campsite", "still life"
TIMED = ("koala",)
GREY = tuple(look for look in LOOKS if Look.open(look).config.media.has_own_color)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
ORBIT, NUM_FRAMES = 240, 12
PARTS: dict[str, dict[str, dict[str, Any]]] = {
    "oil": {},
    "no lamp": {"light": {"relief": 0.0}},
    "no canvas": {"light": {"canvas": "none"}},
    "no backdrop": {"ground": {"backdrop": 0}},
    "one brush": {"draw": {"stroke": "flat"}},
    "strokes alone": {
        "light": {"relief": 0.0, "canvas": "none"},
        "ground": {"ground": "none", "backdrop": 0},
    },
}


def config_of(look: str, scene: str, **changes: dict[str, Any]) -> PaintConfig:
    """What the command would be told."""
    config = Look.open(look).config
    config = replace(config, ground=replace(config.ground, stage=False))
    config = replace(config, view=FACE if scene == "face" else ViewConfig(size=SIZE))
    if look == PLAIN_LOOK:
        config = replace(config, cluster=replace(config.cluster, strokes=6000))
    for step, values in changes.items():
        if "stroke" in values:
            config = replace(config, brushes=BrushesConfig())
        config = replace(config, **{step: replace(getattr(config, step), **values)})
    return config


def prepared(look: str, scene: str, report: Report | None = None, **changes: dict[str, Any]) -> Prepared:
    config = config_of(look, scene, **changes)
    return prepare(SCENES[scene].source(), config, report or Report(), asks=(*PICTURE, "scene"))


def frame_seconds(found: Prepared, repeats: int = 5) -> float:
    """The median of some frames, after one that fills the caches."""
    painting, seconds = found.painting.with_depth(False), []
    for _ in range(repeats + 1):
        start = time.perf_counter()
        painting.frame(found.camera)
        seconds.append(time.perf_counter() - start)
    return median(seconds[1:])


# -- likeness and seconds ----------------------------------------------------------------------------------


def row_of(look: str, scene: str) -> dict[str, Any]:
    """All figures of one painting."""
    report = Report()
    start = time.perf_counter()
    found = prepared(look, scene, report)
    paint_view(found, report)
    seconds = time.perf_counter() - start
    memory = peak_memory()
    near = likeness(look, scene)
    return {
        "scene": scene,
        "look": look,
        "strokes": len(found.strokes),
        "psnr": near[0],
        "ssim": near[1],
        "seconds": seconds,
        "frame": frame_seconds(found),
        "memory": memory,
        "stages": {stage.name: stage.seconds for stage in report.stages},
    }


def peak_memory() -> float:
    """MB of this process alone; `getrusage` would count what its parent had."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return int(found[1]) / 1024


def likeness(look: str, scene: str) -> tuple[float, float]:
    """PSNR and SSIM before broken color and relief."""
    bare = {"strokes": {"broken_color": 0.0}, "light": {"relief": 0.0, "canvas": "none"}}
    found = prepared(look, scene, **bare)
    painting, camera = found.painting, found.camera
    assert found.scene is not None
    plain = bg.render(found.scene, camera, "gaussian", depth=False)
    behind = replace(painting, coats=tuple(coat for coat in painting.coats if coat.name == BACKDROP))
    ground = behind.frame(camera).over((1, 1, 1))
    pictures = [painting.frame(camera).over((1, 1, 1)), plain.over(ground)]
    if look in GREY:
        pictures = [np.repeat((picture @ LUMINANCE)[..., None], 3, axis=2) for picture in pictures]
    picture, truth = (np.clip(each, 0, 1) for each in pictures)
    return psnr(picture, truth), ssim(picture, truth)


def rows(scenes: list[str]) -> Iterator[dict[str, Any]]:
    """The row of every painting, each measured in a process of its own, for its memory."""
    spawn = multiprocessing.get_context("spawn")
    for scene in scenes:
        for look in LOOKS:
            with spawn.Pool(1) as pool:
                row = pool.apply(row_of, (look, scene))
            print(json.dumps(row), flush=True)
            yield row


def likeness_table(found: list[dict[str, Any]]) -> list[list[str]]:
    table = [["scene", *LOOKS]]
    for scene in dict.fromkeys(row["scene"] for row in found):
        own = {row["look"]: row for row in found if row["scene"] == scene}
        table.append([scene, *(f"{own[look]['psnr']:.1f}; {own[look]['ssim']:.2f}" for look in LOOKS)])
    return table


def seconds_table(found: list[dict[str, Any]]) -> list[list[str]]:
    parts = "ground", "color", "pigments", "brushes", "backdrop", "lines", "light"
    table = [["look", "strokes", "all, s", *(f"{part}, s" for part in parts), "a frame, ms", "memory, MB"]]
    for look in LOOKS:
        own = [row for row in found if row["look"] == look and row["scene"] in TIMED]
        if not own:
            continue

        def middle(of: Any, own: list[dict[str, Any]] = own) -> float:
            return median(of(row) for row in own)

        stages = (middle(lambda row, part=part: row["stages"].get(part, 0.0)) for part in parts)
        table.append(
            [
                look,
                f"{middle(lambda row: row['strokes']):,.0f}",
                f"{middle(lambda row: row['seconds']):.2f}",
                *(f"{each:.3f}" if each else "-" for each in stages),
                f"{1000 * middle(lambda row: row['frame']):.0f}",
                f"{max(row['memory'] for row in own):.0f}",
            ]
        )
    return table


# -- parts of a frame --------------------------------------------------------------------------------------


def parts_table(scenes: list[str]) -> list[list[str]]:
    """Milliseconds of a frame, and how much longer oil takes."""
    table = [["scene", *PARTS]]
    for scene in scenes:
        found = {part: prepared("oil", scene, **changes) for part, changes in PARTS.items()}
        seconds: dict[str, list[float]] = {part: [] for part in found}
        for part in found:
            found[part].painting.frame(found[part].camera)
        for _ in range(15):
            for part, each in found.items():
                seconds[part].append(frame_seconds(each, 1))
        cells = []
        for part, each in seconds.items():
            ratio = median(whole / own for whole, own in zip(seconds["oil"], each, strict=True))
            cells.append(f"{1000 * median(each):.0f}" + ("" if part == "oil" else f" ({ratio:.2f})"))
        table.append([scene, *cells])
        print(table[-1], flush=True)
    return table


# -- orbits ------------------------------------------------------------------------------------------------


def orbit_row(look: str, scene: str) -> list[str]:
    """Events and flicker of a part of an orbit."""
    found = prepare(
        SCENES[scene].source(),
        config_of(look, scene),
        Report(),
        views=PathConfig(orbit=ORBIT),
        asks=(*PICTURE, "scene"),
    )
    path, painting = found.path, found.painting.with_depth(False)
    assert path is not None
    assert found.scene is not None
    tracks = [
        track_directions(coat.strokes, path.closed) if coat.options.lock == "track" else None
        for coat in painting.coats
    ]
    surface = painting.surface
    assert surface is not None
    smooth = replace(surface, height=0 * surface.height, grain=np.ones_like(surface.grain))
    ground = surface.rgb.mean(axis=(0, 1))
    smooth = replace(smooth, rgb=np.broadcast_to(ground, surface.rgb.shape).copy())
    wet = tuple(replace(coat, dry=0.0, options=replace(coat.options, relief=None)) for coat in painting.coats)
    ways: dict[str, Painting | None] = {
        "look": painting,
        "no canvas": replace(painting, surface=smooth),
        "flat": replace(painting, surface=smooth, coats=wet, lamp=None),
        "as stills": replace(painting, is_moving=False),
        "plain": None,
    }
    views: dict[str, list[View]] = {way: [] for way in ways}
    boxes: list[list[bg.Boxes]] = [[] for _ in tracks]
    ellipses: list[list[bg.Boxes]] = [[] for _ in tracks]
    brushes: dict[tuple[int, int], int] = {}
    num_changed = 0
    for index, camera in enumerate(path.cameras[:NUM_FRAMES]):
        directions = [None if track is None else track.directions(index) for track in tracks]
        plain = bg.render(found.scene, camera, "gaussian")
        assert plain.depth is not None
        for way, each in ways.items():
            rgb: Array = (
                plain.over(ground) if each is None else each.frame(camera, directions).over((1, 1, 1))
            )
            views[way].append(View(np.clip(rgb, 0, 1), plain.depth, plain.alpha, camera))
        for row, (coat, track) in enumerate(zip(painting.coats, tracks, strict=True)):
            if track is None:
                continue
            drawn = coat.boxes(camera, directions[row])[0]
            unlocked = replace(coat, options=replace(coat.options, lock="off"))
            boxes[row].append(drawn)
            ellipses[row].append(unlocked.boxes(camera)[0])
            if drawn.brushes is not None:
                for stroke, brush in zip(drawn.ids.tolist(), drawn.brushes.tolist(), strict=True):
                    num_changed += brushes.setdefault((row, stroke), brush) != brush
    size = {"width": SIZE[0], "height": SIZE[1]}
    events = [
        orientation_events(own, ellipses=ellipse, **size)
        for own, ellipse in zip(boxes, ellipses, strict=True)
        if own
    ]
    errors = {
        way: 255 * float(np.sqrt(np.mean([warp_error(a, b).rmse ** 2 for a, b in pairwise(each)])))
        for way, each in views.items()
    }
    excess = {way: errors[way] - errors["plain"] for way in ("look", "no canvas", "flat", "as stills")}
    return [
        scene,
        look,
        str(sum(each.flips for each in events)),
        str(sum(each.spins for each in events)),
        str(num_changed),
        *(f"{value:.2f}" for value in excess.values()),
        *(
            f"{excess[way] / excess['flat']:.2f}" if excess["flat"] > 0 else "-"
            for way in ("look", "no canvas", "as stills")
        ),
    ]


def orbit_table(scenes: list[str]) -> list[list[str]]:
    head = "scene, look, flips, spins, brushes changed, look, no canvas, flat, as stills"
    table = [[*head.split(", "), *(f"{way} / flat" for way in ("look", "no canvas", "as stills"))]]
    for scene, look in (
        ("koala", "oil"),
        ("truck", "oil"),
        ("still life", "oil"),
        ("koala", "impressionist"),
        ("truck", "impressionist"),
        ("koala", "gouache"),
        ("truck", "gouache"),
        ("koala", "charcoal"),
        ("koala", "watercolour"),
        ("truck", "watercolour"),
        ("skull", "watercolour"),
        ("truck", "ink"),
        ("skull", "ink"),
        ("koala", "ink"),
    ):
        if scene in scenes:
            table.append(orbit_row(look, scene))
            print(table[-1], flush=True)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", choices=[*PICKED, []], metavar="SCENE")
    names = ["likeness", "parts", "orbits"]
    parser.add_argument("--tables", nargs="*", choices=names, default=names, metavar="NAME")
    parser.add_argument("--json", type=Path, help="keeps the rows of likeness and seconds")
    parser.add_argument("--page", type=Path, help="gets the tables between its marks")
    asked = parser.parse_args()
    print(describe(), flush=True)
    scenes = present(asked.scenes or PICKED, FILES)
    tables = {}
    if "parts" in asked.tables:
        tables["parts"] = parts_table(
            [scene for scene in scenes if scene in ("koala", "truck", "still life")]
        )
    if "orbits" in asked.tables:
        tables["orbits"] = orbit_table(scenes)
    if "likeness" in asked.tables:
        found = json.loads(asked.json.read_text()) if asked.json and asked.json.exists() else []
        found = [*(row for row in found if row["scene"] not in scenes), *rows(scenes)]
        found.sort(key=lambda row: PICKED.index(row["scene"]))
        if asked.json:
            asked.json.write_text(json.dumps(found, indent=1) + "\n")
        tables |= {"likeness": likeness_table(found), "seconds": seconds_table(found)}
    for name, table in tables.items():
        print(f"\n{markdown(table)}")
        if asked.page:
            asked.page.write_text(placed(asked.page.read_text(), name, markdown(table)))


if __name__ == "__main__":
    main()
