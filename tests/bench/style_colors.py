"""How the colours of a painting come over to scenes: how near, how much structure stays, at what cost.

    python -m tests.bench.style_colors [SCENE ...] [--json FILE] [--draw FOLDER]

SCENE is one of `tests.bench.strokes`; without, koala, truck, chair, biker and still life, those of them that
are here. 6000 strokes of the plain look, 640x360 pixels, toward the paintings of `tests.bench.paintings`, by
the palette that is learnt from each. On pixels with alpha above 1/2:

- colours: sliced Wasserstein distance (64 directions, 512 quantiles, RGB 0 to 1) of the picture to the
  painting before and after, and by how much it falls; "paint" is the same of the strokes by their weights,
  which is what the map is fitted to, "seen" of the picture where the map is fitted to what of each stroke it
  shows.
- structure: SSIM (window and constants as published, values as they are) of the length of the gradient of
  luma to that of the unstyled picture.
- dial: correlation of the mean distance of colours from the unstyled picture, and of the sliced distance to
  the painting, with the share, at 0, 1/4, 1/2, 3/4 and 1.
- commutes: PSNR in dB of the picture of mapped strokes to the mapped picture of strokes.
- seconds: to fit the map, and to map the strokes.
"""

import argparse
import json
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from skimage.metrics import structural_similarity

import brushgs as bg
from brushgs.colors import LUMINANCE
from brushgs.io.pictures.images import read_image
from brushgs.measure.likeness import psnr
from brushgs.options.look import Look
from brushgs.options.painting import ViewConfig
from brushgs.painting.prepare import prepare
from brushgs.painting.report import Report
from brushgs.passes.color_map import Blend, map_colors
from brushgs.passes.recolor import painted_weights
from brushgs.passes.seen import shown_areas
from brushgs.passes.style.palette import learn_palette
from brushgs.passes.style.transport import palette_map
from brushgs.sh import base_colors
from tests.bench.machine import describe
from tests.bench.paintings import write
from tests.bench.strokes import SCENES, markdown
from tests.scenes import SCENES_FOLDER

PICKED = "koala", "truck", "chair", "biker", "still life"
SIZE, NUM_STROKES = (640, 360), 6000
GROUND = np.array([0.75, 0.72, 0.68])
SHARES = 0.0, 0.25, 0.5, 0.75, 1.0


@dataclass(frozen=True)
class Row:
    """One scene toward one painting."""

    scene: str
    painting: str
    before: float
    after: float
    paint_falls: float
    seen_falls: float
    structure: float
    dial_colors: float
    dial_distance: float
    commutes: float
    fit_seconds: float
    map_seconds: float

    @property
    def falls(self) -> float:
        return 1 - self.after / self.before


def sliced_distance(one, other, weights=None) -> float:
    """Sliced Wasserstein distance of colours [n, 3]; `weights` are those of the first."""
    directions = np.random.default_rng(1).normal(size=(3, 64))
    directions /= np.linalg.norm(directions, axis=0)
    at = (np.arange(512) + 0.5) / 512
    if weights is not None:
        rng = np.random.default_rng(2)
        one = one[rng.choice(len(one), 20_000, p=weights / weights.sum())]
    here, there = (np.quantile(colors @ directions, at, axis=0) for colors in (one, other))
    return float(np.sqrt(np.mean((here - there) ** 2)))


def structure(picture, plain) -> float:
    """SSIM of the lengths of the gradients of luma."""
    lengths = [np.hypot(*np.gradient(p @ np.array(LUMINANCE))) for p in (picture, plain)]
    return float(
        structural_similarity(
            *lengths, data_range=1.0, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
        )
    )


def _straight(frame):
    seen = frame.alpha > 0.5
    return np.clip(frame.rgb[seen] / frame.alpha[seen][:, None], 0, 1).astype(np.float64)


def strokes_of(name: str):
    """Strokes and camera, as the command would make them."""
    config = Look.open("plain").config
    config = replace(config, view=ViewConfig(size=SIZE), cluster=replace(config.cluster, strokes=NUM_STROKES))
    prepared = prepare(SCENES[name].source(), config, Report())
    return prepared.strokes, prepared.camera


def measure(name: str, paintings: dict[str, Path], folder: Path | None) -> list[Row]:
    """The rows of a scene; its pictures side by side, paintings above, go to a folder."""
    strokes, camera = strokes_of(name)
    texture = bg.StrokeTexture.open("flat")
    frame = bg.render(strokes, camera, texture)
    plain, colors = frame.over(GROUND), _straight(frame)
    paint, weights = base_colors(strokes.sh), painted_weights(strokes).astype(np.float64)
    shown = shown_areas(strokes, [camera])
    rows, pictures = [], [plain]
    for painting, path in paintings.items():
        image = read_image(path)[..., :3]
        wanted, palette = image.reshape(-1, 3).astype(np.float64)[::3], learn_palette(image)
        start = time.perf_counter()
        one = palette_map(palette, paint, weights)
        fitted = time.perf_counter()
        map_colors(strokes, one)
        mapped = time.perf_counter()
        away, distances = [], []
        for share in SHARES:
            styled = bg.render(map_colors(strokes, Blend([(one, share)])), camera, texture)
            distances.append(sliced_distance(_straight(styled), wanted))
            away.append(float(np.abs(_straight(styled) - colors).mean()))
        ground = one.colors(GROUND[None])[0]
        picture = np.clip(styled.over(ground), 0, 1)
        pictures.append(picture)
        there = one.colors(plain.reshape(-1, 3).astype(np.float64)).reshape(plain.shape)
        seen = map_colors(strokes, palette_map(palette, paint, shown))
        seen_colors = _straight(bg.render(seen, camera, texture))
        paint_pair = [sliced_distance(np.clip(c, 0, 1), wanted, weights) for c in (paint, one.colors(paint))]
        rows.append(
            Row(
                name,
                painting,
                distances[0],
                distances[-1],
                1 - paint_pair[1] / paint_pair[0],
                1 - sliced_distance(seen_colors, wanted) / distances[0],
                structure(picture, plain),
                float(np.corrcoef(SHARES, away)[0, 1]),
                float(-np.corrcoef(SHARES, distances)[0, 1]),
                psnr(picture, np.clip(there, 0, 1)),
                fitted - start,
                mapped - fitted,
            )
        )
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        sheet = np.clip(np.concatenate(pictures, axis=1), 0, 1).astype(np.float32)
        bg.save(bg.Frame(sheet, np.ones(sheet.shape[:2], np.float32), None), folder / f"style-{name}.png")
    return rows


def table(rows: list[Row]) -> str:
    """In Markdown."""
    head = ["scene", "painting", "distance", "falls by", "paint", "seen", "structure", "dial: colours"]
    head += ["dial: distance", "commutes, dB", "fit, s", "map, s"]
    cells = [
        [
            row.scene,
            row.painting,
            f"{row.before:.3f} to {row.after:.3f}",
            f"{row.falls:.0%}",
            f"{row.paint_falls:.0%}",
            f"{row.seen_falls:.0%}",
            f"{row.structure:.3f}",
            f"{row.dial_colors:.4f}",
            f"{row.dial_distance:.3f}",
            f"{row.commutes:.1f}",
            f"{row.fit_seconds:.2f}",
            f"{row.map_seconds:.3f}",
        ]
        for row in rows
    ]
    return markdown([head, *cells])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join(PICKED))
    parser.add_argument("--json", type=Path, help="keep the rows there")
    parser.add_argument("--draw", type=Path, metavar="FOLDER", help="pictures of each scene side by side")
    args = parser.parse_args()
    print(describe())
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        paintings = write(Path(folder))
        for name in args.scenes or PICKED:
            file = SCENES[name].file
            if file is not None and not (SCENES_FOLDER / file).exists():
                print(f"{name} is not here: {SCENES_FOLDER / file}")
                continue
            rows += measure(name, paintings, args.draw)
    print(table(rows))
    if args.json is not None:
        args.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))


if __name__ == "__main__":
    main()
