"""Where flicker comes from: the warp error of strokes at one step of an orbit, part by part.

    python -m tests.bench.flicker [--scenes koala chair truck] [--texture dry_brush] [--strokes 2000]
                                  [--places 6] [--step-deg 1.5] [--size 500] [--json FILE]

At `--places` places of an orbit around the framed view two pictures are painted `--step-deg` apart, and
`warp.match_views` compares them on white. Strokes are those of the default pipeline (prune 0.7, cluster,
fitted extents, `mip`). The first table has the RMSE, its excess over that of the plain picture, the RMSE of
the worst 1 % of pixels, the same inside boxes that flip or spin when unlocked, and PSNR to the plain picture:
- published: extents of 2 sigma, bilinear, with and without half extents in whole pixels;
- default: each lock, the same boxes at 4 x 4 samples per pixel, the boxes of the second frame in the order of
  the first;
- coverage: a blurred stroke image, one whose ends fade out, analytic kernels, half the opacity, more
  low-pass.

The second table splits the mean squared error M into parts. A and B are the two paintings; P is A evaluated
without pixels, at the exact place of the first view that each pixel of the second one shows. Step by step:
- order: M(A, B) minus M(A, B in the order of A);
- sliding: the remainder after the strokes of P replace those of B. A stroke is flat and lies at the depth of
  its centre, so it moves relative to the surface that it should show. First strokes whose paint lies on
  average within 2 % of the depth of the surface ("near"), then the others ("far"); of each first the slide
  "within" a stroke (curved surface; turning, flipping or foreshortened boxes), then its mean slide, "whole";
- colour: view dependence, M(A, P in the colours of B) minus M(A, P);
- sampling: M(A, P), pixels and their bilinear sampling; the plain picture has it, too.
The parts sum to M(A, B) exactly; another sequence of steps would divide it slightly differently.

Results with 2000 strokes of `dry_brush` on koala, chair and truck, 3 places: 62, 79 and 55 % of M of the
published method is sampling, of which `mip` removes 89 to 90 %. `track` removes 13 % of the remainder on
koala and 11 % on chair, so flips do show in the average. Of what is left on these two, near strokes slide for
25 %, far ones for 46 and 21 %, order is 3 and 14 %, sampling 26 and 41 % (M of the plain picture: 8 and 47 %
of it). With a blurred stroke image the excess is a quarter or less (unlocked, 4 places).
"""

import argparse
import json
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import brushgs as bg
from brushgs.brushes.levels import axis_levels, level_coverage, level_index
from brushgs.cameras.framing import default_elevation, frame_scene, subject
from brushgs.measure.box_events import SPIN
from brushgs.measure.likeness import psnr
from brushgs.measure.warp import View, ViewMatch, match_views
from brushgs.rendering.track import track_directions
from tests.baseline.published import whole_pixels
from tests.bench.machine import describe
from tests.scenes import SCENES_FOLDER

WHITE = (1.0, 1.0, 1.0)
SCENES = {
    "koala": ("koala.ply", (0, -1, 0)),
    "chair": ("derived/chair.ply", (0, 0, 1)),
    "truck": ("derived/truck.ply", (0, -1, 0)),
    "skull": ("derived/skull_sh3.ply", (0, -1, 0)),
}
NEAR_SURFACE = 0.02  # of the depth: strokes further than this from the surface do not show it
F64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene, its strokes, and the pairs of views."""

    name: str
    gaussians: bg.Gaussians
    strokes: bg.Gaussians
    pairs: list[tuple[bg.Camera, bg.Camera]]


def open_scene(name: str, *, strokes: int, size: int, places: int, step: float) -> Scene:
    path, up = SCENES[name]
    gaussians = bg.load(SCENES_FOLDER / path)
    few = bg.cluster(bg.prune(gaussians), strokes)
    cameras = orbit(gaussians, np.asarray(up, float), size, np.arange(places) * 2 * np.pi / places, step)
    return Scene(name, gaussians, few, cameras)


def orbit(
    gaussians: bg.Gaussians, up: F64, size: int, azimuths: F64, step: float
) -> list[tuple[bg.Camera, bg.Camera]]:
    """Pairs of cameras: the framed view turned about the up axis through the middle of the subject."""
    points, _ = subject(gaussians)
    elevation = default_elevation(points, up)
    framed = frame_scene(gaussians, width=size, height=size, up=up, elevation=elevation)
    middle = np.median(points, axis=0)
    return [(turned(framed, up, middle, a), turned(framed, up, middle, a + step)) for a in azimuths]


def turned(camera: bg.Camera, axis: F64, middle: F64, angle: float) -> bg.Camera:
    """The camera rotated about an axis through a point."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    turn = np.eye(4)
    turn[:3, :3] = rotation.T
    turn[:3, 3] = middle - rotation.T @ middle
    return replace(camera, viewmat=camera.viewmat @ turn)


def plain_view(gaussians: bg.Gaussians, camera: bg.Camera) -> View:
    frame = bg.render(gaussians, camera, bg.StrokeTexture.open("gaussian"))
    assert frame.depth is not None
    return View(frame.over(WHITE), frame.depth, frame.alpha, camera)


# -- painting ----------------------------------------------------------------------------------------------


def paint(boxes: bg.Boxes, texture: bg.StrokeTexture, camera: bg.Camera, filter: str = "mip") -> Any:
    size = {"height": camera.height, "width": camera.width}
    return bg.rasterize(boxes, texture, filter=filter, depth=False, **size).over(WHITE)


def paint_fine(boxes: bg.Boxes, texture: bg.StrokeTexture, camera: bg.Camera, factor: int = 4) -> Any:
    """The same boxes at factor x factor bilinear samples per pixel, averaged."""
    large = replace(boxes, centers=boxes.centers * factor, half_extents=boxes.half_extents * factor)
    size = {"height": camera.height * factor, "width": camera.width * factor}
    fine = bg.rasterize(large, texture, filter="bilinear", depth=False, **size).over(WHITE)
    return fine.reshape(camera.height, factor, camera.width, factor, 3).mean(axis=(1, 3))


def in_order_of(first: bg.Boxes, second: bg.Boxes) -> bg.Boxes:
    """The second boxes in the order of the first; boxes that the first lacks keep their own depth."""
    depth_of = dict(zip(first.ids.tolist(), first.depths.tolist(), strict=True))
    keys = [depth_of.get(i, d) for i, d in zip(second.ids.tolist(), second.depths.tolist(), strict=True)]
    return ordered(second, np.array(keys))


def in_colors_of(second: bg.Boxes, first: bg.Boxes) -> bg.Boxes:
    """The first boxes with the colours of their strokes in the second frame."""
    colors = np.array(first.colors)
    _, i, j = np.intersect1d(first.ids, second.ids, assume_unique=True, return_indices=True)
    colors[i] = second.colors[j]
    return replace(first, colors=colors)


def ordered(boxes: bg.Boxes, keys: NDArray[Any]) -> bg.Boxes:
    """The boxes sorted by a key, which replaces their depth."""
    order = np.argsort(keys, kind="stable")
    columns = {f: getattr(boxes, f) for f in boxes.__dataclass_fields__ if f != "depths"}
    columns = {f: None if column is None else column[order] for f, column in columns.items()}
    return bg.Boxes(**columns, depths=keys[order].astype(boxes.depths.dtype))


def variants(scene: Scene, texture: bg.StrokeTexture) -> dict[str, Callable[[bg.Camera, bg.Camera], Any]]:
    """The first table by name: how the two pictures of a pair are made."""

    def pair(
        texture: bg.StrokeTexture,
        *,
        sigmas: float | None = None,
        filter: str = "mip",
        lock: str = "off",
        low_pass: float = 0.3,
        strokes: bg.Gaussians = scene.strokes,
        painter: Any = None,
        change: Callable[[bg.Boxes, bg.Boxes], tuple[bg.Boxes, bg.Boxes]] | None = None,
    ) -> Callable[[bg.Camera, bg.Camera], Any]:
        sigmas = texture.fitted_sigmas if sigmas is None else sigmas

        def make(*cameras: bg.Camera) -> Any:
            locks = locks_of(lock, strokes, cameras)
            boxes = [
                bg.project(strokes, camera, num_sigmas=sigmas, low_pass=low_pass, lock=way)
                for camera, way in zip(cameras, locks, strict=True)
            ]
            if change is not None:
                boxes = list(change(*boxes))
            draw = painter or (lambda b, t, c: paint(b, t, c, filter))
            return [draw(b, texture, c) for b, c in zip(boxes, cameras, strict=True)]

        return make

    fitted = texture.fitted_sigmas
    frozen = {"change": lambda a, b: (a, in_order_of(a, b))}
    rounded = {"change": lambda a, b: (whole_pixels(a), whole_pixels(b))}
    ellipse = bg.StrokeTexture.open("ellipse")
    faint = replace(scene.strokes, opacities=scene.strokes.opacities / 2)
    return {
        "published, whole pixels": pair(texture, sigmas=2.0, filter="bilinear", **rounded),
        "published": pair(texture, sigmas=2.0, filter="bilinear"),
        "published, mip": pair(texture, sigmas=2.0),
        "published, 4 x 4": pair(texture, sigmas=2.0, painter=paint_fine),
        "default, bilinear": pair(texture, filter="bilinear"),
        "default": pair(texture),
        "default, anchor": pair(texture, lock="anchor"),
        "default, track": pair(texture, lock="track"),
        "default, 4 x 4": pair(texture, painter=paint_fine),
        "default, order frozen": pair(texture, **frozen),
        "blurred stroke": pair(blurred(texture, 12), sigmas=fitted),
        "blurred, order frozen": pair(blurred(texture, 12), sigmas=fitted, **frozen),
        "faded ends": pair(faded(texture), sigmas=fitted),
        "ellipse": pair(ellipse, sigmas=fitted),
        "gaussian": pair(bg.StrokeTexture.open("gaussian")),
        "half opacity": pair(texture, strokes=faint),
        "low-pass 2 px^2": pair(texture, low_pass=2.0),
    }


def locks_of(lock: str, strokes: bg.Gaussians, cameras: Sequence[bg.Camera]) -> list[Any]:
    """The `lock` of `project` in each view of a short path."""
    if lock != "track":
        return [lock] * len(cameras)
    path = track_directions(strokes, cameras)
    return [path.directions(index) for index in range(len(cameras))]


def blurred(texture: bg.StrokeTexture, sigma: float) -> bg.StrokeTexture:
    from scipy.ndimage import gaussian_filter

    return bg.StrokeTexture.from_coverage(gaussian_filter(texture.coverage / 255.0, sigma, mode="constant"))


def faded(texture: bg.StrokeTexture) -> bg.StrokeTexture:
    """Coverage faded to zero over the outer fifth of each side."""
    ramps = [
        np.interp(np.linspace(-1, 1, n), (-1, -0.6, 0.6, 1), (0, 1, 1, 0)) for n in texture.coverage.shape
    ]
    return bg.StrokeTexture.from_coverage(texture.coverage / 255.0 * np.outer(*ramps))


# -- a painting without pixels -----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Slides:
    """How the fragments of strokes slid between two frames, one row each."""

    weights: F64  # [n] weight of the fragment in the picture
    slides: F64  # [n, 2] along and across the stroke, pixels
    wholes: F64  # [n, 2] the mean slide of its stroke
    depth_errors: F64  # [n] depth of the stroke over that of the surface, minus 1


class Canvas:
    """Paints boxes of a first view at the places that the pixels of a second view show."""

    def __init__(self, at: F64, texture: bg.StrokeTexture, filter: str) -> None:
        self.texture, self.filter = texture, filter
        self.height, self.width = at.shape[:2]
        self.is_valid = np.isfinite(at).all(axis=-1)
        self.pixels = np.stack(np.meshgrid(np.arange(self.width), np.arange(self.height)), axis=-1) + 0.5
        self.at = np.where(self.is_valid[..., None], at, -1e9)
        moves = (at - self.pixels)[self.is_valid]
        self.low_move, self.high_move = moves.min(axis=0), moves.max(axis=0)

    def paint(
        self,
        boxes: bg.Boxes,
        after: bg.Boxes | None = None,
        depth: Any = None,
        *,
        near: str = "mean",
        far: str = "mean",
    ) -> tuple[F64, Slides | None]:
        """The picture [H, W, 3] on white.

        With the boxes `after`, strokes near the surface and those far from it are drawn unmoved ("none"),
        moved by their mean slide ("mean"), or as `after` has them ("all").
        """
        rgb, light = np.zeros((self.height, self.width, 3)), np.ones((self.height, self.width))
        later = {} if after is None else {int(row_id): row for row, row_id in enumerate(after.ids)}
        fragments: list[tuple[F64, ...]] = []
        for k in range(len(boxes)):
            texels, reach = self.texels_of(boxes.half_extents[k].astype(float))
            window = self.window_of(boxes, k, reach)
            local = (self.at[window] - boxes.centers[k]) @ axes_of(boxes, k).T  # pixels along u, v
            if local.size == 0:
                continue
            opacity, left = float(boxes.opacities[k]), light[window]
            if int(boxes.ids[k]) in later:
                j = later[int(boxes.ids[k])]
                now = (self.pixels[window] - after.centers[j]) @ axes_of(after, j).T
                slide = now * (boxes.half_extents[k] / after.half_extents[j]) - local
                weight = opacity * sample(texels, local / reach) * left * self.is_valid[window]
                if weight.max() > 1 / 255:
                    whole = np.tensordot(weight, slide, ((0, 1), (0, 1))) / weight.sum()
                    rows = weight > 1 / 255
                    error = after.depths[j] / depth[window][rows] - 1
                    fragments.append((weight[rows], slide[rows], np.tile(whole, (rows.sum(), 1)), error))
                    is_far = abs(np.average(error, weights=weight[rows])) > NEAR_SURFACE
                    moved = far if is_far else near
                    local = local + (0 if moved == "none" else whole if moved == "mean" else slide)
            alpha = np.minimum(0.99, opacity * sample(texels, local / reach))
            alpha *= (alpha >= 1 / 255) * self.is_valid[window]
            rgb[window] += (alpha * left)[..., None] * boxes.colors[k]
            light[window] = left * (1 - alpha)
        slides = (
            Slides(*(np.concatenate(column) for column in zip(*fragments, strict=True))) if later else None
        )
        return rgb + light[..., None] * WHITE, slides

    def texels_of(self, half: F64) -> tuple[F64, F64]:
        """The texels of the mip level of a box, 0 to 1, and the half extents that they span."""
        rows, columns = self.texture.coverage.shape
        u, v = (0, 0)
        if self.filter == "mip":
            u, v = level_index(half[0], columns), level_index(half[1], rows)
        scale = np.array([axis_levels(columns)[u].scale, axis_levels(rows)[v].scale])
        return level_coverage_of(self.texture, u, v), half * scale

    def window_of(self, boxes: bg.Boxes, k: int, reach: F64) -> tuple[slice, slice]:
        """Rows and columns of the second view's pixels that may show the box."""
        bound = np.abs(axes_of(boxes, k).T) @ reach + 4  # room for the mean slide
        size = (self.width, self.height)
        low = np.floor(boxes.centers[k] - bound - self.high_move).clip(0, size).astype(int)
        high = np.ceil(boxes.centers[k] + bound - self.low_move).clip(0, size).astype(int)
        return slice(low[1], max(low[1], high[1])), slice(low[0], max(low[0], high[0]))


def axes_of(boxes: bg.Boxes, k: int) -> F64:
    """[2, 2] rows u and v of a box."""
    c, s = np.cos(float(boxes.angles[k])), np.sin(float(boxes.angles[k]))
    return np.array([[c, s], [-s, c]])


_levels: dict[tuple[int, int, int], F64] = {}


def level_coverage_of(texture: bg.StrokeTexture, u: int, v: int) -> F64:
    key = (id(texture), u, v)
    if key not in _levels:
        _levels[key] = level_coverage(texture.coverage, u, v) / 255.0
    return _levels[key]


def sample(texels: F64, st: F64) -> F64:
    """Bilinear coverage at [..., 2] box coordinates in -1 to 1, 0 outside."""
    rows, columns = texels.shape
    is_inside = (np.abs(st) < 1).all(axis=-1)
    x = np.clip((st[..., 0] + 1) / 2, 0, 1) * (columns - 1)
    y = np.clip((st[..., 1] + 1) / 2, 0, 1) * (rows - 1)
    i, j = np.minimum(y.astype(int), max(0, rows - 2)), np.minimum(x.astype(int), max(0, columns - 2))
    i1, j1 = np.minimum(i + 1, rows - 1), np.minimum(j + 1, columns - 1)
    fx, fy = x - j, y - i
    above = texels[i, j] * (1 - fx) + texels[i, j1] * fx
    below = texels[i1, j] * (1 - fx) + texels[i1, j1] * fx
    return np.where(is_inside, above * (1 - fy) + below * fy, 0.0)


def places(match: ViewMatch) -> F64:
    """[H, W, 2] where in the first view each valid pixel of the second lies, NaN elsewhere."""
    at = np.full((*match.second_size, 2), np.nan)
    rows, columns = np.divmod(match.corners, match.first_size[1])
    at.reshape(-1, 2)[match.pixels] = np.stack([columns, rows], axis=1) + match.shares + 0.5
    return at


# -- the tables --------------------------------------------------------------------------------------------


PARTS = ("order", "near, within", "near, whole", "far, within", "far, whole", "colour", "sampling")


@dataclass(frozen=True)
class Total:
    """One row of the first table: means over the pairs."""

    rmse: float
    excess: float
    worst_1pct: float
    turned: float  # inside boxes that flip or spin when unlocked
    psnr: float


def totals(scene: Scene, texture: bg.StrokeTexture, plain: list[tuple[View, View]]) -> dict[str, Total]:
    matches = [match_views(*views) for views in plain]
    masks = [turned_boxes(scene.strokes, texture, *cameras) for cameras in scene.pairs]
    makers: dict[str, Any] = {"plain": None, **variants(scene, texture)}
    rows: dict[str, Total] = {}
    for name, make in makers.items():
        figures = []
        for cameras, match, views, mask in zip(scene.pairs, matches, plain, masks, strict=True):
            first, second = (view.rgb for view in views) if make is None else make(*cameras)
            error = match.error(first, second, keep_map=True)
            assert error.squared_error is not None
            inside = np.sqrt(np.nanmean(np.where(mask, error.squared_error, np.nan)))
            quality = psnr(np.clip(first, 0, 1), np.clip(views[0].rgb, 0, 1))
            figures.append((error.rmse, error.worst_1pct, float(inside), quality))
        rmse, worst, inside, quality = np.mean(figures, axis=0).tolist()
        own = rows["plain"].rmse if rows else rmse
        rows[name] = Total(rmse, rmse - own, worst, inside, quality)
    return rows


def turned_boxes(strokes: bg.Gaussians, texture: bg.StrokeTexture, *cameras: bg.Camera) -> NDArray[np.bool_]:
    """[H, W] the second view's pixels inside boxes that flip or spin between two views when unlocked."""
    first, second = (bg.project(strokes, camera, num_sigmas=texture.fitted_sigmas) for camera in cameras)
    _, i, j = np.intersect1d(first.ids, second.ids, assume_unique=True, return_indices=True)
    steps = np.remainder(second.angles[j] - first.angles[i] + np.pi, 2 * np.pi) - np.pi
    rows = np.sort(j[np.abs(steps) > SPIN])
    boxes = replace(second.take(rows), opacities=np.ones(len(rows), second.opacities.dtype))
    solid = bg.StrokeTexture.from_coverage(np.ones((2, 2)))
    size = {"height": cameras[1].height, "width": cameras[1].width}
    return bg.rasterize(boxes, solid, filter="nearest", depth=False, **size).alpha > 0


def parts(
    scene: Scene,
    texture: bg.StrokeTexture,
    plain: list[tuple[View, View]],
    *,
    sigmas: float,
    filter: str,
    lock: str = "off",
) -> tuple[dict[str, float], Slides]:
    """Mean squared errors over the pairs, and the slides of the last one."""
    squares: dict[str, list[float]] = defaultdict(list)
    slides = None
    for cameras, views in zip(scene.pairs, plain, strict=True):
        match = match_views(*views)
        locks = locks_of(lock, scene.strokes, cameras)
        first, second = (
            bg.project(scene.strokes, camera, num_sigmas=sigmas, lock=way)
            for camera, way in zip(cameras, locks, strict=True)
        )
        a, b = (paint(boxes, texture, c, filter) for boxes, c in zip((first, second), cameras, strict=True))
        frozen = paint(in_order_of(first, second), texture, cameras[1], filter)
        canvas = Canvas(places(match), texture, filter)
        tinted = in_colors_of(second, first)
        steps = [b, frozen]
        for near, far in (("mean", "all"), ("none", "all"), ("none", "mean")):
            picture, slides = canvas.paint(tinted, second, views[1].depth, near=near, far=far)
            steps.append(picture)
        steps += [canvas.paint(tinted)[0], canvas.paint(first)[0]]
        errors = [match.error(a, picture).rmse ** 2 for picture in steps]
        for part, low, high in zip(PARTS, [*errors[1:], 0.0], errors, strict=True):
            squares[part].append(high - low)
        squares["total"].append(errors[0])
        squares["plain"].append(match.error(views[0].rgb, views[1].rgb).rmse ** 2)
    assert slides is not None
    return {name: float(np.mean(values)) for name, values in squares.items()}, slides


def print_totals(rows: dict[str, Total]) -> None:
    print(f"  {'':24} {'rmse':>7} {'excess':>8} {'worst 1%':>8} {'turned':>7} {'PSNR':>6}")
    for name, row in rows.items():
        figures = (
            f"{row.rmse:7.4f} {row.excess:+8.4f} {row.worst_1pct:8.4f} {row.turned:7.4f} {row.psnr:6.2f}"
        )
        print(f"  {name:24} {figures}")


def print_parts(title: str, squares: dict[str, float]) -> None:
    total = squares["total"]
    shares = ", ".join(f"{part} {squares[part] / total:.1%}" for part in (*PARTS, "plain"))
    print(f"  {title}: M = {total * 1e6:.0f}e-6, rmse {np.sqrt(total):.4f}: {shares}")


def print_slides(slides: Slides) -> None:
    """Root mean square slide of the paint, by the place of the stroke relative to the surface."""
    weights = slides.weights / slides.weights.sum()
    lengths, wholes = ((column**2).sum(axis=1) for column in (slides.slides, slides.wholes))
    print(
        f"    slide {np.sqrt(weights @ lengths):.2f} px, of whole strokes {np.sqrt(weights @ wholes):.2f} px"
    )
    errors = slides.depth_errors
    for words, rows in (
        ("before", errors < -NEAR_SURFACE),
        ("near", np.abs(errors) <= NEAR_SURFACE),
        ("behind", errors > NEAR_SURFACE),
    ):
        share = max(weights[rows].sum(), 1e-12)
        rms, whole = (np.sqrt(weights[rows] @ squares[rows] / share) for squares in (lengths, wholes))
        print(
            f"      {words:6} the surface: {share:6.1%} of the paint, slides {rms:.2f}, whole {whole:.2f} px"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=["koala", "chair", "truck"])
    parser.add_argument("--texture", default="dry_brush")
    parser.add_argument("--strokes", type=int, default=2000)
    parser.add_argument("--places", type=int, default=6)
    parser.add_argument("--step-deg", type=float, default=1.5)
    parser.add_argument("--size", type=int, default=500)
    parser.add_argument("--json", type=Path, help="write the figures to this file, too")
    arguments = parser.parse_args()
    print(describe(), flush=True)
    texture = bg.StrokeTexture.open(arguments.texture)
    figures: dict[str, dict[str, Any]] = {}
    for name in arguments.scenes:
        scene = open_scene(
            name,
            strokes=arguments.strokes,
            size=arguments.size,
            places=arguments.places,
            step=np.radians(arguments.step_deg),
        )
        plain = [(plain_view(scene.gaussians, a), plain_view(scene.gaussians, b)) for a, b in scene.pairs]
        print(name)
        rows = totals(scene, texture, plain)
        print_totals(rows)
        figures[name] = {"totals": {title: asdict(row) for title, row in rows.items()}}
        for title, sigmas, filter, lock in (
            ("published", 2.0, "bilinear", "off"),
            ("default, off", texture.fitted_sigmas, "mip", "off"),
            ("default, track", texture.fitted_sigmas, "mip", "track"),
        ):
            squares, slides = parts(scene, texture, plain, sigmas=sigmas, filter=filter, lock=lock)
            print_parts(title, squares)
            print_slides(slides)
            figures[name][title] = squares
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
