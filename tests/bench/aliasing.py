"""Error of each filter against run time: small strokes of a bristle texture, beside 8 x 8 samples a pixel.

    python -m tests.bench.aliasing [--scenes koala.ply derived/chair.ply] [--strokes 2000] [--size 480x400]

The truth is the mean of 8 x 8 bilinear samples a pixel of premultiplied colour and alpha: the same boxes at
eight times the size. That is projected once and enlarged, so the low-pass (0.3 px^2 of the small picture)
grows with it. Root mean square errors are of what is seen over white, 0 to 1. The example scene of the
project is always there; real ones are taken where they are found.
"""

import argparse
from collections.abc import Callable
from typing import get_args

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.framing import frame_scene
from brushgs.formats import load
from brushgs.measure.bench.supersample import supersampled
from brushgs.measure.likeness import rmse
from brushgs.options.choices import Filter
from brushgs.passes.reduce.cluster import cluster
from brushgs.passes.reduce.prune import prune
from brushgs.rendering.project import project
from brushgs.rendering.rasterize import rasterize
from brushgs.still_life import still_life, still_life_camera
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from tests.bench.machine import describe
from tests.bench.raster import measure
from tests.scenes import SCENES_FOLDER

STILL_LIFE = "still life"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=[STILL_LIFE, "koala.ply", "derived/chair.ply"])
    parser.add_argument("--textures", nargs="+", default=["dry_brush", "swirl"])
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--size", default="480x400", help="WIDTHxHEIGHT")
    parser.add_argument("--repeat", type=int, default=15)
    arguments = parser.parse_args()
    print(describe(), flush=True)
    width, height = (int(side) for side in arguments.size.lower().split("x"))
    for name in arguments.scenes:
        if name != STILL_LIFE and not (SCENES_FOLDER / name).exists():
            print(f"{name}: not found, skipped")
            continue
        gaussians, camera = view_of(name, width, height)
        boxes = project(cluster(prune(gaussians), arguments.strokes), camera)
        for texture in arguments.textures:
            compare(name, boxes, StrokeTexture.open(texture), camera, arguments.repeat)


def view_of(name: str, width: int, height: int) -> tuple[Gaussians, Camera]:
    if name == STILL_LIFE:
        return still_life(), still_life_camera(width=width, height=height)
    gaussians = load(SCENES_FOLDER / name)
    up = (0, 0, 1) if "chair" in name else (0, -1, 0)  # the chair was modelled with z up
    return gaussians, frame_scene(gaussians, width=width, height=height, up=up)


def compare(name: str, boxes: Boxes, texture: StrokeTexture, camera: Camera, repeat: int) -> None:
    size = {"width": camera.width, "height": camera.height}
    truth = supersampled(boxes, texture, **size).over((1, 1, 1))
    calls: dict[str, Callable[[], Frame]] = {
        filter: lambda f=filter: rasterize(boxes, texture, filter=f, depth=False, **size)
        for filter in get_args(Filter)
    }
    errors = {filter: rmse(call().over((1, 1, 1)), truth) for filter, call in calls.items()}
    times = measure(calls, repeat)
    longest = np.median(2 * boxes.half_extents.max(axis=1))
    print(f"{name}, {texture.name}: {len(boxes)} strokes, half of them over {longest:.0f} px long")
    for filter, error in errors.items():
        ratio, ms = error / errors["bilinear"], np.median(times[filter])
        slower = ms / np.median(times["bilinear"])
        print(
            f"  {filter:9} RMSE {error:.4f} ({ratio:.2f} of bilinear)  {ms:6.2f} ms "
            f"({min(times[filter]):.2f}-{max(times[filter]):.2f}), {slower:.2f} of bilinear",
            flush=True,
        )


if __name__ == "__main__":
    main()
