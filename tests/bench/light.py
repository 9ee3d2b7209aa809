"""What a painter adds to what he sees: values, edges, temperature and economy, before and after.

    python -m tests.bench.light [FILE ...]

Each scene in a look with `--key 0 --values 0 --edges 0 --economy 0 --focus off`, then as it is painted by
default, 1000 x 750. Range: the 5th to the 95th percentile of L* after a squint. Warmth: b* of the lights of
the subject over that of its darks. Lost and crisp: shares of the outline, see `tests.outline`. PSNR: of flat
dabs to the plain picture of three views for which no stroke was made.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cameras.paths import turn_around
from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.passes.color.squint import Squint
from brushgs.pipeline.backdrop import with_cut_edges
from brushgs.pipeline.media.materials import BACKDROP, CUT_IN
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from tests.bench.machine import describe
from tests.bench.strokes import markdown
from tests.outline import hardness_of
from tests.scenes import SCENES_FOLDER

FILES = ("koala.ply", "skull.sog", "guitar.ksplat", "plant.splat", "chair.splat", "biker.compressed.ply")
GROUND = 0.5  # RGB of what strokes leave open
SIDE = 480  # pixels of the views that compare flat dabs


def config_of(look: str, *, is_bare: bool) -> PaintConfig:
    """A look without relief, with all that is measured or without."""
    config = Look.open(look).config
    config = replace(
        config, view=replace(config.view, size=(1000, 750)), light=replace(config.light, relief=0.0)
    )
    if not is_bare:
        return config
    return replace(
        config,
        light=replace(config.light, key=0.0),
        color=replace(config.color, values=0.0),
        strokes=replace(config.strokes, economy=0.0, edges=0.0, focus=None),
    )


def picture(painting: Painting, prepared: Prepared) -> np.ndarray:
    """[H, W, 3] over grey."""
    frame = painting.frame(prepared.camera)
    return frame.rgb + (1 - frame.alpha[..., None]) * np.float32(GROUND)


def figures(prepared: Prepared) -> list[str]:
    """Range, warmth, lost and crisp; the last two "-" where nothing stands around the scene."""
    painting = with_cut_edges(prepared.painting, prepared.camera, prepared.edges)
    painting = replace(painting, surface=None, lamp=None)
    backdrop = [coat for coat in painting.coats if coat.name == BACKDROP]
    others = [coat for coat in painting.coats if coat.name not in (BACKDROP, CUT_IN)]
    alpha = replace(painting, coats=tuple(others)).frame(prepared.camera).alpha
    painted = picture(painting, prepared)
    squint = Squint.of(painted, alpha)
    found = [f"{squint.range:.0f}", f"{squint.warmth.lights:+.1f}"]
    if not backdrop:
        return [*found, "-", "-"]
    outline = hardness_of(painted, picture(replace(painting, coats=tuple(backdrop)), prepared), alpha)
    return [*found, f"{100 * outline.lost.mean():.0f}", f"{100 * outline.crisp.mean():.0f}"]


def unused_psnr(prepared: Prepared, strokes: bg.Gaussians) -> float:
    """Mean PSNR in dB of three views beside the first one, on grey."""
    view = prepared.known_view
    small, center = prepared.camera.in_side(SIDE), view.points.mean(axis=0)
    found = []
    for camera in turn_around(small, center, view.up, seconds=1, fps=9).cameras[1:4]:
        plain, painted = (
            frame.rgb + (1 - frame.alpha[..., None]) * GROUND
            for frame in (
                bg.render(prepared.whole_scene, camera, "gaussian"),
                bg.render(strokes, camera, "ellipse"),
            )
        )
        found.append(-10 * np.log10(np.mean((np.clip(plain, 0, 1) - np.clip(painted, 0, 1)) ** 2)))
    return float(np.mean(found))


def row(path: Path, look: str) -> list[str]:
    """A scene before and after."""
    source, pairs, dbs = SceneSource.of(path), [], []
    for is_bare in (True, False):
        config = config_of(look, is_bare=is_bare)
        pairs.append(figures(prepare(source, config, Report(), asks=(*PICTURE, "first_view"))))
        unlit = replace(
            config,
            light=replace(config.light, key=0.0),
            color=replace(config.color, values=0.0),
            strokes=replace(config.strokes, edges=0.0, broken_color=0.0),
        )
        found = prepare(source, unlit, Report(), asks=(*PICTURE, "first_view", "scene"))
        dbs.append(f"{unused_psnr(found, found.strokes):.2f}")
    return [
        path.name,
        *(a if a == b == "-" else f"{a} to {b}" for a, b in zip(*pairs, strict=True)),
        " to ".join(dbs),
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", type=Path, default=[SCENES_FOLDER / name for name in FILES])
    parser.add_argument("--look", default="oil")
    args = parser.parse_args()
    print(describe(), end="\n\n")
    columns = ["scene", "range", "warmth", "lost, %", "crisp, %", "PSNR, dB"]
    print(markdown([columns, *(row(path, args.look) for path in args.files)]))


if __name__ == "__main__":
    main()
