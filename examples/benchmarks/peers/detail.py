"""Do the strokes of a scene at two levels of detail agree? The still life at 100,000 Gaussians and at 10,000.

    python -m examples.benchmarks.peers.detail [--strokes 2000] [--size 640x360] [--looks oil ink]

The coarse scene is the fine one, merged (`brushgs.cluster`). Beside the coarse scene stand the fine one again
with another seed, which is what chance does, and the same scene again, which must agree wholly. Figures, each
stroke weighted by its painted area:
- place: distance to the nearest stroke of the other painting, in sizes of the stroke (root of its area);
- size: difference of sizes to that stroke, octaves;
- direction: difference of directions to that stroke, degrees, of strokes twice as long as wide; 45 is chance;
- lines: share of dark pixels (luma below a half) with a dark pixel of the other picture within 2 pixels, the
  mean of both ways; beside it what a picture moved by a tenth of its width gives. Of looks that draw lines;
- PSNR in dB of the subject, of one picture to the other, and to the plain picture of the fine scene.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

import brushgs as bg
from brushgs.measure.stability.look_painters import main_coat
from brushgs.options.painting import ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.still_life import still_life
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.colors import LUMINANCE
from examples.benchmarks.machine import describe
from examples.benchmarks.peers.columns import nearness
from examples.benchmarks.peers.of_brushgs import ScenePainter, config_of
from examples.benchmarks.peers.run import cameras_of
from examples.benchmarks.peers.task import Task, on_white

FINE, COARSE = 100_000, 10_000
LONG = 2.0  # aspect from which on a stroke has a direction
REACH = 2.0  # pixels
SHIFT = 0.1  # of the width


def agreement(own: Boxes, other: Boxes) -> tuple[float, float, float]:
    """Place, size and direction of one painting's strokes against another's; see the module."""
    sizes, others = (np.sqrt(4 * boxes.half_extents.astype(float).prod(axis=1)) for boxes in (own, other))
    distances, rows = cKDTree(other.centers).query(own.centers, workers=1)
    weights = sizes**2 * own.opacities
    place = np.average(distances / sizes, weights=weights)
    size = np.average(np.abs(np.log2(sizes / others[rows])), weights=weights)
    turns = np.abs((own.angles - other.angles[rows] + np.pi / 2) % np.pi - np.pi / 2)
    aspects = [each.half_extents.max(axis=1) / each.half_extents.min(axis=1) for each in (own, other)]
    is_long = (aspects[0] > LONG) & (aspects[1][rows] > LONG)
    turn = np.average(np.degrees(turns[is_long]), weights=weights[is_long]) if is_long.any() else np.nan
    return float(place), float(size), float(turn)


def line_share(first: Array, second: Array) -> float:
    """The share of dark pixels of either picture near a dark one of the other."""
    dark = [(picture @ np.asarray(LUMINANCE)) < 0.5 for picture in (first, second)]
    if not all(each.any() for each in dark):
        return float("nan")
    near = [distance_transform_edt(~each) <= REACH for each in dark]
    return float(np.mean([near[1][dark[0]].mean(), near[0][dark[1]].mean()]))


def painted(task: Task, look: str, seed: int = 0) -> tuple[Boxes, Array]:
    """The strokes of the main coat in the first view, and the picture."""
    config = config_of(look, task)
    painter = ScenePainter(task, replace(config, cluster=replace(config.cluster, seed=seed)))
    boxes = main_coat(painter.painting).boxes(task.cameras[0])[0]
    return boxes, painter.paint(0)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--size", default="640x360", help="WIDTHxHEIGHT")
    parser.add_argument("--looks", nargs="+", default=["oil", "ink"])
    options = parser.parse_args()
    print(describe(), file=sys.stderr)
    width, height = (int(side) for side in options.size.lower().split("x"))
    view = ViewConfig(size=(width, height))
    with TemporaryDirectory() as folder:
        fine = still_life(FINE)
        tasks = {}
        for name, scene in (("fine", fine), ("coarse", bg.cluster(fine, COARSE))):
            file = Path(folder) / f"{name}.ply"
            bg.save(scene, file)
            tasks[name] = SceneSource((file,))
        cameras = cameras_of(tasks["fine"], view)[:1]
        sources = {name: Task(source, view, cameras, options.strokes, "") for name, source in tasks.items()}
        frame = sources["fine"].plain_frame(0)
        plain, alpha = on_white(frame), frame.alpha
        names = "look, beside the fine scene, place, size, direction, lines, moved, PSNR, to the scene"
        print(f"| {names.replace(', ', ' | ')} |")
        print("|---|---|---|---|---|---|---|---|---|")
        for look in options.looks:
            own, picture = painted(sources["fine"], look)
            moved = np.roll(picture, round(SHIFT * width), axis=1)
            for name, task, seed in (
                ("coarse scene", sources["coarse"], 0),
                ("another seed", sources["fine"], 1),
                ("itself", sources["fine"], 0),
            ):
                other, beside = painted(task, look, seed)
                place, size, turn = agreement(own, other)
                near, to_scene = (nearness(beside, aim, alpha)[0] for aim in (picture, plain))
                lines = f"{line_share(picture, beside):.2f} | {line_share(picture, moved):.2f}"
                figures = f"{place:.2f} | {size:.2f} | {turn:.0f} | {lines} | {near:.1f}"
                print(f"| {look} | {name} | {figures} | {to_scene:.1f} |", flush=True)


if __name__ == "__main__":
    main()
