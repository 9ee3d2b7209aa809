"""How the colours of a painting come over to scenes: how near, how much structure stays, at what cost.

    python -m tests.bench.style_colors [SCENE ...] [--json FILE] [--draw FOLDER]

SCENE is one of `tests.bench.strokes`; without, koala, truck, chair, biker and still life, those of them that
are here. All is prepared as `brushgs render --style` prepares it: 3000 strokes, 480x360, the first view. The
paintings are those of `tests.bench.mark_paintings`. But for "oil", styles have their palette alone, and the
look is "plain", on transparent; what is measured are pixels with alpha above 1/2.

- distance: sliced Wasserstein distance (64 directions, 512 quantiles, RGB 0 to 1) of the picture to the
  painting before and after, and by how much it falls. "oil": by how much that of the whole picture falls, its
  ground and surroundings too, in the look oil, marks and all.
- structure: SSIM (window and constants as published, values as they are) of the length of the gradient of
  luma to that of the unstyled picture. "edges": correlation of these lengths, for which contrast is nothing.
  "contrast": of the two pictures, the root of the mean squared gradient of RGB, over that of the unstyled.
- dial: correlation of the mean distance of colours from the unstyled picture, and of the sliced distance to
  the painting, with the share, at 0, 1/4, 1/2, 3/4 and 1.
- commutes: PSNR in dB of the picture of mapped strokes to the mapped picture of strokes. The second table has
  the same of maps that are fitted to nothing.
- seconds: of the stage of the command that fits the map to a painting and maps 10,000 strokes.

Strokes have no streaks but in "oil": these are laid over strokes after their colours.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from skimage.metrics import structural_similarity

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.formats.styles import write_style
from brushgs.measure.likeness import psnr
from brushgs.options.look import Look
from brushgs.options.painting import ViewConfig
from brushgs.options.styling import AdjustConfig
from brushgs.passes.color.adjust import adjust_map
from brushgs.passes.style.marks import learn_marks
from brushgs.passes.style.palette import learn_palette
from brushgs.pipeline import color_changes
from brushgs.pipeline.prepare import Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory
from brushgs.pipeline.styling import styled
from brushgs.values.arrays import F64
from brushgs.values.colors import LUMINANCE
from brushgs.values.style import Style
from tests.bench.machine import describe
from tests.bench.mark_paintings import write
from tests.bench.strokes import SCENES, markdown
from tests.scenes import SCENES_FOLDER

PICKED = "koala", "truck", "chair", "biker", "still life"
SIZE, NUM_STROKES, NUM_TIMED = (480, 360), 3000, 10_000
MANY = 30_000  # colours: of more, so many are drawn for a distance
GROUND = np.array([0.75, 0.72, 0.68])  # under the pictures that structure is taken from
SHARES = 0.0, 0.25, 0.5, 0.75, 1.0
ADJUSTMENTS = {
    "brightness 0.1": AdjustConfig(brightness=0.1),
    "contrast 1.3": AdjustConfig(contrast=1.3),
    "contrast 0.7": AdjustConfig(contrast=0.7),
    "saturation 0.4": AdjustConfig(saturation=0.4),
    "saturation 1.6": AdjustConfig(saturation=1.6),
    "temperature 0.5": AdjustConfig(temperature=0.5),
}


@dataclass(frozen=True)
class Row:
    """One scene toward one painting."""

    scene: str
    painting: str
    before: float
    after: float
    oil_falls: float
    structure: float
    edges: float
    contrast: float
    dial_colors: float
    dial_distance: float
    commutes: float

    @property
    def falls(self) -> float:
        return 1 - self.after / self.before


@dataclass(frozen=True)
class Files:
    """A painting, its colours [n, 3], and its styles: of the palette alone, and whole."""

    image: F64
    colors_alone: Path
    whole: Path


class Scene:
    """A scene, painted time and again.

    Args:
        name: of `tests.bench.strokes`.
    """

    def __init__(self, name: str) -> None:
        self.source = SCENES[name].source()
        self.memory: dict[str, Memory] = {}

    def prepared(self, look: str = "plain", report: Report | None = None, **options: Any) -> Prepared:
        """As the command prepares it; options are `style`, `adjust` and `strokes`."""
        config = Look.open(look).config
        if style := options.get("style"):
            config = styled(config, style)
        config = replace(
            config,
            view=ViewConfig(size=SIZE),
            cluster=replace(config.cluster, strokes=options.get("strokes", NUM_STROKES)),
            adjust=options.get("adjust", AdjustConfig()),
        )
        if look == "plain":
            config = replace(config, draw=replace(config.draw, streaks=0.0))
        memory = self.memory.setdefault(look, Memory())
        return prepare(self.source, config, report or Report(), memory=memory, on_background=look != "plain")

    def frame(self, look: str = "plain", **options: Any) -> bg.Frame:
        """Its picture."""
        ready = self.prepared(look, **options)
        return ready.painting.frame(ready.camera)


def sliced_distance(one: F64, other: F64) -> float:
    """Sliced Wasserstein distance of colours [n, 3], of which enough are taken."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(3, 64))
    directions /= np.linalg.norm(directions, axis=0)
    at = (np.arange(512) + 0.5) / 512
    few = (
        colors if len(colors) <= MANY else colors[rng.choice(len(colors), MANY)] for colors in (one, other)
    )
    here, there = (np.quantile(colors @ directions, at, axis=0) for colors in few)
    return float(np.sqrt(np.mean((here - there) ** 2)))


def structure(frame: bg.Frame, plain: bg.Frame) -> tuple[float, float, float]:
    """SSIM and correlation of the lengths of the gradients of luma, and contrast, where there is paint."""
    seen = plain.alpha > 0.5
    pictures = [one.over(GROUND) for one in (frame, plain)]
    steps = [sum(np.square(g)[seen].mean() for g in np.gradient(one, axis=(0, 1))) for one in pictures]
    here, there = (np.hypot(*np.gradient(one @ np.array(LUMINANCE))) for one in pictures)
    _, ssim = structural_similarity(
        here, there, data_range=1.0, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True
    )
    edges = np.corrcoef(here[seen], there[seen])[0, 1]
    return float(ssim[seen].mean()), float(edges), float(np.sqrt(steps[0] / steps[1]))


def _straight(frame: bg.Frame) -> F64:
    seen = frame.alpha > 0.5
    return np.clip(frame.rgb[seen] / frame.alpha[seen][:, None], 0, 1).astype(np.float64)


def _whole(frame: bg.Frame) -> F64:
    return np.clip(frame.over((1, 1, 1)), 0, 1).reshape(-1, 3).astype(np.float64)


@contextmanager
def keeping_changes() -> Iterator[list[color_changes.FittedMap]]:
    """The changes of styles that are made meanwhile."""
    kept: list[color_changes.FittedMap] = []
    make: Callable[..., color_changes.FittedMap] = color_changes.style_change

    def kept_change(*args: Any) -> color_changes.FittedMap:
        kept.append(make(*args))
        return kept[-1]

    with patch("brushgs.pipeline.color_changes.style_change", kept_change):
        yield kept


def measure(scene: Scene, name: str, files: dict[str, Files], folder: Path | None) -> list[Row]:
    """The rows of a scene; its pictures in oil side by side go to a folder."""
    plain, oil = scene.frame(), scene.frame("oil")
    colors = _straight(plain)
    rows, pictures = [], [oil]
    for painting, of_it in files.items():
        with keeping_changes() as changes:
            frames = [plain, *(scene.frame(style=f"{of_it.colors_alone}:{share}") for share in SHARES[1:])]
        distances = [sliced_distance(_straight(frame), of_it.image) for frame in frames]
        away = [float(np.abs(_straight(frame) - colors).mean()) for frame in frames]
        whole = scene.frame("oil", style=f"{of_it.whole}")
        pictures.append(whole)
        oil_pair = [sliced_distance(_whole(frame), of_it.image) for frame in (oil, whole)]
        rows.append(
            Row(
                name,
                painting,
                distances[0],
                distances[-1],
                1 - oil_pair[1] / oil_pair[0],
                *structure(frames[-1], plain),
                float(np.corrcoef(SHARES, away)[0, 1]),
                float(-np.corrcoef(SHARES, distances)[0, 1]),
                psnr(_straight(frames[-1]), changes[-1].colors(colors)),
            )
        )
        print(" | ".join(str(cell) for cell in asdict(rows[-1]).values()), flush=True)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        sheet = np.concatenate([np.clip(f.over((1, 1, 1)), 0, 1) for f in pictures], axis=1, dtype=np.float32)
        bg.save(bg.Frame(sheet, np.ones(sheet.shape[:2], np.float32), None), folder / f"style-{name}.png")
    return rows


def adjusted(scene: Scene) -> dict[str, float]:
    """How far adjustments commute with painting, dB."""
    colors = _straight(scene.frame())
    return {
        name: psnr(_straight(scene.frame(adjust=one)), np.clip(adjust_map(one).colors(colors), 0, 1))
        for name, one in ADJUSTMENTS.items()
    }


def seconds(scene: Scene, file: Path) -> float:
    """Of the stage that fits a style and maps the colours of strokes."""
    report = Report()
    scene.prepared(style=f"{file}", strokes=NUM_TIMED, report=report)
    return next(stage.seconds for stage in report.stages if stage.name == "style colours")


def learnt(folder: Path) -> dict[str, Files]:
    """The paintings and their styles."""
    found = {}
    for name, path in write(folder).items():
        image = read_image(path)[..., :3]
        palette = learn_palette(image)
        alone, whole = folder / f"{name}-colors.style", folder / f"{name}.style"
        write_style(Style(name, palette), alone)
        write_style(Style(name, palette, learn_marks(image)), whole)
        found[name] = Files(image.reshape(-1, 3).astype(np.float64), alone, whole)
    return found


def table(rows: list[Row]) -> str:
    """In Markdown."""
    head = ["scene", "painting", "distance", "falls by", "oil", "structure", "edges", "contrast"]
    head += ["dial: colours", "dial: distance", "commutes, dB"]
    cells = [
        [
            row.scene,
            row.painting,
            f"{row.before:.3f} to {row.after:.3f}",
            f"{row.falls:.0%}",
            f"{row.oil_falls:.0%}",
            f"{row.structure:.3f}",
            f"{row.edges:.3f}",
            f"{row.contrast:.2f}",
            f"{row.dial_colors:.4f}",
            f"{row.dial_distance:.3f}",
            f"{row.commutes:.1f}",
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
    others: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        files = learnt(Path(folder))
        for name in args.scenes or PICKED:
            file = SCENES[name].file
            if file is not None and not (SCENES_FOLDER / file).exists():
                print(f"{name} is not here: {SCENES_FOLDER / file}")
                continue
            scene = Scene(name)
            rows += measure(scene, name, files, args.draw)
            others[name] = adjusted(scene)
            others[name]["seconds"] = seconds(scene, next(iter(files.values())).colors_alone)
    print(table(rows))
    cells = [[name, *(f"{row[key]:.0f}" for key in ADJUSTMENTS)] for name, row in others.items()]
    cells = [[*row, f"{others[row[0]]['seconds']:.2f}"] for row in cells]
    print("\n" + markdown([["commutes, dB", *ADJUSTMENTS, "seconds"], *cells]))
    if args.json is not None:
        kept = {"rows": [asdict(row) for row in rows], "others": others}
        args.json.write_text(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main()
