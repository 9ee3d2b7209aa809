"""Usability of a picture of a scene: covered, sharp, and made of small Gaussians."""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.first_view.sample import FAINTEST, Painter, gradients, thinned
from brushgs.values.arrays import F32, F64
from brushgs.values.camera import Camera
from brushgs.values.colors import LUMINANCE
from brushgs.values.gaussians import Gaussians

SOLID = 0.9  # alpha from which a pixel counts as covered
SEEN = 0.5  # alpha from which a pixel shows the scene
# Length of a Gaussian's ellipse over the picture's diagonal below which it is fine. The fine share of 13 real
# scenes from outside is 0.56 to 1.0, of a kitchen from outside its cameras 0.38.
FINE = 1 / 18
LARGE = 1 / 3  # area of an ellipse over the picture's above which it is a veil
SMALLEST = 0.02  # in median sizes: lower limit of sizes for thinning
MOST_SIZES = 20_000  # sampled for the size distribution
ELLIPSE = 2.0  # visible extent of a Gaussian, standard deviations
MIDDLE = 0.5  # standard deviation of the window on the middle, half pictures
# Usable picture: least covered share, most veiled share, least mean gradient. The whole scene covers about
# 0.03 less than a thinned one: the aim is 0.9.
COVERED, VEILED, SHARP = 0.93, 0.15, 0.02


@dataclass(frozen=True)
class Shown:
    """Measures of a plain picture.

    Attributes:
        covered: share of the pixels with alpha above 0.9.
        fine: share of fine Gaussians in the paint, 0 to 1.
        veiled: share of the picture painted by Gaussians larger than a third of it, 0 to 1.
        close: mean nearness of the paint, 0 at the given distance and beyond, 1 at the lens.
        detail: mean gradient of luminance of covered pixels, per pixel; the middle counts more.
        spread: far depths over near ones, of the 85th and 15th percentile, >= 1.
    """

    covered: float
    fine: float
    veiled: float
    close: float
    detail: float
    spread: float

    @property
    def clear(self) -> float:
        """Clarity: covered x fine x detail."""
        return self.covered * self.fine * self.detail

    @property
    def is_usable(self) -> bool:
        """Whether the picture is covered, sharp, and not veiled by large Gaussians."""
        return self.covered >= COVERED and self.veiled <= VEILED and self.detail >= SHARP


class Judge:
    """Measures small pictures of a scene, which is thinned once."""

    def __init__(self, gaussians: Gaussians, most_rows: int) -> None:
        self.scene, self.growths = thinned_by_size(gaussians, most_rows)
        self.painter, self.flag_painter = Painter(depth=True), Painter()

    def __call__(self, camera: Camera, distance: float = 1.0) -> Shown:
        """Measures of a view; paint nearer than `distance`, world units, > 0, counts as close."""
        boxes = self.painter.boxes(self.scene, camera)
        frame = self.painter.frame(boxes, camera)
        across = boxes.half_extents.astype(np.float64) / self.painter.texture.num_sigmas
        areas = ELLIPSE**2 * across.prod(axis=1) / self.growths[boxes.ids] ** 2  # of ellipses, over pi
        is_fine = 2 * np.sqrt(areas) < FINE * np.hypot(camera.width, camera.height)
        is_large = np.pi * areas > LARGE * camera.width * camera.height
        near = np.clip(1 - boxes.depths / distance, 0, 1)
        colors = np.stack([is_fine, is_large, near], axis=1).astype(boxes.colors.dtype)
        flags = self.flag_painter.frame(replace(boxes, colors=colors), camera).rgb
        assert frame.depth is not None
        is_seen = frame.alpha > SEEN
        painted = float(frame.alpha[is_seen].sum(dtype=np.float64))
        veiled, close = flags[..., 1:].mean(axis=(0, 1), dtype=np.float64)
        return Shown(
            covered=float((frame.alpha > SOLID).mean()),
            fine=float(flags[is_seen, 0].sum(dtype=np.float64)) / max(painted, 1.0),
            veiled=float(veiled),
            close=float(close),
            detail=_detail(frame.rgb, frame.alpha),
            spread=_spread(frame.depth[is_seen]),
        )


def thinned_by_size(gaussians: Gaussians, most: int) -> tuple[Gaussians, F64]:
    """About `most` Gaussians of degree 0: all large ones, and few of the small ones.

    Kept ones grow to replace dropped ones of their size: surfaces stay closed, and large Gaussians before a
    camera do not grow.

    Args:
        gaussians: N Gaussians; haze is left out.
        most: approximate number.

    Returns:
        n Gaussians, and [n] factors on their scales.
    """
    rows = np.flatnonzero(gaussians.opacities > FAINTEST)
    sizes = np.sqrt(np.sort(gaussians.scales[rows], axis=1)[:, 1:].astype(np.float64).prod(axis=1))
    shares = _shares(sizes, most)
    total = np.cumsum(shares)
    is_kept = np.floor(total + 0.5) > np.floor(total - shares + 0.5)
    kept, growths = rows[is_kept], 1 / np.sqrt(shares[is_kept])
    scales = gaussians.scales[kept].astype(np.float64) * growths[:, None]
    largest = np.finfo(gaussians.scales.dtype).max
    scene = replace(
        gaussians.take(kept),
        scales=np.minimum(scales, largest).astype(gaussians.scales.dtype),
        sh=gaussians.sh[kept, :1],
    )
    return scene, growths


def _shares(sizes: F64, most: int) -> F64:
    """[n] kept share of the Gaussians of each size: proportional to size, at most 1."""
    if len(sizes) <= most:
        return np.ones(len(sizes))
    some = sizes[thinned(len(sizes), MOST_SIZES)]
    least = max(SMALLEST * float(np.median(some)), np.finfo(np.float64).tiny)
    low, high = 0.0, 1.0  # kept share at the least size
    for _ in range(20):
        middle = 0.5 * (low + high)
        mean = float(np.minimum(middle * (np.maximum(some, least) / least), 1).mean())
        low, high = (middle, high) if mean < most / len(sizes) else (low, middle)
    return np.asarray(np.minimum(high * (np.maximum(sizes, least) / least), 1))


def _detail(rgb: F32, alpha: F32) -> float:
    """Mean gradient of luminance between covered pixels, weighted to the middle of the picture."""
    shades = np.clip(rgb, 0, 1) @ np.array(LUMINANCE, rgb.dtype)
    found = gradients(shades, alpha > SOLID).astype(np.float64)
    down, across = (np.exp(-0.5 * (np.linspace(-1, 1, side) / MIDDLE) ** 2) for side in found.shape)
    window = down[:, None] * across
    return float((found * window).sum() / window.sum())


def _spread(depths: F32) -> float:
    if not len(depths):
        return 1.0
    near, far = np.quantile(depths, (0.15, 0.85))
    return float(max(far / max(near, 1e-30), 1.0))
