"""What `brushgs refine --style` does: marks, loss, colours and directions on the way, seconds, memory.

    python -m tests.bench.style [SCENE ...] [--paintings hatching ...] [--steps 40] [--json FILE]
    python -m tests.bench.style --memory                 # 1280x720, each in a process of its own
    python -m tests.bench.style --draw examples/measured # of the project's own still life

SCENE is koala, chair or truck (real scenes, if they are here) or still_life. Four paintings of
`tests.bench.mark_paintings`; 2000 strokes in their colours (closed form) are the start of every row.
"Steps alone" moves these by gradient, as the command did before it laid marks; "marks" lays them as marks
(`brushgs.refine.lay`) with brushes cut out of the painting; "marks, steps" is what the command does.

Off: angle between strokes and the painting over the first view, degrees, mean over the painted area (by
chance 45). Length and aspect: of strokes in the first view, medians of the painted area; length is a share
of the shorter side, the painting's own stands in the first line. Loss is that of the refinement in a
validation view. Colours: distance of the mean colour plus that of the roots of the covariances (Frobenius),
of 255. Directions: total variation distance, 0 to 1, of the histograms of edge energy over 8 directions in
picture and painting, mean of 3 scales, only where there is paint all around. Grain: how far neighbouring
edges run the same way, 0 (every way) to 1 (one way). A swirling painting has all directions.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.formats.pictures.images import read_image
from brushgs.passes.color.broken_color import break_colors
from brushgs.passes.color.recolor import Palette, recolor
from brushgs.passes.form.mark_directions import Marks, marks_at
from brushgs.passes.style.marks import learn_marks
from brushgs.refine.filter_bank import REACH, FilterBank, oriented_filters
from brushgs.refine.fit import Drawing, FitSchedule
from brushgs.refine.in_style import BROKEN
from brushgs.refine.lay import Seen, lay_marks
from brushgs.refine.nnfm import Style
from brushgs.refine.painting_style import at_size
from brushgs.refine.style import LAID_RATES, RATES, stylise
from brushgs.refine.targets import TargetView
from brushgs.refine.variables import Variables
from brushgs.refine.views import views_around
from brushgs.still_life import still_life, still_life_camera
from brushgs.values.colors import LUMINANCE
from tests.bench.machine import describe
from tests.bench.mark_paintings import KINDS, write
from tests.scenes import SCENES_FOLDER

SCENES = {
    "koala": ("koala.ply", "-y"),
    "chair": ("derived/chair.ply", "+z"),
    "truck": ("derived/truck.ply", "-y"),
}
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
    """Strokes of one scene on the way to one painting."""

    scene: str
    painting: str
    what: str
    strokes: int
    off: float
    length: float
    aspect: float
    loss: float
    colors: float
    directions: float
    grain: float
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

    def first_view(self, width: int, height: int) -> bg.Camera:
        """What is seen where nothing is said."""
        if self.name == "still_life":
            return still_life_camera(width=width, height=height)
        return frame_scene(self.scene, width=width, height=height, up=self.up)

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


def refine(case: Case, path: Path, steps: int) -> tuple[list[Row], dict[str, tuple[bg.Gaussians, Drawing]]]:
    """Rows of one painting, and the strokes of each with how they are drawn."""
    painting, plain = read_image(path), drawing_with("impasto")
    palette, marks = Palette.of_image(painting), learn_marks(painting)
    training_views, validation_views = (
        case.training_views(palette, n, s) for n, s in ((VIEWS, 0.0), (NUM_VALIDATION_VIEWS, 0.5))
    )
    recolored = recolor(case.strokes, palette)
    small = at_size(painting, min(SIZE))
    pixels = torch.from_numpy(small[..., :3].copy()).permute(2, 0, 1).contiguous()
    style = Style(FilterBank(pixels), pixels)
    first = case.first_view(*SIZE)

    brushes = [bg.StrokeTexture.from_coverage(image) for image in marks.brushes]
    drawing = Drawing.of(bg.BrushSet(tuple(brushes))) if brushes else plain
    shown = recolor(case.scene, palette)
    seen = [Seen.of(shown, camera) for camera in (first, *(view.camera for view in training_views))]
    start = time.perf_counter()
    laid, _ = lay_marks(recolored, marks, seen, float(np.mean(drawing.options.num_sigmas)))
    laid = break_colors(laid, BROKEN * marks.broken_lightness, BROKEN * marks.broken_chroma)
    if brushes:
        chosen = np.random.default_rng(0).integers(0, len(brushes), len(laid))
        laid = replace(laid, brushes=chosen.astype(np.uint8))
    lay_seconds = time.perf_counter() - start

    def fitted(strokes, how, rates):
        schedule = FitSchedule(steps, rates=rates, evaluations=2)
        args = training_views, validation_views, style, small, how, schedule
        after, curve = stylise(Variables(strokes, "all"), *args)
        return after, curve.seconds[-1]

    rows, found = [], {}
    for what in ("recoloured", "steps alone", "marks", "marks, steps"):
        how, seconds = (drawing, lay_seconds) if "marks" in what else (plain, 0.0)
        strokes = laid if "marks" in what else recolored
        if "steps" in what:
            strokes, seconds = fitted(strokes, how, LAID_RATES if "marks" in what else RATES)
        found[what] = strokes, how
        score = stylise(
            Variables(strokes, "colour"), training_views, validation_views[:1], style, small, how,
            FitSchedule(1, evaluations=1),
        )[1].scores[0]  # fmt: skip
        measured = distances(strokes, validation_views, how, small)
        shapes = mark_shapes(strokes, how, first, marks)
        loss = 10 ** (-score / 10)
        rows.append(Row(case.name, path.stem, what, len(strokes), *shapes, loss, *measured, seconds))
    return rows, found


def mark_shapes(strokes, drawing, camera, marks) -> tuple[float, float, float]:
    """How far strokes run off the painting over a view, degrees; their length and their aspect."""
    boxes = bg.project(strokes, camera, num_sigmas=float(np.mean(drawing.options.num_sigmas)))
    inside = ((boxes.centers >= 0) & (boxes.centers < (camera.width, camera.height))).all(axis=1)
    sides = np.sort(boxes.half_extents.astype(np.float64), axis=1)[inside]
    weights = sides.prod(axis=1) * boxes.opacities[inside]
    field = Marks(camera, marks.directions.astype(np.float64))
    pairs = marks_at(field, *boxes.centers[inside].astype(np.float64).T)
    along = boxes.angles[inside] + np.where(np.diff(boxes.half_extents[inside])[:, 0] > 0, np.pi / 2, 0)
    turned = along - 0.5 * np.arctan2(pairs[:, 1], pairs[:, 0])
    off = np.degrees(np.abs((turned + np.pi / 2) % np.pi - np.pi / 2))
    length = 2 * _median(sides[:, 1], weights) / min(camera.width, camera.height)
    aspect = _median(sides[:, 1] / np.maximum(sides[:, 0], 1e-9), weights)
    return float(np.average(off, weights=weights * np.hypot(*pairs.T))), length, aspect


def _median(values, weights) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, 0.5 * sums[-1])])


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
        "scene | painting | what | strokes | off | length | aspect | loss | colours | directions | grain | s"
    ]
    lines.append("-|-|-|-|-|-|-|-|-|-|-|-")
    for r in rows:
        cells = [r.scene, r.painting, r.what, f"{r.strokes:,}", f"{r.off:.0f}", f"{r.length:.3f}"]
        cells += [
            f"{r.aspect:.1f}",
            f"{r.loss:.3f}",
            f"{r.colors:.1f}",
            f"{r.directions:.2f}",
            f"{r.grain:.2f}",
        ]
        lines.append(" | ".join([*cells, f"{r.seconds:.1f}"]))
    return "\n".join(lines)


def draw(folder: Path, paths: dict[str, Path], steps: int) -> list[Row]:
    """Painting, recoloured strokes, steps alone, and marks with steps, side by side, of the still life."""
    case, rows = Case("still_life"), []
    for name, path in paths.items():
        of_painting, found = refine(case, path, steps)
        rows += of_painting
        camera = case.first_view(280, 210)
        painting = torch.from_numpy(read_image(path)[..., :3].copy()).permute(2, 0, 1)[None]
        shown = [F.interpolate(painting, (210, 280), mode="area")[0].permute(1, 2, 0).numpy()]
        for what in ("recoloured", "steps alone", "marks, steps"):
            strokes, drawing = found[what]
            shown.append(drawing.frame(strokes, camera).over((1, 1, 1)))
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
        command = ["refine", scene, "--style", paths["swirls"], "--strokes", "2000", "--stroke", "dry_brush"]
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
    parser.add_argument("--paintings", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--draw", type=Path)
    args = parser.parse_args()
    print(describe() + "\n")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = {name: path for name, path in write(folder).items() if name in args.paintings}
        for name, path in paths.items():
            marks = learn_marks(read_image(path))
            print(f"{name}: length {marks.length:.3f}, aspect {marks.aspect:.1f}")
        if args.memory:
            print(memory(paths, folder))
        elif args.draw is not None:
            print(table(draw(args.draw, paths, args.steps)))
        else:
            names = args.scenes or [n for n, (p, _) in SCENES.items() if (SCENES_FOLDER / p).exists()]
            rows = []
            for case in map(Case, names):
                for path in paths.values():
                    rows += refine(case, path, args.steps)[0]
                    print("\n".join(table(rows[-4:]).splitlines()[2:]), file=sys.stderr, flush=True)
            print(table(rows))
            if args.json is not None:
                args.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))


if __name__ == "__main__":
    main()
