"""Figures of pictures against the plain picture, against a painting, and from frame to frame."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from brushgs.formats.pictures.images import resize
from brushgs.measure.box_events import orientation_events
from brushgs.measure.likeness import SSIM_SIDE, psnr, ssim
from brushgs.measure.warp import PLAIN_ALPHA, View, match_views
from brushgs.passes.color.color_space import Space
from brushgs.values.arrays import F64, Array, Mask, check
from brushgs.values.boxes import Boxes
from brushgs.values.colors import oklab_of

NUM_BINS, REACH, WIDTH = 64, 3.0, 0.02  # of the histogram, as published
HISTOGRAM_SIDE = 150  # pixels: larger pictures are made smaller, as published
TINY = 1e-6  # keeps logarithms finite, as published
HEIGHT = 512  # pixels, at which structure is compared
SCALES = (1, 2, 4)
PATCH, NUM_PATCHES, NUM_DIRECTIONS = 7, 6000, 96
LIGHTNESS_BLUR = 6.0  # pixels: slower changes of lightness are no marks
QUANTILE_STEP = 12  # every so many sorted projections are compared
RING = 6, 16  # pixels from an outline, between which lightness is compared: nearer are contours
BESIDE = 24  # pixels: maximum distance of a pixel inside from one outside


def nearness(picture: Array, plain: Array, alpha: Array) -> tuple[float, float | None]:
    """PSNR in dB and SSIM of the subject: pixels that the plain picture covers by more than half.

    PSNR is of these pixels alone. SSIM is of their bounding box, with the plain picture around the subject,
    so that neither a stage nor a bare canvas counts; None if that is smaller than its window.
    """
    is_subject = alpha > PLAIN_ALPHA
    if not is_subject.any():
        return float("nan"), None
    rows, columns = (np.flatnonzero(is_subject.any(axis=axis)) for axis in (1, 0))
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    masked = np.where(is_subject[..., None], picture, plain)[box]
    likeness = ssim(masked, plain[box]) if min(masked.shape[:2]) >= SSIM_SIDE else None
    return psnr(picture[is_subject], plain[is_subject]), likeness


def color_histogram(picture: Array) -> F64:
    """[3, 64, 64] the RGB-uv histogram of a picture; it sums to 1.

    For each channel c and the two others a and b: u = ln(c / a), v = ln(c / b). A pixel adds its length in
    RGB times k(u) k(v) to the bins, k(u) = 1 / (1 + ((u - bin) / 0.02)^2), bins from -3 to 3.
    Source: Afifi, Brubaker and Brown 2021, HistoGAN, equations 1 to 3.

    Args:
        picture: [H, W, 3] display-encoded, 0 to 1.
    """
    sizes = check("color_histogram", picture=(picture, "H W 3"))
    height, width = (min(sizes[letter], HISTOGRAM_SIDE) for letter in "HW")
    if (height, width) != picture.shape[:2]:
        picture = resize(picture, width, height)
    rgb = np.clip(np.asarray(picture, np.float64), 0, 1).reshape(-1, 3)
    length = np.sqrt((rgb**2).sum(axis=1))
    logs, bins = np.log(rgb + TINY), np.linspace(-REACH, REACH, NUM_BINS)
    planes = []
    for channel, first, second in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        u, v = (
            1 / (1 + ((logs[:, channel] - logs[:, other])[:, None] - bins) ** 2 / WIDTH**2)
            for other in (first, second)
        )
        planes.append((u * length[:, None]).T @ v)
    histogram = np.stack(planes)
    return np.asarray(histogram / (histogram.sum() or 1.0))


def histogram_loss(first: F64, second: F64) -> float:
    """The Hellinger distance of two histograms, 0 to 1. Source: HistoGAN, equation 5."""
    return float(np.sqrt(((np.sqrt(first) - np.sqrt(second)) ** 2).sum() / 2))


def structure(picture: Array) -> list[F64]:
    """The distribution of patches of lightness at three scales, as sorted projections; no networks.

    Slow changes of lightness are taken away and the contrast is made equal, so that marks count and neither
    colors nor subject do. Source of the measure: Rabin et al. 2011 (sliced Wasserstein distance).

    Args:
        picture: [H, W, 3] display-encoded, 0 to 1; compared at 512 pixels of height.
    """
    from scipy.ndimage import gaussian_filter

    sized = _sized(picture)
    lightness = oklab_of(sized.reshape(-1, 3))[:, :1].reshape(*sized.shape[:2], 1)

    def marks(plane: F64) -> F64:
        plane = plane - gaussian_filter(plane, (LIGHTNESS_BLUR, LIGHTNESS_BLUR, 0))
        return np.asarray(plane / (1e-4 + plane.std()))

    return _projections(lightness, marks, is_centered=True)


def color_structure(picture: Array) -> list[F64]:
    """The same of patches of color, in CIELAB: by it paintings are told apart by colors and marks."""
    sized = _sized(picture)
    return _projections(Space("lab").to(sized.reshape(-1, 3)).reshape(sized.shape), np.asarray)


def value_gap(picture: Array, body: Mask, scene: Mask) -> float | None:
    """Mean L* of a body along its outline minus that of what surrounds the scene there; None without such.

    Both are taken 6 to 16 pixels off the outline. Pixels outside are 6 off all of the scene, and pixels
    inside at most 24 off those: where a body stands before the scene's own ground, nothing is counted.

    Args:
        picture: [H, W, 3] display-encoded, 0 to 1.
        body: [H, W] what stands.
        scene: [H, W] body and its ground.
    """
    from scipy.ndimage import distance_transform_edt

    if scene.all() or not body.any():
        return None
    near, far = RING
    inward, outward, off = (distance_transform_edt(mask) for mask in (body, ~body, ~scene))
    outside = (outward > near) & (outward <= far) & (off > near)
    if not outside.any():
        return None
    inside = (inward > near) & (inward <= far) & (distance_transform_edt(~outside) <= BESIDE)
    if not inside.any():
        return None
    within, beyond = (Space("lab").to(picture[mask])[:, 0].mean() for mask in (inside, outside))
    return 100 * float(within - beyond)


def _sized(picture: Array) -> F64:
    """A picture at the height of comparison."""
    height, width = picture.shape[:2]
    across = max(4 * PATCH, round(width * HEIGHT / height))
    return np.clip(resize(np.asarray(picture, np.float64), across, HEIGHT), 0, 1)


def _projections(field: F64, prepare: Callable[[F64], F64], *, is_centered: bool = False) -> list[F64]:
    """Sorted projections of patches of a field [h, w, k] at each scale, perhaps less their means."""
    height, width, channels = field.shape
    size = PATCH * PATCH * channels
    directions = np.random.default_rng(0).normal(size=(len(SCALES), size, NUM_DIRECTIONS))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = []
    for scale, ways in zip(SCALES, directions, strict=True):
        plane = prepare(resize(field, width // scale, height // scale))
        shape = plane.shape[:2]
        rows, columns = (np.random.default_rng(1).integers(0, n - PATCH, NUM_PATCHES) for n in shape)
        steps = np.arange(PATCH)
        patches = plane[rows[:, None, None] + steps[:, None], columns[:, None, None] + steps]
        patches = patches.reshape(NUM_PATCHES, -1)
        if is_centered:
            patches = patches - patches.mean(axis=1, keepdims=True)
        found.append(np.sort(patches @ ways, axis=0)[::QUANTILE_STEP])
    return found


def structure_distance(first: Sequence[F64], second: Sequence[F64]) -> float:
    """0 for equal structure, 1 at most: mean difference of projections over the sum of their sizes."""
    shares = [
        np.abs(a - b).mean() / (np.abs(a).mean() + np.abs(b).mean())
        for a, b in zip(first, second, strict=True)
    ]
    return float(np.mean(shares))


def blind_rank(picture: Sequence[F64], paintings: Mapping[str, Sequence[F64]], own: str) -> int:
    """1 if no other painting is nearer in structure than the own one, 2 if one is, and so on."""
    distances = {name: structure_distance(picture, each) for name, each in paintings.items()}
    return 1 + sum(distance < distances[own] for distance in distances.values())


def range_error(pictures: Sequence[Array], views: Sequence[View], gap: int) -> float | None:
    """Mean RMSE, of 255, of frames `gap` apart after moving one to the other; None without such frames."""
    errors = []
    for first in range(len(views) - gap):
        match = match_views(views[first], views[first + gap])
        if len(match.pixels):
            errors.append(match.error(pictures[first], pictures[first + gap]).rmse)
    return 255 * float(np.mean(errors)) if errors else None


def flips(coats: Sequence[Sequence[tuple[Boxes, Boxes]]], width: int, height: int) -> int:
    """Half turns of strokes over all steps; `coats[frame][coat]` are boxes and ellipses behind them."""
    total = 0
    for of_coat in zip(*coats, strict=True):
        boxes, ellipses = zip(*of_coat, strict=True)
        total += orientation_events(boxes, width=width, height=height, ellipses=ellipses).flips
    return total


def plain_values(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Figures ready for JSON: NaN and infinity are None."""
    return {
        name: None if isinstance(value, float) and not np.isfinite(value) else value
        for name, value in figures.items()
    }
