"""What abstraction costs: strokes against the plain picture of the whole scene, published rule and default.

    python -m tests.bench.abstraction [SCENE ...] [--strokes 250 2000 7000] [--textures gaussian swirl flat]
                                      [--json FILE] [--pictures FOLDER]

SCENE is a name of the table below or a scene file, followed by its up axis where that is not -y
("chair.ply:+z"). Without one: the still life that the project makes, and the real scenes that are here.
PSNR is over 3 views of 500 x 500 on white (mean of the squared errors; 1 view of the still life, which is
composed for one); "unpainted" is the share of the plain picture's alpha that no stroke covers, "spilt"
what they paint beyond it. Both rules prune, the published one to 70 %, the default to 70 % or more; their
seconds are pruning and clustering. The published strokes reach 2 standard deviations, the default's
`fitted_sigmas`. Neither is locked: anchored directions of a single picture cost the default 0 to 0.3 dB more
(0.5 once: truck, 250 flat strokes), tracked ones none.

Known to fall short: the still life with the plain kernel and with swirls, where the published rule, which
drops the dark wall first, is 1 dB ahead (2000 strokes; with the flat brush they are equal).
"""

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import brushgs as bg
from brushgs.measure.likeness import psnr, unpainted
from brushgs.passes.extent import robust_frame
from brushgs.still_life import still_life, still_life_camera
from tests.bench.machine import describe
from tests.scenes import SCENES_FOLDER

SIZE = 500  # pixels, both sides
FOV_Y = np.radians(50.0)
WHITE = (1.0, 1.0, 1.0)
VIEWS = ((0.6, 0.35), (2.7, 0.2), (4.6, 0.5))  # azimuth and elevation, radians
DISTANCE = 2.6  # robust radii
REAL_SCENES = {
    "koala": ("koala.ply", "-y"),
    "chair": ("derived/chair.ply", "+z"),
    "truck": ("derived/truck.ply", "-y"),
    "skull": ("derived/skull_sh3.ply", "-y"),
    "biker": ("biker.compressed.ply", "-y"),
}
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def _spilt(alpha: np.ndarray, plain_alpha: np.ndarray) -> float:
    """Alpha of a painting beyond that of the plain picture, as a share of the latter, >= 0."""
    return float(np.maximum(alpha - plain_alpha, 0).sum() / (plain_alpha.sum() or 1))


@dataclass(frozen=True)
class Quality:
    """How near strokes come to the plain picture."""

    psnr: float  # dB
    unpainted: float  # share of the plain alpha
    spilt: float  # alpha beyond the plain one, as a share of that


@dataclass(frozen=True)
class Row:
    scene: str
    strokes: int
    texture: str
    paper: Quality
    default: Quality
    paper_seconds: float
    default_seconds: float


class Truth:
    """A scene's cameras and plain pictures."""

    def __init__(self, gaussians: bg.Gaussians, cameras: Sequence[bg.Camera]) -> None:
        self.gaussians, self.cameras = gaussians, cameras
        kernel = bg.StrokeTexture.open("gaussian")
        self.frames = [bg.render(gaussians, camera, kernel, depth=False) for camera in cameras]

    def judge(self, strokes: bg.Gaussians, texture: bg.StrokeTexture, sigmas: float) -> Quality:
        frames = [
            bg.render(strokes, camera, texture, num_sigmas=sigmas, lock="off", depth=False)
            for camera in self.cameras
        ]
        picture, plain = (np.concatenate([on_white(f) for f in side]) for side in (frames, self.frames))
        alpha, plain_alpha = (np.concatenate([f.alpha for f in side]) for side in (frames, self.frames))
        return Quality(psnr(picture, plain), unpainted(alpha, plain_alpha), _spilt(alpha, plain_alpha))


def on_white(frame: bg.Frame) -> NDArray[np.floating]:
    return np.clip(frame.over(WHITE), 0, 1)


def around(gaussians: bg.Gaussians, up: str) -> list[bg.Camera]:
    """Three views around what 98 % of the scene is."""
    center, radius = robust_frame(gaussians.means)
    upward = np.array(AXES[up[-1]], float) * (-1 if up[0] == "-" else 1)
    sides = [np.array(axis, float) for name, axis in AXES.items() if name != up[-1]]
    cameras = []
    for azimuth, elevation in VIEWS:
        level = np.cos(azimuth) * sides[0] + np.sin(azimuth) * sides[1]
        eye = center + DISTANCE * radius * (np.cos(elevation) * level + np.sin(elevation) * upward)
        cameras.append(bg.Camera.look_at(eye, center, upward, width=SIZE, height=SIZE, fov_y=FOV_Y))
    return cameras


def within_truck(gaussians: bg.Gaussians) -> list[bg.Camera]:
    """Three views from among the scene: it has no outside to be seen from."""
    middle = np.median(gaussians.means, axis=0).astype(float)
    cameras = []
    for azimuth in (0.0, 0.5, -0.6):
        c, s = np.cos(azimuth), np.sin(azimuth)
        eye = middle + np.array([0.9 * c - 0.75 * s, -0.35, -0.9 * s - 0.75 * c])
        target = middle + np.array([-0.1, -0.05, 0.1])
        cameras.append(bg.Camera.look_at(eye, target, (0, -1, 0), width=SIZE, height=SIZE, fov_y=FOV_Y))
    return cameras


def open_scene(name: str) -> tuple[str, Truth]:
    if name == "still_life":
        gaussians = still_life()
        return name, Truth(
            gaussians, [still_life_camera(width=SIZE, height=SIZE)]
        )  # a picture: no other side
    path, up = REAL_SCENES.get(name, (None, None))
    if path is None:
        file, _, axis = name.partition(":")
        gaussians, up = bg.load(file), axis or "-y"
        name = Path(file).stem
    else:
        gaussians = bg.load(SCENES_FOLDER / path)
    return name, Truth(gaussians, within_truck(gaussians) if name == "truck" else around(gaussians, up))


def paper_rule(gaussians: bg.Gaussians, count: int) -> bg.Gaussians:
    kept = bg.prune(gaussians, weight="paper")
    return bg.cluster(kept, count, features="paper", merge="paper", method="minibatch")


def default_rule(gaussians: bg.Gaussians, count: int) -> bg.Gaussians:
    return bg.cluster(bg.prune(gaussians), count)


def measure(
    name: str, truth: Truth, count: int, textures: list[bg.StrokeTexture], pictures: Path | None
) -> list[Row]:
    sets, seconds = [], []
    for rule in (paper_rule, default_rule):
        begun = time.perf_counter()
        sets.append(rule(truth.gaussians, count))
        seconds.append(time.perf_counter() - begun)
        assert 0 < len(sets[-1]) <= count, "a rule gave more strokes than asked for"
    if pictures:
        write_sheet(pictures / f"{name}-{count}.png", truth, sets, textures)
    return [
        Row(
            name,
            count,
            texture.name,
            truth.judge(sets[0], texture, texture.num_sigmas),
            truth.judge(sets[1], texture, texture.fitted_sigmas),
            *seconds,
        )
        for texture in textures
    ]


def write_sheet(path: Path, truth: Truth, sets: list[bg.Gaussians], textures: list[bg.StrokeTexture]) -> None:
    """Plain picture, then published rule and default with each texture, in a row."""
    frames = [truth.frames[0]]
    for texture in textures:
        for strokes, sigmas in zip(sets, (texture.num_sigmas, texture.fitted_sigmas), strict=True):
            frames.append(bg.render(strokes, truth.cameras[0], texture, num_sigmas=sigmas, lock="off"))
    row = np.concatenate([on_white(frame) for frame in frames], axis=1)
    bg.save(bg.Frame(np.ascontiguousarray(row), np.ones_like(row[..., 0])), path)


def tell(row: Row) -> str:
    paper, default = row.paper, row.default
    return (
        f"{row.scene:11} {row.strokes:6} {row.texture:9} {paper.psnr:6.2f} {default.psnr:7.2f} "
        f"{default.psnr - paper.psnr:+6.2f}  {paper.unpainted:8.1%} {default.unpainted:7.1%} "
        f"{paper.spilt:8.1%} {default.spilt:7.1%}  {row.paper_seconds:7.1f} {row.default_seconds:7.2f}"
    )


HEADING = (
    f"{'':28} {'PSNR, dB':^21}  {'unpainted':^16} {'spilt':^16}  {'seconds':^15}\n"
    f"{'scene':11} {'strokes':>6} {'stroke':9} {'paper':>6} {'default':>7} {'gain':>6}"
    + 3
    * f"  {'paper':>7} {'default':>7}"
)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--strokes", type=int, nargs="+", default=[250, 2000, 7000])
    parser.add_argument("--textures", nargs="+", default=["gaussian", "swirl", "flat"])
    parser.add_argument("--json", type=Path, help="write the rows to this file, too")
    parser.add_argument("--pictures", type=Path, help="write a picture per scene and count into this folder")
    arguments = parser.parse_args()
    here = [name for name, (path, _) in REAL_SCENES.items() if (SCENES_FOLDER / path).exists()]
    textures = [bg.StrokeTexture.open(name) for name in arguments.textures]
    print(describe(), HEADING, sep="\n", flush=True)
    rows: list[Row] = []
    for scene in arguments.scenes or ["still_life", *here]:
        name, truth = open_scene(scene)
        for count in arguments.strokes:
            rows += measure(name, truth, count, textures, arguments.pictures)
            print(*(tell(row) for row in rows[-len(textures) :]), sep="\n", flush=True)
    for texture in textures:
        gains = [row.default.psnr - row.paper.psnr for row in rows if row.texture == texture.name]
        print(f"{texture.name}: gain {np.mean(gains):.2f} dB on average, {min(gains):.2f} at least")
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")


if __name__ == "__main__":
    main()
