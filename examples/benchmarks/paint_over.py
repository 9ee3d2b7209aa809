"""Paint over a view of a scene: is it kept in that view, and does it stay on the surface beside it?

    python -m examples.benchmarks.paint_over [--scenes still_life koala truck skull plant] [--size 480x360]
                                    [--strokes 2500] [--pictures FOLDER]

A script paints five lines over the subject, 20, 30 (0.6 opaque), 9, 3 and 1.5 pixels wide. Columns:
- thick: least intersection over union of the lines of 12 px and more, each adopted alone, in the same view;
- thin: least share of the outlines of thinner ones within 1.5 px, both ways;
- color: mean difference in OKLab where there is paint, all lines adopted together;
- marks, own: warp error in the view turned by 20 degrees to each side, over the standard deviation of the
  moved picture, within 6 px of the paint: a difference counts relative to what there is to see. `own` are the
  strokes of the scene at the same place, those in front under the paint recolored with it;
- flips: marks whose direction on the picture turns by more than 90 degrees from one of 41 views to the next.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import ndimage

import brushgs as bg
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.warp import View, match_views
from brushgs.options.painting import ClusterConfig, PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.outlets.adopt import overpaint_of
from brushgs.passes.marks.place import Below
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.overpaint import MARKS, Overpainted, coats_of_marks, overpainted
from brushgs.pipeline.prepare import Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.render import render
from brushgs.still_life import still_life
from brushgs.values.arrays import F32, F64, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.sh import base_colors, in_colors
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import FOLDER, present

SCENES = {
    "still_life": None,
    "koala": "koala.ply",
    "truck": "truck.splat",
    "skull": "skull.sog",
    "plant": "plant.splat",
}
# From, to (shares of the subject's rectangle), width in pixels, color, opacity.
LINES = (
    ((0.30, 0.35), (0.62, 0.55), 20.0, (0.95, 0.15, 0.1), 1.0),
    ((0.35, 0.75), (0.65, 0.68), 30.0, (1.0, 0.8, 0.0), 0.6),
    ((0.40, 0.25), (0.60, 0.45), 3.0, (0.1, 0.1, 0.8), 1.0),
    ((0.45, 0.60), (0.58, 0.62), 1.5, (0.0, 0.0, 0.0), 1.0),
    ((0.50, 0.20), (0.52, 0.34), 9.0, (1.0, 1.0, 1.0), 1.0),
)
THICK = 12.0  # px
BESIDE = 6  # px around the paint in which errors count
TURNS = (-20.0, 20.0)
WHITE = np.ones(3)


@dataclass(frozen=True)
class Site:
    """A scene in the view that is painted over."""

    prepared: Prepared
    below: Below
    rectangle: tuple[float, float, float, float]  # of the subject, pixels

    @classmethod
    def of(cls, name: str, size: tuple[int, int], strokes: int) -> "Site":
        """Prepared, with the painting."""
        file = SCENES[name]
        view = ViewConfig(size=size, up=(0, -1, 0)) if file is None else ViewConfig(size=size)
        config = PaintConfig(cluster=ClusterConfig(strokes), view=view)
        source = still_life() if file is None else SceneSource.of(FOLDER / file)
        prepared = prepare(source, config, Report(), asks=("cameras", "scene", "strokes", "painting"))
        y, x = np.nonzero(plain(prepared, prepared.camera).alpha > 0.5)
        left, right = np.percentile(x, (3, 97))
        top, bottom = np.percentile(y, (3, 97))
        return cls(prepared, Below.in_view(prepared.camera, prepared.whole_scene), (left, top, right, bottom))

    def layer(self, lines: Sequence[tuple]) -> F64:
        """[H, W, 4] lines, the later above."""
        camera = self.prepared.camera
        y, x = np.mgrid[: camera.height, : camera.width] + 0.5
        corner, span = np.array(self.rectangle[:2]), np.subtract(self.rectangle[2:], self.rectangle[:2])
        layer = np.zeros((camera.height, camera.width, 4))
        for start, end, width, color, opacity in lines:
            first, way = corner + start * span, (np.subtract(end, start)) * span
            share = np.clip(((x - first[0]) * way[0] + (y - first[1]) * way[1]) / (way @ way), 0, 1)
            away = np.hypot(x - first[0] - share * way[0], y - first[1] - share * way[1])
            alpha = (opacity * np.clip(width / 2 - away + 0.5, 0, 1))[..., None]
            total = alpha + (1 - alpha) * layer[..., 3:]
            mixed = alpha * color + (1 - alpha) * layer[..., 3:] * layer[..., :3]
            layer[..., :3] = np.divide(mixed, total, out=np.zeros_like(mixed), where=total > 0)
            layer[..., 3:] = total
        return layer


def plain(prepared: Prepared, camera: Camera) -> bg.Frame:
    """The scene itself."""
    return render(prepared.whole_scene, camera, StrokeTexture.open("gaussian"))


def with_marks(site: Site, layer: F64) -> Painting:
    """The painting with a layer adopted."""
    prepared, own = site.prepared, site.prepared.painting
    made = overpaint_of(layer.astype(np.float32), None, prepared.whole_scene, prepared.camera)
    coats = overpainted(own.coats, prepared.strokes, Overpainted((made,), made), None, Report())
    return replace(own, coats=tuple(coats))


def in_its_view(site: Site) -> tuple[float, float, float]:
    """Least intersection over union of thick lines, least share of thin outlines, difference in OKLab."""
    camera, ious, shares = site.prepared.camera, [], []
    nothing = site.prepared.strokes.take(slice(0))
    for line in LINES:
        layer = site.layer([line])
        made = overpaint_of(layer.astype(np.float32), None, site.prepared.whole_scene, camera)
        assert made.marks is not None
        alpha = Painting(tuple(coats_of_marks(made.marks, nothing))).frame(camera).alpha
        wanted, shown = layer[..., 3] > 0.5 * line[4], alpha > 0.5 * line[4]
        if line[2] >= THICK:
            ious.append((wanted & shown).sum() / (wanted | shown).sum())
        else:
            shares += [_near(wanted, shown), _near(shown, wanted)]
    layer = site.layer(LINES)
    frame = site.prepared.painting.frame(camera).over(WHITE)
    wanted = layer[..., 3:] * layer[..., :3] + (1 - layer[..., 3:]) * frame
    shown = with_marks(site, layer).frame(camera).over(WHITE)
    away = np.linalg.norm(oklab_of(shown.astype(float)) - oklab_of(wanted.astype(float)), axis=2)
    return float(min(ious)), min(shares), float(away[layer[..., 3] > 0].mean())


def _near(first: Mask, second: Mask) -> float:
    outline = first & ~ndimage.binary_erosion(first)
    return float((ndimage.distance_transform_edt(~second)[outline] <= 1.5).mean())


def recolored(site: Site, layer: F64) -> Painting:
    """The painting with the strokes in front under the paint in its colors."""
    camera, below = site.prepared.camera, site.below

    def changed(coat: Coat) -> Coat:
        strokes = coat.strokes
        if coat.name == BACKDROP or not len(strokes):
            return coat
        place = strokes.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        z = np.maximum(place[:, 2], camera.near)
        x, y = np.floor(((place / z[:, None]) @ camera.K.T)[:, :2]).astype(int).T
        seen = (place[:, 2] > camera.near) & (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
        x, y = np.where(seen, x, 0), np.where(seen, y, 0)
        sizes = np.sqrt(np.sort(strokes.scales, axis=1)[:, 1:].prod(axis=1))
        alpha = layer[y, x, 3:] * (seen & (z < np.exp(below.log_depth[y, x]) + 2 * sizes))[:, None]
        colors = alpha * layer[y, x, :3] + (1 - alpha) * base_colors(strokes.sh)
        painted = in_colors(strokes, colors)
        sh = np.where((alpha > 0)[..., None], 0, strokes.sh)
        sh[:, 0] = np.where(alpha > 0, painted.sh[:, 0], strokes.sh[:, 0])
        return replace(coat, strokes=replace(strokes, sh=sh.astype(strokes.sh.dtype)))

    own = site.prepared.painting
    return replace(own, coats=tuple(map(changed, own.coats)))


def turned(camera: Camera, point: F64, degrees: float) -> Camera:
    """A camera around the upright axis of its picture through a point."""
    angle, axis = np.radians(degrees), camera.viewmat[1, :3]
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    move = np.eye(4)
    move[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    move[:3, 3] = point - move[:3, :3] @ point
    return replace(camera, viewmat=camera.viewmat @ move)


def warp_errors(site: Site, layer: F64, paintings: Sequence[Painting]) -> tuple[list[list[float]], list[F32]]:
    """Of each turn the relative error of each painting; and the pictures."""
    prepared, camera = site.prepared, site.prepared.camera
    beside = ndimage.binary_dilation(layer[..., 3] > 0, iterations=BESIDE).astype(np.float32)
    first, found = [one.frame(camera).over(WHITE) for one in paintings], []
    pictures, at_rest = [first[0]], plain(prepared, camera)
    for degrees in TURNS:
        other = turned(camera, _middle(site, layer), degrees)
        frame = plain(prepared, other)
        nothing = np.zeros((camera.height, camera.width, 3))
        match = match_views(
            View(nothing, at_rest.depth, at_rest.alpha, camera),
            View(nothing, frame.depth, frame.alpha, other),
        )
        rows = match.moved(np.repeat(beside[..., None], 3, axis=2))[:, 0] > 0.5
        errors = []
        for painting, before in zip(paintings, first, strict=True):
            after, moved = painting.frame(other).over(WHITE), match.moved(before)[rows]
            away = moved - after.reshape(-1, 3)[match.pixels][rows]
            errors.append(float(np.sqrt((away**2).mean()) / moved.std(axis=0).mean()))
            pictures.append(after)
        found.append(errors)
    return found, pictures


def _middle(site: Site, layer: F64) -> F64:
    y, x = np.nonzero(layer[..., 3] > 0)
    z = np.median(np.exp(site.below.log_depth[y, x]))
    return site.below.points(np.array([x.mean()]), np.array([y.mean()]), np.array([z]))[0]


def count_flips(site: Site, layer: F64, painting: Painting) -> int:
    """Marks that turn round between two of the views from -20 to 20 degrees, a degree apart."""
    flips, middle = 0, _middle(site, layer)
    for coat in painting.coats:
        if coat.name != MARKS:
            continue
        before: dict[int, float] = {}
        for degrees in np.linspace(*TURNS, 41):
            boxes, _ = coat.boxes(turned(site.prepared.camera, middle, degrees))
            seen = {int(i): float(a) for i, a, o in zip(boxes.ids, boxes.angles, boxes.opacities) if o > 0.02}  # noqa: B905
            flips += sum(np.cos(angle - before[i]) < 0 for i, angle in seen.items() if i in before)
            before = seen
    return flips


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=[*SCENES], choices=[*SCENES])
    parser.add_argument("--size", default="480x360", help="WIDTHxHEIGHT")
    parser.add_argument("--strokes", type=int, default=2500)
    parser.add_argument("--pictures", type=Path, help="write a sheet of each scene to this folder, too")
    options = parser.parse_args()
    print(describe(), flush=True)
    width, height = (int(side) for side in options.size.lower().split("x"))
    print("| scene | thick | thin | color | marks | own | flips |\n|---|---|---|---|---|---|---|")
    for name in present(options.scenes, SCENES):
        site = Site.of(name, (width, height), options.strokes)
        thick, thin, color = in_its_view(site)
        layer = site.layer(LINES)
        marked = with_marks(site, layer)
        errors, pictures = warp_errors(site, layer, [marked, recolored(site, layer)])
        marks, own = (", ".join(f"{error:.2f}" for error in row) for row in zip(*errors, strict=True))
        flips = count_flips(site, layer, marked)
        print(f"| {name} | {thick:.3f} | {thin:.3f} | {color:.3f} | {marks} | {own} | {flips} |", flush=True)
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            sheet = np.concatenate([pictures[1], pictures[0], pictures[3]], axis=1).astype(np.float32)
            bg.save(bg.Frame(sheet, np.ones(sheet.shape[:2], np.float32)), options.pictures / f"{name}.png")


if __name__ == "__main__":
    main()
