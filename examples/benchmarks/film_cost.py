"""What a frame of a film costs where most of the scene rests, beside a frame of the still scene.

    python -m examples.benchmarks.film_cost [--scene FILE] [--strokes 7000 30000] [--share 0.05]
                                            [--size 960x540]

The strokes are those of the still life, or of a scene file; a share of them, chosen by chance, turns and
drifts. Both frames are painted with the same brush, underpaint and relief, one after the other, before a
camera that stands still. Seconds of the processor, medians over the frames; `pose` is moving the strokes,
`project` leads to the boxes, of what moves with its pose, and the last column is the whole frame over that
of the still scene.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.orbit import orbit
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.relief import Relief
from brushgs.rendering.track import track_directions
from brushgs.rendering.track_moving import track_moving
from brushgs.still_life import still_life, still_life_camera
from examples.benchmarks.machine import describe
from examples.benchmarks.strokes import markdown
from tests.rendering.moving_strokes import tumbling, with_ids

NUM_FRAMES = 24
DEGREES = 3.0  # a step, at most


def costs(scene: bg.Gaussians, camera: bg.Camera, num_strokes: int, share: float) -> list[str]:
    """A row of the table."""
    strokes = with_ids(bg.cluster(bg.prune(scene), num_strokes))
    rows = np.sort(np.random.default_rng(0).permutation(len(strokes))[: int(share * len(strokes))])
    motion = tumbling(strokes.take(rows), NUM_FRAMES, degrees=DEGREES)
    texture = StrokeTexture.open("dry_brush")
    options = RenderOptions.of(texture, fade=True, order="soft", underpaint=True, relief=Relief())
    painting = Painting((Coat("strokes", strokes, texture, options),))
    cameras = [camera] * NUM_FRAMES
    still = track_directions(strokes, cameras)
    moving = track_moving(strokes, cameras, motion, np.arange(float(NUM_FRAMES)), fps=30)

    def posed(frame: int) -> Painting:
        return painting.posed(motion.pose(float(frame)))

    steps: dict[str, Callable[[int], object]] = {
        "still": lambda k: painting.frame(camera, (still.directions(k),)),
        "moving": lambda k: posed(k).frame(camera, (moving.directions(k),)),
        "pose": posed,
        "project still": lambda k: painting.coats[0].boxes(camera, still.directions(k)),
        "project moving": lambda k: posed(k).coats[0].boxes(camera, moving.directions(k)),
    }
    seconds: dict[str, list[float]] = {name: [] for name in steps}
    for frame in range(NUM_FRAMES):
        for name, step in steps.items():
            start = time.process_time()
            step(frame)
            seconds[name].append(time.process_time() - start)
    medians = {name: 1e3 * float(np.median(values)) for name, values in seconds.items()}
    ratio = medians["moving"] / medians["still"]
    return [f"{len(strokes):,}", *(f"{value:.1f}" for value in medians.values()), f"{ratio:.2f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scene", type=Path)
    parser.add_argument("--strokes", type=int, nargs="+", default=[7000, 30_000])
    parser.add_argument("--share", type=float, default=0.05)
    parser.add_argument("--size", default="960x540")
    args = parser.parse_args()
    print(describe())
    scene = still_life() if args.scene is None else bg.load(args.scene)
    width, height = map(int, args.size.split("x"))
    camera = still_life_camera(width=width, height=height)
    if args.scene is not None:
        camera = orbit(scene, 240, width=width, height=height)[0]
    head = ["strokes", "still, ms", "moving", "pose", "project, still", "moving", "ratio"]
    print(markdown([head, *(costs(scene, camera, num, args.share) for num in args.strokes)]))


if __name__ == "__main__":
    main()
