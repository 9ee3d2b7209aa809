"""What `brushgs refine --style` does: loss, colours and directions before and after, seconds, memory.

    python -m tests.bench.style [SCENE ...] [--strokes-images dry_brush flat] [--steps 80] [--json FILE]
    python -m tests.bench.style --memory                 # 1280x720, each in a process of its own
    python -m tests.bench.style --draw examples/measured # before and after, of the project's own still life

SCENE is koala or chair (real scenes, if they are here) or still_life. 2000 strokes, three paintings of
`tests.bench.paintings`. "Before" are the strokes in the painting's colours (closed form), not refined. Loss
is that of the refinement, in 3 validation views. Colours: distance of the mean colour plus that of the
roots of the covariances (Frobenius), of 255. Directions: total variation distance, 0 to 1, of the histograms
of edge energy over 8 directions in picture and painting, mean of 3 scales, only where there is paint all
around. Grain: how far neighbouring edges run the same way, 0 (every way) to 1 (one way), before, after and in
the painting. A swirling painting has all directions, and only the grain separates strokes from noise.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812

import brushgs as bg
from brushgs.colors import LUMINANCE
from brushgs.io.pictures.images import read_image
from brushgs.passes.recolor import Palette, recolor
from brushgs.refine.filter_bank import REACH, FilterBank, oriented_filters
from brushgs.refine.fit import Drawing, FitSchedule
from brushgs.refine.nnfm import Style
from brushgs.refine.style import RATES, stylise
from brushgs.refine.targets import TargetView
from brushgs.refine.variables import Variables
from brushgs.refine.views import views_around
from brushgs.still_life import still_life, still_life_camera
from tests.bench.machine import describe
from tests.bench.paintings import PAINTINGS, write
from tests.scenes import SCENES_FOLDER

SCENES = {"koala": ("koala.ply", "-y"), "chair": ("derived/chair.ply", "+z")}
NUM_STROKES, SIZE, VIEWS, NUM_VALIDATION_VIEWS = 2000, (224, 168), 12, 3
CHILD = """
import resource, sys
import brushgs.refine.run as run
from brushgs.cli import main
run.NUM_VALIDATION_VIEWS = 1
main(sys.argv[1:])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
PATCH = 9  # pixels of a scale, that are neighbours
VGG_16 = (64, 64, 0, 128, 128, 0, 256, 256, 256)


@dataclass(frozen=True)
class Row:
    """One scene toward one painting."""

    scene: str
    stroke: str
    painting: str
    loss: tuple[float, float]
    colors: tuple[float, float]
    directions: tuple[float, float]
    grain: tuple[float, float, float]
    steps: int
    seconds: float


class Case:
    """A scene with its strokes, ready for any painting."""

    def __init__(self, name: str) -> None:
        self.name, self.up = name, "-y"
        if name == "still_life":
            self.scene = still_life()
        else:
            path, self.up = SCENES[name]
            self.scene = bg.load(SCENES_FOLDER / path)
        self.strokes = bg.cluster(bg.prune(self.scene, 0.7), NUM_STROKES)

    def training_views(self, palette: Palette, num: int, shift: float, size=SIZE) -> list[TargetView]:
        scene = recolor(self.scene, palette)
        if self.name == "still_life":  # composed for one side: others show the wall from behind
            angles = np.linspace(-0.25, 0.25, num) + 0.3 * shift / num
            cameras = [_beside(still_life_camera(width=size[0], height=size[1]), a) for a in angles]
        else:
            cameras = views_around(self.scene, num, width=size[0], height=size[1], up=self.up, shift=shift)
        return [TargetView.of(scene, camera) for camera in cameras]


def _beside(camera: bg.Camera, angle: float) -> bg.Camera:
    """The camera gone around the upright axis."""
    turn = np.eye(4)
    turn[0, 0] = turn[2, 2] = np.cos(angle)
    turn[0, 2], turn[2, 0] = np.sin(angle), -np.sin(angle)
    return bg.Camera(camera.viewmat @ turn, camera.K, camera.width, camera.height)


def drawing_with(stroke: str) -> Drawing:
    """The stroke as the command line draws it."""
    texture = bg.StrokeTexture.open(stroke)
    return Drawing.of(texture)


def refine(case: Case, path: Path, stroke: str, steps: int) -> tuple[Row, bg.Gaussians, bg.Gaussians]:
    """The row, and the strokes before and after."""
    painting, drawing = read_image(path), drawing_with(stroke)
    palette = Palette.of_image(painting)
    training_views, validation_views = (
        case.training_views(palette, n, s) for n, s in ((VIEWS, 0.0), (NUM_VALIDATION_VIEWS, 0.5))
    )
    before = recolor(case.strokes, palette)
    pixels = torch.from_numpy(painting[..., :3].copy()).permute(2, 0, 1).contiguous()
    style = Style(FilterBank(pixels), pixels)
    schedule = FitSchedule(steps, rates=RATES)
    after, curve = stylise(
        Variables(before, "all"), training_views, validation_views, style, painting, drawing, schedule
    )
    losses = [10 ** (-score / 10) for score in (curve.scores[0], max(curve.scores))]
    found = [distances(strokes, validation_views, drawing, painting) for strokes in (before, after)]
    (colors, directions, grain) = zip(*found, strict=True)
    grain = *grain, _grain(_energies(painting[..., :3], np.ones(painting.shape[:2])))
    ran = curve.steps[-1], curve.seconds[-1]
    return Row(case.name, stroke, path.stem, tuple(losses), colors, directions, grain, *ran), before, after


def distances(strokes, validation_views, drawing, painting) -> tuple[float, float, float]:
    """Distance of the colours, of 255, and of the directions, 0 to 1; grain of the strokes."""
    background = painting[..., :3].mean(axis=(0, 1))
    colors, weights, energies = [], [], 0.0
    for view in validation_views:
        frame = drawing.frame(strokes, view.camera)
        shown = frame.alpha > 0.05
        colors.append(np.clip(frame.rgb[shown] / frame.alpha[shown][:, None], 0, 1))
        weights.append(frame.alpha[shown])
        energies = energies + _energies(frame.over(background), frame.alpha)
    own = Palette.of_colors(np.concatenate(colors), np.concatenate(weights), space="srgb")
    wanted = Palette.of_image(painting, space="srgb")
    spread = np.linalg.norm(_root(own.covariance) - _root(wanted.covariance))
    away = 255 * (np.linalg.norm(own.mean - wanted.mean) + spread)
    there = _energies(painting[..., :3], np.ones(painting.shape[:2]))
    turned = 0.5 * np.abs(_shares(energies) - _shares(there)).sum(axis=1).mean()
    return float(away), float(turned), _grain(energies)


def _energies(picture, alpha):
    """[3, 9] energy of edges by scale and direction, and of what patches agree on, where all is painted."""
    angles = 2 * np.pi * np.arange(8) / 8  # of a half turn, doubled
    axes = torch.tensor(np.stack([np.cos(angles), np.sin(angles)]), dtype=torch.float32)
    luminance = torch.from_numpy(np.asarray(picture @ np.array(LUMINANCE), dtype=np.float32))[None, None]
    painted, found = torch.from_numpy((alpha > 0.5).astype(np.float32))[None, None], []
    for scale in (1, 2, 4):
        padded = F.pad(F.avg_pool2d(luminance, scale), (REACH,) * 4, mode="replicate")
        energy = F.conv2d(padded, oriented_filters()[:8, None])[0].square()
        inside = 1 - F.max_pool2d(1 - F.avg_pool2d(painted, scale), 2 * REACH + 1, 1, REACH)[0]
        energy = energy * (inside > 0.99)
        agreed = F.avg_pool2d(torch.einsum("ak,khw->ahw", axes, energy), PATCH)
        both = F.avg_pool2d(energy, PATCH).sum().clamp_min(1e-12)
        whole = energy.sum(dim=(1, 2))
        found.append(torch.cat([whole, (whole.sum() * agreed.norm(dim=0).sum() / both)[None]]))
    return torch.stack(found).numpy()


def _shares(energies):
    directions = energies[:, :8]
    return directions / np.maximum(directions.sum(axis=1, keepdims=True), 1e-12)


def _grain(energies) -> float:
    return float((energies[:, 8] / np.maximum(energies[:, :8].sum(axis=1), 1e-12)).mean())


def _root(covariance):
    values, axes = np.linalg.eigh(covariance)
    return (axes * np.sqrt(np.maximum(values, 0))) @ axes.T


def table(rows: list[Row]) -> str:
    """In Markdown."""
    lines = [
        "scene | stroke | painting | loss | falls | colours | directions | grain | steps | seconds a step"
    ]
    lines.append("-|-|-|-|-|-|-|-|-|-")
    for r in rows:
        cells = [r.scene, r.stroke, r.painting, _change(r.loss, 3), f"{1 - r.loss[1] / r.loss[0]:.0%}"]
        cells += [_change(r.colors, 1), _change(r.directions, 2), f"{_change(r.grain, 2)} ({r.grain[2]:.2f})"]
        lines.append(" | ".join([*cells, str(r.steps), f"{r.seconds / r.steps:.2f}"]))
    return "\n".join(lines)


def _change(pair, digits: int) -> str:
    return f"{pair[0]:.{digits}f} to {pair[1]:.{digits}f}"


def draw(folder: Path, paths: dict[str, Path], steps: int) -> list[Row]:
    """Painting, before and after side by side, of the still life."""
    case, rows = Case("still_life"), []
    for name, path in paths.items():
        row, *pair = refine(case, path, "dry_brush", steps)
        rows.append(row)
        camera, drawing = still_life_camera(width=280, height=210), drawing_with("dry_brush")
        painting = torch.from_numpy(read_image(path)[..., :3].copy()).permute(2, 0, 1)[None]
        shown = [F.interpolate(painting, (210, 280), mode="area")[0].permute(1, 2, 0).numpy()]
        shown += [drawing.frame(s, camera).over((1, 1, 1)) for s in pair]
        sheet = np.clip(np.concatenate(shown, axis=1), 0, 1).astype(np.float32)
        _save_jpeg(sheet, folder / f"style-{name}.jpg")
    return rows


def _save_jpeg(picture, path: Path) -> None:
    import OpenImageIO as oiio  # noqa: N813

    height, width, _ = picture.shape
    spec = oiio.ImageSpec(width, height, 3, "uint8")
    spec.attribute("compression", "jpeg:80")
    output = oiio.ImageOutput.create(str(path))
    if not output.open(str(path), spec) or not output.write_image(np.rint(255 * picture).astype(np.uint8)):
        raise OSError(f"{path}: {output.geterror() or oiio.geterror()}")
    output.close()


def memory(paths: dict[str, Path], folder: Path) -> str:
    """Peak of a process that does one refinement by the command line, with one validation view."""
    scene, weights = folder / "scene.ply", folder / "vgg.pth"
    bg.save(still_life(), scene)
    save_random_vgg(weights)
    lines = ["features | size | peak memory | seconds a step", "-|-|-|-"]
    for label, extra in (("without weights", ()), ("VGG-16, random weights", ("--vgg-weights", weights))):
        command = ["refine", scene, "--style", paths["night"], "--strokes", "2000", "--stroke", "dry_brush"]
        command += ["--size", "1280x720", "--views", "1", "--steps", "1", *extra, "-o", folder / "out.ply"]
        run = subprocess.run(
            [sys.executable, "-c", CHILD, *map(str, command), "--json"],
            capture_output=True,
            text=True,
            check=True,
        )
        report, peak = run.stdout.strip().rsplit("\n", 1)
        seconds = json.loads(re.search(r'"curve_seconds": (\[[^]]*\])', report)[1])
        lines.append(f"{label} | 1280x720 | {int(peak) / 2**20:.2f} GB | {seconds[-1]:.1f}")
        print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines)


def save_random_vgg(path: Path) -> None:
    """A file of torchvision's layout of VGG-16 as far as it is read, random (He et al. 2015)."""
    torch.manual_seed(0)
    state, place, channels = {}, 0, 3
    for width in VGG_16:
        if width == 0:
            place += 1
            continue
        state[f"features.{place}.weight"] = torch.randn(width, channels, 3, 3) * (2 / (9 * channels)) ** 0.5
        state[f"features.{place}.bias"] = torch.zeros(width)
        place, channels = place + 2, width
    torch.save(state, path)


def main() -> None:
    """As the docstring of the module says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--strokes-images", nargs="+", default=["dry_brush", "flat"])
    parser.add_argument("--steps", type=int, default=80)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--draw", type=Path)
    args = parser.parse_args()
    print(describe() + "\n")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = write(folder)
        if args.memory:
            print(memory(paths, folder))
        elif args.draw is not None:
            print(table(draw(args.draw, paths, args.steps)))
        else:
            names = args.scenes or [n for n, (p, _) in SCENES.items() if (SCENES_FOLDER / p).exists()]
            rows = []
            for case in map(Case, names):
                for stroke in args.strokes_images:
                    for painting in PAINTINGS:
                        rows.append(refine(case, paths[painting], stroke, args.steps)[0])
                        print(table(rows[-1:]).splitlines()[-1], file=sys.stderr, flush=True)
            print(table(rows))
            if args.json is not None:
                args.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))


if __name__ == "__main__":
    main()
