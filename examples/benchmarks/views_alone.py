"""How much paint turns between pictures painted alone, by the locks "anchor" and "canonical"; and films.

    python -m examples.benchmarks.views_alone [SCENE ...] [--strokes 2000] [--views 120]

SCENE is a name of the table below. Paths: a turn of --views views at the elevation of the first view, one
over the poles, one from 29 degrees below the horizon and one from 52 above, 192 x 144. "turned" is the share
of the visible paint that turns by more than 15 degrees from one view to the next, %, with either lock. "film"
is the share of the visible paint that a film of the path has the other way round than the picture with
"canonical" of the same view, %: by the lock "track", and by "canonical", which pulls films toward the fields.
"""

import argparse
from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import radians

import numpy as np

from brushgs.cameras.orbit import orbit
from brushgs.options.painting import ClusterConfig, PaintConfig
from brushgs.pipeline.prepare import STROKES, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.canonical import Canonical, directions_of, fit_canonical
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.track import track_directions
from brushgs.rendering.visibility import visible_areas
from brushgs.still_life import still_life
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present

SCENES = {
    "koala": "koala.ply",
    "chair": "chair.splat",
    "truck": "truck.splat",
    "guitar": "guitar.ksplat",
    "skull": "skull.sog",
    "plant": "plant.splat",
    "biker": "biker.spz",
    "rubber toy": "rubber_toy_cloud.ply",
    "campsite": "campsite_sog",
    "sunflower": "sunflower_tile.ply",
    "playbot": "playbot_sog",
    "still life": None,
}
PATHS = {
    "orbit": {},
    "over the poles": {"over_poles": True},
    "below": {"elevation": radians(-29)},
    "above": {"elevation": radians(52)},
}
SIZE = {"width": 192, "height": 144}
TURNED, ROUND = radians(15), radians(90)
EVERY = 5  # views of a path at which its film is compared


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=[*SCENES], metavar="SCENE")
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--views", type=int, default=120)
    options = parser.parse_args()
    print(describe(), flush=True)
    for name in present(options.scenes, SCENES):
        file = SCENES[name]
        scene = still_life() if file is None else FOLDER / file
        config = PaintConfig(cluster=ClusterConfig(options.strokes))
        prepared = prepare(scene, config, Report(), asks=(*STROKES, "first_view"))
        strokes, view = prepared.strokes, prepared.known_view
        fields = fit_canonical(strokes)
        middle = tuple(float(x) for x in np.median(strokes.means.astype(np.float64), axis=0))
        print(f"{name}: {100 * fields.is_anchored.mean():.0f} % follow their axis", flush=True)
        for path, turn in PATHS.items():
            look_at = None if view.eye is None else middle  # from outside, too
            cameras = orbit(view, options.views, **SIZE, look_at=look_at, **turn)
            print(f"  {path:15} {figures(strokes, fields, cameras)}", flush=True)


def figures(strokes: Gaussians, fields: Canonical, cameras: Sequence[Camera]) -> str:
    """The figures of a path, as a line."""
    closed = [*cameras, cameras[0]]
    areas = [visible_areas(strokes, camera) for camera in closed]
    steps = [np.minimum(*pair) for pair in pairwise(areas)]  # what is seen of a stroke in both views
    alone = [[angles_of(strokes, camera, given) for camera in closed] for given in (None, fields)]
    turned = [share(steps, pairwise(angles), TURNED) for angles in alone]
    against = []
    for given in (None, fields):
        film = track_directions(strokes, closed, fields=given)
        pairs = [(film.directions(k).angles, alone[1][k]) for k in range(0, len(closed), EVERY)]
        against.append(share(areas[::EVERY], pairs, ROUND))
    return "turned {:.2f} -> {:.2f}, film {:.1f} -> {:.1f}".format(*turned, *against)


def angles_of(strokes: Gaussians, camera: Camera, fields: Canonical | None) -> Array:
    """[N] radians, of pictures painted alone; 0 outside."""
    found = directions_of(strokes, camera, RenderOptions(num_sigmas=2.0), fields)
    assert found is not None, "the options have a lock"
    return found.angles


def share(areas: Iterable[F64], pairs: Iterable[tuple[Array, Array]], most: float) -> float:
    """The share of areas whose two directions differ by more than that, %."""
    seen, beyond = 0.0, 0.0
    for area, (first, second) in zip(areas, pairs, strict=True):
        off = np.abs(np.remainder(first.astype(np.float64) - second + np.pi, 2 * np.pi) - np.pi)
        seen, beyond = seen + float(area.sum()), beyond + float(area[off > most].sum())
    return 100 * beyond / seen


if __name__ == "__main__":
    main()
