"""The cost of sorting strokes by depth in moving pictures, and that of other orders: a study.

    python -m tests.bench.order [--scenes koala chair truck] [--texture dry_brush] [--places 6] [--no-psnr]

Views and strokes are those of `tests.bench.flicker`; g is the size of a stroke: the geometric mean of its two
larger scales. Strokes are sorted by one of these instead of depth:
- radial: distance to the eye;
- size B: depth + B g, so that details lie in front;
- random B: depth + B x median g x a random number of each stroke, -0.5 to 0.5, that never changes;
- mean B x K: the mean of K pictures, each by depth + B g x normal random numbers fixed by stroke and picture;
- fade B: sorted by depth, but two strokes hide each other by shares that change smoothly while one passes the
  other, within a softness of B g: the soft order of `rasterize`; B of `order="soft"` is 0.5.

Per order: swaps among overlapping boxes per stroke and step; excess warp error and its worst 1 %; the "pop",
the change of the second picture when it takes the depths of the first (RMSE, that of the worst 1 % of pixels,
and the share of pixels that change by more than 10/255); and, with 250, 2000 and 7000 strokes of `gaussian`,
`swirl` and `flat`, the PSNR to the plain picture minus that of the order by depth (mean and worst). It shows
an order that reduces flicker at the price of wrong occlusion.

Results on koala, chair, truck and skull, 2000 strokes of `dry_brush`: the other keys only change the moment
of a swap, and avoid one swap in seven at most, which costs up to 1.3 dB. A fade leaves 22 to 35 % of the pop
at 0.25, 16 to 29 % at 0.5; pixels that change visibly fall from 0.3-0.8 % to 0.02 % and less. PSNR changes by
-0.03 to +0.15 dB at 0.25 and -0.04 to +0.22 dB at 0.5 (27 pictures of three scenes). This was measured with
`fade`; the kernel gives the same: at 4 places of koala and chair 0.47 and 0.87 % that change visibly fall to
0.00 % at 0.5. Per fragment of a pixel 0.3 to 0.6 pairs lie within the softness at 0.25, 0.6 to 1.1 at 0.5.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import brushgs as bg
from brushgs.measure.likeness import psnr
from brushgs.measure.warp import View, match_views
from tests.bench.flicker import (
    F64,
    Canvas,
    Scene,
    axes_of,
    in_order_of,
    open_scene,
    ordered,
    paint,
    plain_view,
    sample,
)
from tests.bench.machine import describe

VISIBLE = 10 / 255  # a change that the eye notices
COUNTS = (250, 2000, 7000)
TEXTURES = ("gaussian", "swirl", "flat")
MOST_LAGS = 4  # ranks in the order of a pixel over which fragments fade: with 24 pops differ by < 4 %
Key = Callable[[bg.Boxes, bg.Camera], F64]  # the values that boxes are sorted by
Painter = Callable[..., Any]


def by_depth(boxes: bg.Boxes, camera: bg.Camera) -> F64:
    return boxes.depths.astype(np.float64)


def by_distance(boxes: bg.Boxes, camera: bg.Camera) -> F64:
    slopes = (boxes.centers - camera.K[:2, 2]) / camera.K[[0, 1], [0, 1]]
    return by_depth(boxes, camera) * np.sqrt(1 + (slopes**2).sum(axis=1))


def shifted(shifts: F64) -> Key:
    """Depth plus a constant of each stroke, world units."""
    return lambda boxes, camera: by_depth(boxes, camera) + shifts[boxes.ids]


def sizes(strokes: bg.Gaussians) -> F64:
    """[N] geometric mean of the two larger scales, world units."""
    scales = np.sort(strokes.scales.astype(np.float64), axis=1)
    return np.asarray(np.sqrt(scales[:, 1] * scales[:, 2]))


def orders(strokes: bg.Gaussians) -> Iterator[tuple[str, Painter]]:
    size, chance = sizes(strokes), np.random.default_rng(0)
    numbers = chance.random(len(strokes)) - 0.5
    yield "depth", Sorted([by_depth])
    yield "radial", Sorted([by_distance])
    for factor in (0.5, 1.0, 2.0, 4.0):
        yield f"size {factor:g}", Sorted([shifted(factor * size)])
    for factor in (0.5, 1.0, 2.0):
        yield f"random {factor:g}", Sorted([shifted(factor * np.median(size) * numbers)])
    for factor, count in ((0.25, 4), (0.25, 12), (0.5, 12)):
        half = np.random.default_rng(1).normal(size=(count // 2, len(strokes)))
        yield f"mean {factor:g} x {count}", Sorted([shifted(factor * size * n) for n in (*half, *-half)])
    for factor in (0.25, 0.5, 1.0):
        yield f"fade {factor:g}", Faded(factor * size)


class Sorted:
    """The mean of the pictures whose boxes are sorted by each of some keys."""

    def __init__(self, keys: list[Key]) -> None:
        self.keys = keys

    def __call__(
        self, boxes: bg.Boxes, texture: bg.StrokeTexture, camera: bg.Camera, like: Any = None
    ) -> Any:
        """The picture; with `like`, boxes and camera of another view, in its orders."""
        pictures = []
        for key in self.keys:
            own = ordered(boxes, key(boxes, camera))
            if like is not None:
                own = in_order_of(ordered(like[0], key(*like)), own)
            pictures.append(paint(own, texture, camera))
        return np.mean(pictures, axis=0)


class Faded:
    """Strokes that fade into each other where their depths are closer than a softness, [N] per stroke.

    Stroke images are painted by `rasterize`, the built-in kernels, which it sorts by depth, by `fade`.
    """

    def __init__(self, softness: F64) -> None:
        self.softness = softness

    def __call__(
        self, boxes: bg.Boxes, texture: bg.StrokeTexture, camera: bg.Camera, like: Any = None
    ) -> Any:
        """The picture; with `like`, boxes and camera of another view, by its depths."""
        if like is not None:
            boxes = in_order_of(like[0], boxes)
        if texture.kind == "image":
            softness = self.softness[boxes.ids].astype(boxes.depths.dtype)
            return paint(replace(boxes, softness=softness), texture, camera)
        return fade(boxes, fragments(boxes, texture, camera), self.softness[boxes.ids], camera)


def fade(boxes: bg.Boxes, parts: tuple[Any, Any, Any], softness: F64, camera: bg.Camera) -> Any:
    """Compose fragments with soft order, on white.

    Of two fragments i, j of a pixel j hides the share s_ij = S((z_i - z_j) / b) of i, and i the rest of j;
    b is the root of the sum of their squared softness, S(x) = 1/2 + x (3 - x^2) / 4 within -1 to 1, 0 and 1
    beyond. Fragment i weighs w_i = alpha_i x product of (1 - alpha_j s_ij) over all others: that is sorting
    where depths are far apart, and for two the mean of both orders where they are equal. Of more than two
    within b the weights do not quite sum to the alpha of the pixel, 1 - product of (1 - alpha_i), and are
    scaled to it. Nothing jumps: the picture is continuous in the depths.
    """
    pixels, alphas, rows = parts
    depths, logs = boxes.depths[rows].astype(np.float64), np.log1p(-alphas)
    is_first = np.append(True, pixels[1:] != pixels[:-1])
    before = np.cumsum(logs) - logs
    light = before - before[is_first][np.cumsum(is_first) - 1]  # log: all in front hide wholly
    for lag in range(1, MOST_LAGS + 1):
        front = np.flatnonzero(pixels[:-lag] == pixels[lag:])
        back = front + lag
        x = (depths[back] - depths[front]) / np.hypot(softness[rows[front]], softness[rows[back]])
        front, back, x = front[x < 1], back[x < 1], x[x < 1]
        share = 0.5 + x * (3 - x**2) / 4
        light[back] += np.log1p(-alphas[front] * share) - logs[front]
        light[front] += np.log1p(-alphas[back] * (1 - share))
    num_pixels = camera.height * camera.width
    weights = alphas * np.exp(light)
    alpha = 1 - np.exp(np.bincount(pixels, logs, num_pixels))
    weights *= (alpha / np.maximum(np.bincount(pixels, weights, num_pixels), 1e-12))[pixels]
    rgb = [np.bincount(pixels, weights * boxes.colors[rows, c], num_pixels) + 1 - alpha for c in range(3)]
    return np.stack(rgb, axis=1).reshape(camera.height, camera.width, 3)


def fragments(boxes: bg.Boxes, texture: bg.StrokeTexture, camera: bg.Camera) -> tuple[Any, Any, Any]:
    """What boxes paint, by pixel and in their order: [n] pixel, [n] alpha, [n] row of the box."""
    places = np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), axis=-1) + 0.5
    numbers = np.arange(camera.width * camera.height).reshape(camera.height, camera.width)
    canvas = Canvas(places, texture, "mip")
    found = []
    for k in range(len(boxes)):
        half = boxes.half_extents[k].astype(np.float64)
        texels, reach = canvas.texels_of(half) if texture.kind == "image" else (None, half)
        window = canvas.window_of(boxes, k, reach)
        st = (places[window] - boxes.centers[k]) @ axes_of(boxes, k).T / reach
        if texels is not None:
            coverage = sample(texels, st)
        else:  # the gaussian kernel
            coverage = np.exp(-4.5 * (st**2).sum(axis=-1)) * (np.abs(st) < 1).all(axis=-1)
        alpha = np.minimum(0.99, float(boxes.opacities[k]) * coverage)
        is_seen = alpha >= 1 / 255
        found.append((numbers[window][is_seen], alpha[is_seen], np.full(np.count_nonzero(is_seen), k)))
    pixels, alphas, rows = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(pixels, kind="stable")
    return pixels[order], alphas[order], rows[order]


def num_swaps(first: bg.Boxes, second: bg.Boxes) -> float:
    """Pairs of boxes that overlap in the second frame and swapped their order since the first, per stroke."""
    _, i, j = np.intersect1d(first.ids, second.ids, assume_unique=True, return_indices=True)
    is_swapped = np.triu((i[:, None] < i) != (j[:, None] < j), 1)
    p, q = (j[rows] for rows in np.nonzero(is_swapped))
    angles = second.angles.astype(np.float64)
    axes = np.stack([np.cos(angles), np.sin(angles), -np.sin(angles), np.cos(angles)], axis=1).reshape(
        -1, 2, 2
    )
    between = (second.centers[q] - second.centers[p]).astype(np.float64)
    overlap = np.ones(len(p), bool)
    for axis in (
        axes[p, 0],
        axes[p, 1],
        axes[q, 0],
        axes[q, 1],
    ):  # boxes are disjoint if an axis separates them
        reach = sum(
            (np.abs(np.einsum("pij,pj->pi", axes[rows], axis)) * second.half_extents[rows]).sum(axis=1)
            for rows in (p, q)
        )
        overlap &= np.abs((between * axis).sum(axis=1)) < reach
    return float(overlap.sum()) / max(1, len(i))


def measure(scene: Scene, texture: bg.StrokeTexture, with_psnr: bool) -> None:
    plain = [(plain_view(scene.gaussians, a), plain_view(scene.gaussians, b)) for a, b in scene.pairs]
    matches = [match_views(*views) for views in plain]
    own = [match.error(a.rgb, b.rgb).rmse for match, (a, b) in zip(matches, plain, strict=True)]
    fewer = {count: bg.cluster(bg.prune(scene.gaussians), count) for count in COUNTS if with_psnr}
    by_depth_psnr: F64 | None = None
    for name, painter in orders(scene.strokes):
        figures = []
        for (c1, c2), match, plain_error in zip(scene.pairs, matches, own, strict=True):
            a, b = (bg.project(scene.strokes, c, num_sigmas=texture.fitted_sigmas) for c in (c1, c2))
            first, second = painter(a, texture, c1), painter(b, texture, c2)
            error = match.error(first, second)
            frozen = painter(b, texture, c2, like=(a, c1))
            pop = difference(match, second, frozen)
            keys = painter.keys if isinstance(painter, Sorted) else [by_depth]
            swaps = np.mean([num_swaps(ordered(a, k(a, c1)), ordered(b, k(b, c2))) for k in keys[:2]])
            figures.append((swaps, error.rmse - plain_error, error.worst_1pct, *pop))
        swaps, excess, worst, *pop = np.mean(figures, axis=0).tolist()
        line = (
            f"  {name:14} {swaps:6.3f} {excess:+8.4f} {worst:7.4f} {pop[0]:8.4f} {pop[1]:7.4f} {pop[2]:7.2%}"
        )
        if with_psnr:
            quality = qualities(fewer, name, scene, plain)
            by_depth_psnr = quality if by_depth_psnr is None else by_depth_psnr
            gain = quality - by_depth_psnr
            line += f" {gain.mean():+8.2f} {gain.min():+6.2f}"
        print(line, flush=True)


def difference(match: Any, second: Any, frozen: Any) -> tuple[float, float, float]:
    """The difference of two pictures over the valid pixels: RMSE, that of the worst 1 %, share visible."""
    squares = np.sort(((second - frozen) ** 2).mean(axis=2).ravel()[match.pixels])
    worst = squares[-max(1, len(squares) // 100) :]
    return float(np.sqrt(squares.mean())), float(np.sqrt(worst.mean())), float((squares > VISIBLE**2).mean())


def qualities(fewer: dict[int, bg.Gaussians], name: str, scene: Scene, plain: list[tuple[View, View]]) -> F64:
    """[counts x textures] PSNR to the plain render over every second place."""
    rows = []
    for strokes in fewer.values():
        painter = dict(orders(strokes))[name]
        for texture in (bg.StrokeTexture.open(t) for t in TEXTURES):
            values = []
            for (camera, _), (view, _) in list(zip(scene.pairs, plain, strict=True))[::2]:
                boxes = bg.project(strokes, camera, num_sigmas=texture.fitted_sigmas)
                picture = np.clip(painter(boxes, texture, camera), 0, 1)
                values.append(psnr(picture, np.clip(view.rgb, 0, 1)))
            rows.append(np.mean(values))
    return np.array(rows)


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
    parser.add_argument("--no-psnr", action="store_true", help="skip the last two columns: much faster")
    arguments = parser.parse_args()
    print(describe(), flush=True)
    for name in arguments.scenes:
        scene = open_scene(
            name,
            strokes=arguments.strokes,
            size=arguments.size,
            places=arguments.places,
            step=np.radians(arguments.step_deg),
        )
        print(f"{name:16}  swaps   excess   worst      pop   worst visible     PSNR  worst")
        measure(scene, bg.StrokeTexture.open(arguments.texture), not arguments.no_psnr)


if __name__ == "__main__":
    main()
