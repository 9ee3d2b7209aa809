"""Reference definitions of projection and rasterisation: plain NumPy in float64, short, slow and obvious.

Tests and benchmarks compare `brushgs.project` and `brushgs.rasterize` with them. Nothing else calls these
functions.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brushes, BrushSet
from brushgs.brushes.levels import axis_levels, level_coverage, level_height, level_index
from brushgs.brushes.texture import TINT_ZERO, StrokeTexture
from brushgs.options.choices import Filter
from brushgs.rendering.constants import GAUSSIAN_SIGMAS, LEAST_LIGHT, MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE
from brushgs.rendering.depth_test import DepthTest
from brushgs.rendering.glaze import pigments
from brushgs.rendering.light import Lamp, blur_taps
from brushgs.rendering.project import SOFTNESS, Directions, ProjectOptions
from brushgs.rendering.rasterize import RasterOptions
from brushgs.rendering.relief import UNDERPAINT_THICKNESS, Relief, canvas_scale, paint_height
from brushgs.rendering.streaks import BRISTLES, noise, streak_starts, streak_weights
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import sh_basis

CLAMP = 1.3  # the Jacobian is clamped at this factor of the field of view, as in training
FADED_NEAR = 8.0  # times the near distance: nearer strokes fade
ANCHOR_PULL = 8.0  # pull of the major axis on an anchored direction
DIRECTION_NOISE = 1e-14  # precision of directions; below, an ellipse counts as round and an angle as vertical


def project(gaussians: Gaussians, camera: Camera, **options: Any) -> Boxes:
    """`brushgs.project` with the same options, in float64 whatever the dtype of the scene."""
    given = ProjectOptions(**options)
    num_sigmas, low_pass, lock = given.num_sigmas, given.low_pass, given.lock
    scene = gaussians.astype(np.float64)
    means, scales, opacities, sh = (
        np.asarray(column, np.float64) for column in (scene.means, scene.scales, scene.opacities, scene.sh)
    )
    W = camera.viewmat[:3, :3]
    t = means @ W.T + camera.viewmat[:3, 3]
    ids = np.flatnonzero(t[:, 2] > camera.near).astype(np.int32)
    t = t[ids]
    directions = means[ids] - camera.position
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)

    J, R, S = jacobian(t, camera), rotation_matrices(scene.quats[ids]), scales[ids, None, :]
    M = J @ W @ R * S  # [M, 2, 3], pixels per standard deviation
    angles = major = _major_axis(M)
    if isinstance(lock, Directions):
        angles = lock.angles[ids].astype(np.float64)
    elif lock == "anchor":
        rows, longest = np.arange(len(ids)), np.argmax(scales[ids], axis=1)
        lengths = scales[ids, longest] * camera.K[[0, 1], [0, 1]].max() / t[:, 2]
        angles = _anchored(angles, M, R[rows, :, longest], M[rows, :, longest], lengths, directions, low_pass)
    sigmas = np.broadcast_to(num_sigmas, len(gaussians))[ids]
    half_extents = sigmas[:, None] * np.sqrt(np.stack(_variances(M, angles, low_pass), axis=1))
    opacities = opacities[ids]
    if gaussians.antialiased and low_pass > 0:
        bare, grown = (np.prod(_variances(M, major, variance), axis=0) for variance in (0, low_pass))
        opacities = opacities * np.sqrt(bare / grown)  # ratio of determinants
    if isinstance(lock, Directions):
        smallest = sigmas**2 * np.sqrt(np.prod(_variances(M, major, low_pass), axis=0))
        area_scales = 1 if lock.area_scales is None else lock.area_scales[ids]
        half_extents *= np.sqrt(np.maximum(area_scales * smallest / half_extents.prod(axis=1), 1))[:, None]
        opacities = opacities * (smallest / half_extents.prod(axis=1))  # the same paint on a larger box
    centers = t[:, :2] / t[:, 2:] * np.diag(camera.K)[:2] + camera.K[:2, 2]

    shades = np.einsum("nk,nkc->nc", sh_basis(directions, scene.sh_degree), sh[ids])
    colors = np.maximum(0, 0.5 + shades)
    if given.fade:
        longest = _variances(M, major, low_pass)[0]
        opacities = opacities * _fade(t[:, 2], half_extents, camera)
        if not gaussians.antialiased:
            opacities = opacities * np.sqrt(1 - low_pass / longest)

    u = np.abs(np.stack([np.cos(angles), np.sin(angles)], axis=1))
    reach = u * half_extents[:, :1] + u[:, ::-1] * half_extents[:, 1:]
    is_outside = (centers + reach <= 0) | (centers - reach >= (camera.width, camera.height))
    is_empty = half_extents <= 0
    kept = np.flatnonzero(~(is_outside | is_empty).any(axis=1) & (opacities >= MIN_ALPHA))
    kept = kept[np.argsort(t[kept, 2], kind="stable")]
    sizes = np.sqrt(np.prod(np.sort(scales, axis=1)[:, 1:], axis=1))[ids]
    return Boxes(
        centers[kept],
        half_extents[kept],
        angles[kept],
        t[kept, 2],
        colors[kept],
        opacities[kept],
        ids[kept],
        SOFTNESS * sizes[kept] if given.order == "soft" else None,
        sizes[kept] if given.underpaint else None,
        None if gaussians.brushes is None else gaussians.brushes[ids[kept]],
        None if (relief := Relief.of(given.relief)) is None else relief.of_boxes(scene, ids[kept], camera),
    )


def rotation_matrices(quats: Array) -> NDArray[np.float64]:
    """[N, 3, 3] rotations of quaternions [N, 4] w, x, y, z of any length above zero."""
    quats = np.asarray(quats, np.float64)
    quats = quats / np.abs(quats).max(axis=1, keepdims=True)  # squares of any length stay in range
    w, x, y, z = (quats / np.linalg.norm(quats, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def jacobian(t: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """[M, 2, 3] derivative of pixel by camera coordinates t, clamped just outside the view."""
    fx, fy = camera.K[0, 0], camera.K[1, 1]
    limit_x, limit_y = CLAMP * camera.width / (2 * fx), CLAMP * camera.height / (2 * fy)
    z = t[:, 2]
    ratio_x = np.clip(t[:, 0] / z, -limit_x, limit_x)
    ratio_y = np.clip(t[:, 1] / z, -limit_y, limit_y)
    zero = np.zeros_like(z)
    rows = [[fx / z, zero, -fx * ratio_x / z], [zero, fy / z, -fy * ratio_y / z]]
    return np.moveaxis(np.array(rows), 2, 0)


def _major_axis(M: NDArray[np.float64]) -> NDArray[np.float64]:
    """[M] angle of the longer axis of M M^T in (-pi/2, pi/2]; 0 if round."""
    x, y = M[:, 0], M[:, 1]
    difference = ((x - y) * (x + y)).sum(axis=1)  # a - c of the covariance (a, b; b, c)
    twice_b = 2 * (x * y).sum(axis=1)
    is_round = np.hypot(difference, twice_b) <= DIRECTION_NOISE * (M**2).sum(axis=(1, 2))
    angles = np.where(is_round, 0.0, 0.5 * np.arctan2(twice_b, difference))
    return np.where(angles <= -np.pi / 2 + DIRECTION_NOISE, np.pi / 2, angles)


def _variances(M: F64, angles: F64, low_pass: float) -> tuple[F64, F64]:
    """[M], [M] variances of the ellipse along and across the direction, pixels squared."""
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=1)
    along, across = (((w[:, None, :] @ M) ** 2).sum(axis=(1, 2)) + low_pass for w in (u, v))
    return along, across


def _anchored(
    major: F64, M: F64, axes: F64, projected: F64, lengths: F64, directions: F64, low_pass: float
) -> F64:
    """[M] directions in (-pi, pi]: the projection of the longest axis, bent toward the major axis.

    `axes` [M, 3] are the longest axes in the world, `projected` [M, 2] their columns of `M`, `lengths` [M]
    their projected lengths if perpendicular to the view. An axis seen exactly end-on has no direction.
    """
    along, across = _variances(M, major, low_pass)
    anisotropy = (along - across) / (along + across)
    side = 1 - (axes * directions).sum(axis=1) ** 2  # squared sine between the axis and the view
    pull = 1 + ANCHOR_PULL * side * anisotropy**2
    lean = np.arctan2(projected[:, 1], projected[:, 0]) - major
    bend = np.arctan2(np.sin(lean), pull * np.cos(lean))
    is_seen = np.hypot(projected[:, 0], projected[:, 1]) > DIRECTION_NOISE * lengths
    return np.where(is_seen, (major + bend + np.pi) % (2 * np.pi) - np.pi, major)


def _fade(depths: F64, half_extents: F64, camera: Camera) -> F64:
    """[M] factor on the opacity near the near plane, and for boxes much larger than the picture."""

    def smooth_step(t: F64) -> F64:
        t = np.clip(t, 0, 1)
        return t * t * (3 - 2 * t)

    area = 4 * half_extents.prod(axis=1) / (camera.width * camera.height)
    with np.errstate(divide="ignore"):
        return smooth_step((depths / camera.near - 1) / (FADED_NEAR - 1)) * smooth_step(
            (area**-0.5 - 0.1) / 0.4
        )


def rasterize(boxes: Boxes, texture: Brushes, options: RasterOptions) -> Frame:
    """Paint boxes, nearest first; as `brushgs.rasterize`, but all of the picture, and always in float64.

    Source: Xiang et al. 2025, 3.4 (texture mapping); Kerbl et al. 2023 (blending and its thresholds).
    """
    textures = texture.textures if isinstance(texture, BrushSet) else (texture,)
    height, width, min_transmittance = options.height, options.width, options.min_transmittance
    layers, relief, in_front_of = _layers(boxes, textures, options), options.relief, options.in_front_of
    if in_front_of is not None:
        layers = (_in_front_of(layer, boxes, in_front_of) for layer in layers)
    if options.blend == "glaze":
        return _glaze(boxes, layers, height, width)
    if boxes.softness is not None and texture.kind == "image":
        frame = _rasterize_softly(boxes, boxes.softness, layers, height, width, min_transmittance)
        return frame if relief else replace(frame, height=None)
    rgb, sums = np.zeros((height, width, 3)), _no_layers(boxes, height, width)
    transmittance, is_open = np.ones((height, width)), np.ones((height, width), dtype=bool)
    paint = np.zeros((height, width))
    for layer in layers:
        row, window, alpha = layer.row, layer.window, layer.alpha
        is_painted = is_open[window] & (alpha >= MIN_ALPHA)
        is_last = is_painted & (transmittance[window] * (1 - alpha) < min_transmittance)
        weight = np.where(is_painted & ~is_last, alpha * transmittance[window], 0)
        rgb[window] += weight[..., None] * layer.colors(boxes)
        for name, attribute in boxes.attributes().items():
            sums[name][window] += np.multiply.outer(weight, attribute[row].astype(np.float64))
        paint[window] += weight * layer.height
        transmittance[window] -= weight
        is_open[window] &= ~is_last
    alpha = 1 - transmittance
    means: dict[str, Any] = {name: _over_alpha(total, alpha) for name, total in sums.items()}
    return Frame(rgb, alpha, **means, height=paint if relief else None)


@dataclass(frozen=True)
class Fragment:
    """A stroke or its underpaint at a pixel.

    Attributes:
        row: of the box.
        is_underpaint: whether it is underpaint.
        weight: of its color in the pixel.
        shade: factor of streaks on its color.
    """

    row: int
    is_underpaint: bool
    weight: float
    shade: float


def fragments(boxes: Boxes, texture: Brushes, options: RasterOptions) -> list[list[Fragment]]:
    """Fragments of each pixel, row by row, nearest first; arguments as `rasterize`."""
    textures = texture.textures if isinstance(texture, BrushSet) else (texture,)
    is_soft = boxes.softness is not None and texture.kind == "image"
    width, in_front_of = options.width, options.in_front_of
    found: list[list[tuple[_Layer, float, float]]] = [[] for _ in range(options.height * width)]
    for layer in _layers(boxes, textures, options):
        seen = layer if in_front_of is None else _in_front_of(layer, boxes, in_front_of)
        for y, x in np.argwhere(seen.alpha >= MIN_ALPHA):
            pixel = (seen.window[0].start + y) * width + seen.window[1].start + x
            found[pixel].append((seen, float(seen.alpha[y, x]), float(seen.shade[y, x])))
    softness = boxes.softness if is_soft else None
    pixels = []
    for own in found:
        weights = _weights(own, softness, options.min_transmittance)
        pixels.append(
            [
                Fragment(one.row, one.is_underpaint, float(weight), shade)
                for (one, _, shade), weight in zip(own, weights, strict=True)
                if weight > 0
            ]
        )
    return pixels


def _weights(
    own: "list[tuple[_Layer, float, float]]", softness: NDArray[Any] | None, min_transmittance: float
) -> F64:
    """Weight of each fragment of a pixel, nearest first; in the soft order where `softness` is given."""
    alphas = np.array([alpha for _, alpha, _ in own])
    if softness is not None and own:
        soft = np.array([0.0 if one.is_underpaint else float(softness[one.row]) for one, _, _ in own])
        depths = np.array([one.depth for one, _, _ in own])
        return soft_weights(alphas, depths, soft, min_transmittance)[0]
    weights, light = np.zeros(len(own)), 1.0
    for i, alpha in enumerate(alphas):
        if light * (1 - alpha) < min_transmittance:
            break
        weights[i], light = light * alpha, light * (1 - alpha)
    return weights


def _glaze(boxes: Boxes, layers: Iterable["_Layer"], height: int, width: int) -> Frame:
    """Paint glazes: boxes that tint the layers behind them."""
    tint, transmittance = np.ones((height, width, 3)), np.ones((height, width))
    for layer in layers:
        alpha = np.where(layer.alpha >= MIN_ALPHA, layer.alpha, 0)
        tint[layer.window] *= pigments(boxes.colors[layer.row].astype(np.float64)) ** alpha[..., None]
        transmittance[layer.window] *= 1 - alpha
    return Frame(tint, 1 - transmittance)


def _in_front_of(layer: "_Layer", boxes: Boxes, test: DepthTest) -> "_Layer":
    """A stroke or its underpaint after the depth test."""
    tolerance = max(float(test.tolerance[layer.row]), 4 * float(np.finfo(boxes.depths.dtype).tiny))
    end = float(boxes.depths[layer.row]) - tolerance
    x = np.clip((test.limit[layer.window].astype(np.float64) - end) / (tolerance / 2), 0, 1)
    return replace(layer, alpha=layer.alpha * x * x * (3 - 2 * x))


def _rasterize_softly(
    boxes: Boxes,
    softness: Array,
    layers: Iterable["_Layer"],
    height: int,
    width: int,
    min_transmittance: float,
) -> Frame:
    """Soft order, pixel by pixel; underpaint has no softness."""
    rgb, alpha, paint = np.zeros((height, width, 3)), np.zeros((height, width)), np.zeros((height, width))
    means = _no_layers(boxes, height, width)
    rows: dict[tuple[int, int], list[int]] = {}
    fragments: dict[tuple[int, int], list[tuple[float, float, float, float]]] = {}
    colors: dict[tuple[int, int], list[F64]] = {}
    for layer in layers:
        window = layer.window
        reach = 0.0 if layer.is_underpaint else float(softness[layer.row])
        of_layer = layer.colors(boxes)
        for y, x in np.argwhere(layer.alpha >= MIN_ALPHA):
            pixel = window[0].start + int(y), window[1].start + int(x)
            rows.setdefault(pixel, []).append(layer.row)
            fragment = layer.alpha[y, x], layer.depth, layer.height[y, x], reach
            fragments.setdefault(pixel, []).append(fragment)
            colors.setdefault(pixel, []).append(of_layer[y, x])
    for pixel, own in rows.items():
        alphas, z, heights, reaches = np.array(fragments[pixel]).T
        weights, alpha[pixel] = soft_weights(alphas, z, reaches, min_transmittance)
        if alpha[pixel] > 0:
            rgb[pixel] = weights @ np.array(colors[pixel])
            paint[pixel] = weights @ heights
            for name, attribute in boxes.attributes().items():
                means[name][pixel] = weights @ attribute[own].astype(np.float64) / alpha[pixel]
    return Frame(rgb, alpha, **means, height=paint)


def _no_layers(boxes: Boxes, height: int, width: int) -> dict[str, Any]:
    """Zeros for each layer of a frame of these boxes."""
    return {name: np.zeros((height, width, *a.shape[1:])) for name, a in boxes.attributes().items()}


def _over_alpha(total: F64, alpha: F64) -> F64:
    """A sum of weight x attribute, [H, W] or [H, W, channels], over the sum of weights; 0 where that is 0."""
    alpha = alpha.reshape(*alpha.shape, *[1] * (total.ndim - 2))
    return np.divide(total, alpha, out=np.zeros_like(total), where=alpha > 0)


def soft_weights(
    alphas: F64, z: F64, softness: F64, min_transmittance: float = MIN_TRANSMITTANCE
) -> tuple[F64, float]:
    """[n] weights of the fragments of a pixel, nearest first, and the pixel's alpha.

    Fragment j hides the share S_ij of fragment i: 1 if it lies at least their joint reach in front, 0 if as
    far behind, continuous in between, with S_ij + S_ji = 1.
    """
    light = np.cumprod(np.append(1, 1 - alphas[:-1]))
    alphas = np.where(light >= LEAST_LIGHT, alphas, 0)  # fragments behind so much paint are skipped
    gap, reach = z[:, None] - z, np.hypot(softness[:, None], softness)
    is_near = np.abs(gap) < reach
    is_hidden = ~is_near & np.tri(len(z), k=-1, dtype=bool)  # [i, j]: j lies wholly in front of i
    x = np.divide(gap, reach, out=np.zeros_like(gap), where=is_near)
    share = np.where(is_near, 0.5 + x * (3 - x**2) / 4, is_hidden)
    np.fill_diagonal(share, 0)
    in_front = np.prod(1 - alphas * is_hidden, axis=1)
    is_kept = in_front * (1 - alphas) >= min_transmittance  # as for sorted strokes
    weights = np.where(is_kept, alphas * np.prod(1 - alphas * share, axis=1), 0)
    alpha = 1 - np.prod(1 - alphas[is_kept])
    return (weights * (alpha / weights.sum()) if alpha > 0 else weights), alpha


_Copies = dict[tuple[int, int, int], NDArray[np.uint8]]  # identity of the texture, and levels


@dataclass(frozen=True, eq=False)
class _Layer:
    """A stroke or its underpaint, within its window of the picture."""

    row: int
    is_underpaint: bool
    depth: float
    window: tuple[slice, slice]
    alpha: F64  # of the window; 0 outside the box
    shade: F64  # of the window: factor of the color
    height: F64  # of the window: height of the paint, pixels; 0 if not requested
    tint: F64 | None = None  # [..., 3] of the window: added to the color

    def colors(self, boxes: Boxes) -> F64:
        """[..., 3] of the window."""
        color: F64 = self.shade[..., None] * boxes.colors[self.row].astype(np.float64)
        if self.tint is not None:
            color = np.maximum(color + self.tint, 0)
        return color


def _layers(boxes: Boxes, textures: Sequence[StrokeTexture], options: RasterOptions) -> Iterator[_Layer]:
    """All strokes and, with underpaint, as many soft kernels behind them; nearest first."""
    height, width, filter, relief = options.height, options.width, options.filter, options.relief
    underpaint = options.underpaint
    centers, half_extents, angles, depths, opacities = (
        column.astype(np.float64)
        for column in (boxes.centers, boxes.half_extents, boxes.angles, boxes.depths, boxes.opacities)
    )
    is_image, kernel = textures[0].kind == "image", StrokeTexture.open("gaussian")
    brushes = np.zeros(len(boxes), int) if boxes.brushes is None or not is_image else boxes.brushes
    reaches = None if underpaint is None else underpaint.reaches(boxes)
    starts, weights = _streaks_of(boxes, textures, options.streaks if is_image else 0.0)
    copies: _Copies = {}
    heights: _Copies = {}
    tints: _Copies = {}
    for depth, is_underpaint, row in _order(boxes, depths, underpaint is not None and is_image):
        filling, half, opacity = textures[brushes[row]], half_extents[row], opacities[row]
        if is_underpaint:
            assert underpaint is not None
            reach = underpaint.reach if reaches is None else reaches[row]
            filling, half, opacity = kernel, half * reach, opacity * underpaint.opacity
        coverage, scale = _coverage_of_box(filling, half, filter, copies)
        size, half = half, half * scale
        window = _window(centers[row], half, angles[row], height, width)
        if window is None:
            continue
        s, t = _place_in_box(centers[row], half, angles[row], window)
        is_inside = (np.abs(s) < 1) & (np.abs(t) < 1)
        alpha = np.minimum(MAX_ALPHA, opacity * _sample(filling, coverage, s, t, filter))
        is_streaked = not is_underpaint and weights[row].any() and filling.tint is None
        shade = _streaks(t * scale[1], int(starts[row]), weights[row]) if is_streaked else np.ones_like(t)
        paint = np.zeros_like(t)
        if relief:
            thickness, gain = _relief_of(boxes, row, bool(is_underpaint))
            paint += thickness + gain * _heights_in(filling, size, s, t, filter, heights)
        alpha = np.where(is_inside, alpha, 0)
        tint = None if filling.tint is None else _tint_of_box(filling, size, s, t, filter, tints)
        yield _Layer(row, bool(is_underpaint), float(depth), window, alpha, shade, paint, tint)


def _streaks_of(
    boxes: Boxes, textures: Sequence[StrokeTexture], streaks: float
) -> tuple[NDArray[np.uint8], Array]:
    """Starts and weights of the streaks of each box."""
    is_smooth = BrushSet(tuple(textures)).without_bristles(boxes.brushes) if streaks else None
    return streak_starts(boxes), streak_weights(boxes, streaks, is_smooth)


def _relief_of(boxes: Boxes, row: int, is_underpaint: bool) -> tuple[float, float]:
    """Thickness of the paint, and gain of the height of its texture."""
    assert boxes.reliefs is not None, "only boxes with reliefs have a height"
    thickness, gain = boxes.reliefs[row].astype(np.float64).tolist()
    return thickness * (UNDERPAINT_THICKNESS if is_underpaint else 1), gain


def _order(boxes: Boxes, depths: F64, has_underpaint: bool) -> list[tuple[float, int, int]]:
    """Depth, 1 for underpaint, and row of all that is painted, nearest first."""
    order = [(depth, 0, row) for row, depth in enumerate(depths)]
    if has_underpaint:
        assert boxes.setbacks is not None, "only boxes with setbacks have underpaint"
        with np.errstate(over="ignore"):  # clamped to the largest number
            behind = np.minimum(depths + boxes.setbacks.astype(np.float64), np.finfo(np.float64).max)
        order += [(depth, 1, row) for row, depth in enumerate(behind)]
    return sorted(order)


def _window(center: F64, half: F64, angle: np.float64, height: int, width: int) -> tuple[slice, slice] | None:
    """Rows and columns of the picture around a box; None if it lies outside."""
    reach = np.abs([[np.cos(angle), np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ half
    low = np.clip(np.floor(center - reach), 0, (width, height)).astype(int)
    high = np.clip(np.ceil(center + reach), 0, (width, height)).astype(int)
    if (half <= 0).any() or (low >= high).any():
        return None
    return np.s_[int(low[1]) : int(high[1]), int(low[0]) : int(high[0])]


def _place_in_box(center: F64, half: F64, angle: np.float64, window: tuple[slice, slice]) -> tuple[F64, F64]:
    """Pixel centers along u and v of a box, in its half extents."""
    y, x = np.mgrid[window] + 0.5
    s = (np.cos(angle) * (x - center[0]) + np.sin(angle) * (y - center[1])) / half[0]
    t = (np.cos(angle) * (y - center[1]) - np.sin(angle) * (x - center[0])) / half[1]
    return s, t


def _streaks(t: F64, start: int, weights: Array) -> F64:
    """Factors of streaks on the color, at t in half extents across the stroke."""
    place = 0.5 * BRISTLES * (1 + t)
    bristle = np.floor(place).astype(int)
    values = noise().astype(np.float64) / 127.5 - 1
    near, far = (values[(start + bristle + k) % len(values)] for k in (0, 1))
    f = (place - bristle)[..., None]
    return np.asarray(1 + ((1 - f) * near + f * far) @ weights.astype(np.float64))


def _coverage_of_box(
    texture: StrokeTexture, half: F64, filter: Filter, copies: "_Copies"
) -> tuple[NDArray[np.uint8], F64]:
    """The texels for a box of these half extents, and the scale [2] of their box.

    `copies` caches levels: filtering one takes longer than painting with it.
    """
    if texture.kind != "image" or filter != "mip":
        return texture.coverage, np.ones(2)
    rows, columns = texture.coverage.shape
    u, v = level_index(half[0], columns), level_index(half[1], rows)
    scale = np.array([axis_levels(columns)[u].scale, axis_levels(rows)[v].scale])
    if (id(texture), u, v) not in copies:
        copies[id(texture), u, v] = level_coverage(texture.coverage, u, v)
    return copies[id(texture), u, v], scale


def _height_of_box(texture: StrokeTexture, half: F64, filter: Filter, copies: "_Copies") -> NDArray[np.uint8]:
    """The height of the paint in the texels that `_coverage_of_box` takes."""
    if texture.height is None:
        return _coverage_of_box(texture, half, filter, copies)[0]
    if filter != "mip":
        return paint_height(texture)
    rows, columns = texture.coverage.shape
    u, v = level_index(half[0], columns), level_index(half[1], rows)
    if (id(texture), u, v) not in copies:
        copies[id(texture), u, v] = level_height(paint_height(texture), texture.coverage, u, v)
    return copies[id(texture), u, v]


def _heights_in(texture: StrokeTexture, half: F64, s: F64, t: F64, filter: Filter, copies: "_Copies") -> F64:
    """Height of the paint in a box over its mean, -0.5 to 0.5."""
    if texture.kind != "image":
        return np.zeros_like(t)
    return _sample(texture, _height_of_box(texture, half, filter, copies), s, t, filter) - 0.5


def _tint_of_box(texture: StrokeTexture, half: F64, s: F64, t: F64, filter: Filter, copies: "_Copies") -> F64:
    """[..., 3] what a colored brush adds at (s, t) of a box, in the texels that `_coverage_of_box` takes."""
    assert texture.tint is not None, "only of colored brushes"
    channels = []
    for c in range(3):
        texels = np.ascontiguousarray(texture.tint.texels[..., c])
        if filter == "mip":
            rows, columns = texture.coverage.shape
            u, v = level_index(half[0], columns), level_index(half[1], rows)
            if (id(texture) + c, u, v) not in copies:
                copies[id(texture) + c, u, v] = level_height(texels, texture.coverage, u, v)
            texels = copies[id(texture) + c, u, v]
        channels.append(255 * _sample(texture, texels, s, t, filter) - TINT_ZERO)
    return np.asarray(np.stack(channels, axis=-1) * texture.tint.step)


def _sample(texture: StrokeTexture, coverage: NDArray[np.uint8], s: F64, t: F64, filter: Filter) -> F64:
    """Coverage 0 to 1 at (s, t) in -1 to 1 over the box."""
    if texture.kind == "gaussian":
        return np.asarray(np.exp(-0.5 * GAUSSIAN_SIGMAS**2 * (s * s + t * t)))
    if texture.kind == "ellipse":
        return np.where(s * s + t * t < 1, 1.0, 0.0)
    u, v = (np.clip((1 + a) / 2, 0, 1) * (n - 1) for a, n in ((s, coverage.shape[1]), (t, coverage.shape[0])))
    if filter == "nearest":
        return np.asarray(coverage[np.floor(v + 0.5).astype(int), np.floor(u + 0.5).astype(int)] / 255)
    row, column = np.floor(v).astype(int), np.floor(u).astype(int)
    next_row = np.minimum(row + 1, coverage.shape[0] - 1)
    next_column = np.minimum(column + 1, coverage.shape[1] - 1)
    fv, fu = v - row, u - column
    upper = (1 - fu) * coverage[row, column] + fu * coverage[row, next_column]
    lower = (1 - fu) * coverage[next_row, column] + fu * coverage[next_row, next_column]
    return np.asarray(((1 - fv) * upper + fv * lower) / 255)


def light(rgb: Array, height: Array, lamp: Lamp, *, alpha: Array | None = None, blur: float) -> F64:
    """`brushgs.rendering.light.light`, always in float64."""
    taps = blur_taps(blur, canvas_scale(height.shape[1], height.shape[0]))
    blurred, reach = np.pad(height.astype(np.float64), len(taps) // 2, mode="edge"), len(taps)
    for axis in (0, 1):
        blurred = np.lib.stride_tricks.sliding_window_view(blurred, reach, axis) @ taps
    around = np.pad(blurred, 1, mode="edge")
    slope_x = (around[1:-1, 2:] - around[1:-1, :-2]) / 2
    slope_y = (around[2:, 1:-1] - around[:-2, 1:-1]) / 2
    normals = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=2)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    shade = np.clip(normals @ lamp.direction / lamp.direction[2], 0, 2)
    shine = np.clip(normals @ lamp.half_way, 0, 1) ** lamp.exponent - lamp.half_way[2] ** lamp.exponent
    shine = np.clip(shine, 0, 1) * (1 if alpha is None else alpha)
    factor = 1 + lamp.strength * (shade - 1)
    return np.asarray(rgb * factor[..., None] + lamp.gloss * shine[..., None])
