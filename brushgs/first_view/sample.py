"""The sample for finding the first view: the thinned middle of a scene, and small pictures of it.

Evidence comes from pictures, as they account for occlusion.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.framing import subject
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.values.arrays import F64, Array, Mask, Rows
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

# A picture costs 0.2 us per row and hardly anything per pixel. With 100,000 rows up and front of 13 scenes
# are the same, in 2.5 times the time; probabilities differ by at most 0.03, the chair's by 0.2.
MOST_ROWS = 30_000
SIDE = 96  # pixels
FAINTEST = 0.02  # opacity: below, haze
DISTANCE = 4.0  # of the camera from the middle, in radii
FILLED = 0.95  # share of the picture filled by the sphere around the sample
# Sizes (geometric mean of the two larger scales, over the radius) shown as shades 0 and 1.
FINEST, COARSEST = 1e-4, 0.3
CLIPPED = 0.999  # quantile at which weights are clipped, against a few huge Gaussians


@dataclass(frozen=True, eq=False)
class Sample:
    """The subject of a scene, thinned.

    Attributes:
        gaussians: n Gaussians, 1 <= n <= `MOST_ROWS`, of degree 0, inside the box of the subject; enlarged if
            thinned, so that surfaces stay closed.
        num_rows: Gaussians inside that box before thinning.
        center: [3] middle of the box, world units.
        radius: half the diagonal of the box, > 0, world units.
    """

    gaussians: Gaussians
    num_rows: int
    center: F64
    radius: float

    def camera(self, axes: F64, side: int = SIDE) -> Camera:
        """A picture of the whole sample, see `camera_around`."""
        return camera_around(self.center, self.radius, axes, side)

    @property
    def growth(self) -> float:
        """Factor on scales from thinning."""
        return float(np.sqrt(self.num_rows / len(self.gaussians)))

    @property
    def places(self) -> F64:
        """[n, 3] centers relative to the middle, in radii."""
        return np.asarray((self.gaussians.means - self.center) / self.radius)

    @property
    def areas(self) -> F64:
        """[n] product of the two larger scales before thinning, in square radii."""
        scales = np.sort(self.gaussians.scales.astype(np.float64), axis=1) / (self.radius * self.growth)
        return np.asarray(scales[:, 1] * scales[:, 2])

    @property
    def weights(self) -> F64:
        """[n] painted area, opacity x area, without the extremes."""
        return clipped(self.gaussians.opacities * self.areas, CLIPPED)

    @property
    def shades_of_size(self) -> F64:
        """[n] 0 to 1: logarithm of the size of each Gaussian between `FINEST` and `COARSEST`."""
        sizes = np.sqrt(np.maximum(self.areas, FINEST**2))
        return np.asarray(np.clip(np.log(sizes / FINEST) / np.log(COARSEST / FINEST), 0, 1))


def take_sample(gaussians: Gaussians) -> Sample | None:
    """The sample of N >= 1 Gaussians; None if nothing with extent is visible."""
    points, _ = subject(gaussians)
    low, high = points.min(axis=0), points.max(axis=0)
    radius = 0.5 * float(np.linalg.norm(high - low))
    seen = (gaussians.opacities > FAINTEST) & (gaussians.scales.max(axis=1) < radius)
    for axis in range(3):
        column = gaussians.means[:, axis]
        seen &= (column >= low[axis]) & (column <= high[axis])
    rows = np.flatnonzero(seen)
    if not radius > 0 or len(rows) == 0:
        return None
    kept = thin(gaussians, rows, MOST_ROWS)
    return Sample(kept, len(rows), 0.5 * (low + high), radius)


def thin(gaussians: Gaussians, rows: Rows, most: int) -> Gaussians:
    """At most `most` of some rows, degree 0, with scales enlarged to compensate.

    With unchanged scales, a scene of 100,000 thinned to 15,000 shows its inside: probabilities of up fall by
    0.1.
    """
    chosen = rows[thinned(len(rows), most)]
    growth = gaussians.means.dtype.type(np.sqrt(len(rows) / len(chosen)))
    largest = np.finfo(gaussians.means.dtype).max / growth
    return Gaussians(
        gaussians.means[chosen],
        gaussians.quats[chosen],
        np.minimum(gaussians.scales[chosen], largest) * growth,
        gaussians.opacities[chosen],
        gaussians.sh[chosen, :1],
    )


def thinned(count: int, most: int) -> Rows:
    """At most `most` of `count` row numbers, ascending: one per equal part.

    Rows of compressed files are sorted along a space-filling curve, so equal parts are spread evenly in
    space.
    """
    if count <= most:
        return np.arange(count)
    within = np.random.default_rng(0).random(most)
    return np.asarray(((np.arange(most) + within) * (count / most)).astype(np.intp))


def shaded(gaussians: Gaussians, *shades: Array) -> Gaussians:
    """The same Gaussians with up to three shades [n], 0 to 1, in place of red, green and blue."""
    sh = np.zeros((len(gaussians), 1, 3), gaussians.means.dtype)
    for channel, shade in enumerate(shades):
        sh[:, 0, channel] = (shade - 0.5) / C0
    return replace(gaussians, sh=sh)


def flat_colors(gaussians: Gaussians) -> Array:
    """[n, 3] view-independent colors of boxes of degree 0, rounded as by `project`."""
    return np.asarray(np.maximum(C0 * gaussians.sh[:, 0] + 0.5, 0))


def clipped(values: F64, quantile: float) -> F64:
    """The values with all above a quantile set to it."""
    return np.asarray(np.minimum(values, np.quantile(values, quantile)))


def camera_around(center: F64, radius: float, axes: F64, side: int = SIDE) -> Camera:
    """A square picture of the sphere around a sample.

    Args:
        center: [3] world units.
        radius: world units.
        axes: [3, 3] rows right, down, forward in world axes.
        side: pixels.
    """
    viewmat = np.eye(4)
    viewmat[:3, :3] = axes
    viewmat[:3, 3] = -axes @ (center - DISTANCE * radius * axes[2])
    focal = FILLED * 0.5 * side * DISTANCE
    K = np.array([[focal, 0, 0.5 * side], [0, focal, 0.5 * side], [0, 0, 1.0]])
    return Camera(viewmat, K, side, side, near=0.02 * radius)


class Painter:
    """Paints plain pictures for evidence, with or without depth."""

    def __init__(self, *, depth: bool = False) -> None:
        self.texture = StrokeTexture.open("gaussian")
        self.options = RenderOptions.of(self.texture, depth=depth)

    def __call__(self, gaussians: Gaussians, camera: Camera) -> Frame:
        """The picture of a camera."""
        return self.frame(self.boxes(gaussians, camera), camera)

    def boxes(self, gaussians: Gaussians, camera: Camera) -> Boxes:
        """The boxes of a camera, to paint several times in other colors."""
        return project_with(gaussians, camera, self.options)[0]

    def frame(self, boxes: Boxes, camera: Camera) -> Frame:
        """The picture of boxes."""
        return rasterize_with(boxes, camera, self.texture, self.options)


def unpremultiplied(frame: Frame) -> Array:
    """[H, W, 3] colors with straight alpha, 0 to 1."""
    return np.asarray(np.clip(frame.rgb / np.maximum(frame.alpha, 1e-3)[..., None], 0, 1))


def gradients(shades: Array, mask: Mask) -> Array:
    """[H - 1, W - 1] length of the gradient between neighbors inside a mask, per pixel."""
    across = np.abs(np.diff(shades, axis=1))[:-1] * (mask[:-1, :-1] & mask[:-1, 1:])
    down = np.abs(np.diff(shades, axis=0))[:, :-1] * (mask[:-1, :-1] & mask[1:, :-1])
    return np.asarray(np.hypot(across, down))
