"""The background of a scene: a toned ground, and a backdrop of loose strokes in space.

A captured object hangs in a void. Painters tone the canvas in the complement of their subject, and lay a few
loose strokes around it. Here these lie on a sphere around the scene and all cameras, so that they are fixed
while the camera moves. They are a separate set of strokes, to be painted before the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import tan

import numpy as np

from brushgs.cameras.framing import DEFAULT_FOV_Y, FLAT_ELEVATION, camera_axes, default_elevation
from brushgs.core.native import core as _core
from brushgs.passes.extent import robust_frame
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.arrays import F64, Array, Mask, smoothstep
from brushgs.values.camera import Camera, FirstView
from brushgs.values.colors import OKLAB, rgb_of_oklab
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import C0

RADIUS = 2.6  # of the sphere, in radii of the scene
BEYOND_EYE = 1.35  # or in distances of the farthest camera, whichever is larger
MOST_ZOOM = 2.2  # beyond it strokes get larger in the picture instead of more numerous
JITTER = 0.42  # of positions, in distances between strokes: enough to hide the lattice
SIZE_JITTER = 0.2  # of the logarithm of sizes
# Standard deviations to which a stroke may be seen. Boxes extend 2, but seen aslant their corners lie further
# out than a ball of that size: with 2.2 one of 10,000 strokes was missing.
REACH = 3.0
THICKNESS = 0.01  # of a stroke, over its size
# The field of their directions: around the vertical, up and down by waves, and a little at random.
_SWAY, _WAVES, _LOOSE = 0.8, np.array([2.17, -0.62, 1.55]), 0.25
_RISE = 1.1  # rate of change of lightness with height over the horizon

# Mean alpha of the border above which a scene fills its pictures. Objects have up to 0.14, and a truck on a
# plaza under an empty sky 0.55.
FULL_BORDER: float = _core.FULL_BORDER


@dataclass(frozen=True)
class Tone:
    """A color that matches the mean color of a scene, in OKLab.

    Attributes:
        lightness: 0 to 1.
        complement: share of the scene's a and b, with the opposite sign.
        warmth: (a, b) added to that.
    """

    lightness: float
    complement: float = 0.6
    warmth: tuple[float, float] = (0.012, 0.04)

    def lab(self, mean: F64) -> F64:
        """[3] this tone for a mean color [3], both OKLab."""
        return np.array([self.lightness, *(-self.complement * mean[1:] + self.warmth)])


@dataclass(frozen=True)
class Backdrop:
    """Style of the strokes of a backdrop.

    Attributes:
        strokes: number on the whole sphere, at the usual field of view.
        above: tone of the zenith.
        below: tone of the nadir.
        aspect: length over width, >= 1.
        size: of a stroke, in distances between strokes; 1.6 covers most of the sphere.
        opacity: above 0 to 1.
        lightness: standard deviation of L in OKLab from stroke to stroke.
        chroma: standard deviation of a and b.

    Raises:
        ValueError: if a value is out of range.
    """

    strokes: int = 2500
    above: Tone = Tone(0.66, 0.5, (0.0, 0.03))
    below: Tone = Tone(0.40, 0.3, (0.012, 0.03))
    aspect: float = 3.0
    size: float = 1.6
    opacity: float = 0.92
    lightness: float = 0.018
    chroma: float = 0.004

    def __post_init__(self) -> None:
        for name, is_right, rule in (
            ("strokes", self.strokes >= 0, ">= 0"),
            ("aspect", 1 <= self.aspect < np.inf, ">= 1 and finite"),
            ("size", 0 < self.size < np.inf, "positive and finite"),
            ("opacity", 0 < self.opacity <= 1, "above 0 to 1"),
            ("lightness", 0 <= self.lightness <= 0.5, "in 0 to 0.5"),
            ("chroma", 0 <= self.chroma <= 0.5, "in 0 to 0.5"),
        ):
            if not is_right:
                raise ValueError(f"Backdrop: {name} must be {rule}, got {getattr(self, name)}")


TONED = Tone(0.58)  # of a ground


def mean_lab(gaussians: Gaussians, weights: Array | None = None) -> F64:
    """[3] the mean color of a scene, OKLab.

    Args:
        gaussians: N Gaussians.
        weights: [N] >= 0; None for their paint, opacity x mean projected area. If all are zero, as in an
            empty scene, the mean is a middle gray.
    """
    if weights is None:
        weights = paint_of(gaussians)
    shares = np.ascontiguousarray(weights, np.float64)
    return np.asarray(_core.mean_lab(gaussians.sh, shares, OKLAB), np.float64)


def ground_color(gaussians: Gaussians, tone: Tone = TONED) -> tuple[float, float, float]:
    """RGB, display-encoded, 0 to 1, of a toned ground for a scene.

    Args:
        gaussians: N Gaussians.
        tone: by default of middle lightness, the complement of the scene, a little warm.
    """
    red, green, blue = _display_rgb(tone.lab(mean_lab(gaussians))[None])[0]
    return float(red), float(green), float(blue)


def reason_for_none(first_view: FirstView, plain: Sequence[Frame]) -> str | None:
    """Why a scene gets no backdrop, for the report; None if it gets one.

    A scene gets none if it is seen from inside, or fills its pictures, or is flat, such as land seen from the
    air: floating strokes below it would look like water. Surroundings alone do not decide: a plaza may end at
    the horizon without a sky.

    Args:
        first_view: of the scene.
        plain: plain pictures of it, in some views of the job; without any it is assumed not to fill them.
    """
    if first_view.eye is not None:
        return "the scene is seen from inside"
    if is_land(first_view):
        return "the scene is flat, and seen from above"
    return reason_of_border(plain)


def is_land(first_view: FirstView) -> bool:
    """Whether a scene is flat and seen from outside, such as land seen from the air."""
    return first_view.eye is None and default_elevation(first_view.points, first_view.up) == FLAT_ELEVATION


def reason_of_border(plain: Sequence[Frame]) -> str | None:
    """Why pictures [any number] of a scene leave no room for a backdrop; None if they do."""
    if plain and float(np.mean([border_alpha(frame) for frame in plain])) >= FULL_BORDER:
        return "the scene fills the picture up to its border"
    return None


def border_alpha(frame: Frame) -> float:
    """Mean alpha of the border of a picture, 8 % of its smaller side wide."""
    return _core.border_alpha(np.ascontiguousarray(frame.alpha))


def backdrop(
    gaussians: Gaussians,
    first_view: FirstView,
    cameras: Sequence[Camera],
    look: Backdrop | None = None,
    *,
    weights: Array | None = None,
    seed: int = 0,
) -> Gaussians:
    """Loose strokes on a sphere around a scene and all cameras, only those visible to some camera.

    Args:
        gaussians: the scene, N Gaussians, for colors and extent.
        first_view: of the scene, for its up axis.
        cameras: all views of the job. They decide the radius of the sphere, the number of strokes (more for a
            narrow field of view, up to 2.2^2 times as many), and which are kept.
        look: style of the strokes; None for loose dry ones, light above and dark below.
        weights: see `mean_lab`.
        seed: of the jitter.

    Returns:
        Flat strokes that face the center, without view-dependent color, in the dtype of the scene.

    Raises:
        ValueError: if there is no camera.
    """
    if not cameras:
        raise ValueError("backdrop: there must be at least one camera, got none")
    look = Backdrop() if look is None else look
    center, radius = robust_frame(gaussians.means)
    farthest = max(float(np.linalg.norm(camera.position - center)) for camera in cameras)
    radius = max(RADIUS * radius, BEYOND_EYE * farthest)
    count = round(look.strokes * min(max(map(_zoom, cameras)), MOST_ZOOM) ** 2)
    g = np.random.default_rng([seed, count])
    axes = camera_axes(first_view.up, 0.0, 0.0)  # right, down, forward

    outward, along = sphere(count, g)
    mean = mean_lab(gaussians, weights)
    rise = smoothstep(0.5 - _RISE * outward[:, 1:2])
    lab = rise * look.above.lab(mean) + (1 - rise) * look.below.lab(mean)
    lab += g.normal(0, 1, (count, 3)) * (look.lightness, look.chroma, look.chroma)

    spacing = radius * np.sqrt(4 * np.pi / max(count, 1))
    size = look.size / 4 * spacing * np.exp(g.normal(0, SIZE_JITTER, (count, 1)))
    scales = size * (np.sqrt(look.aspect), 1 / np.sqrt(look.aspect), THICKNESS)
    means = center + radius * (outward @ axes)
    kept = seen_by_any(means, REACH * scales[:, 0], cameras)
    frames = np.stack([along @ axes, np.cross(outward, along) @ axes, outward @ axes], axis=2)[kept]
    frames[:, :, 2] *= np.sign(np.linalg.det(frames))[:, None]
    return Gaussians(
        means[kept],
        quats_of(frames),
        scales[kept],
        np.full(int(kept.sum()), look.opacity),
        ((_display_rgb(lab[kept]) - 0.5) / C0)[:, None],
    ).astype(gaussians.means.dtype.type)


def sphere(count: int, g: np.random.Generator) -> tuple[F64, F64]:
    """[n, 3] directions and, across them, [n, 3] axes of strokes; right, down, forward.

    A Fibonacci lattice around the vertical, jittered; the axes follow a swirl around it.
    """
    k = np.arange(count) + 0.5
    down, turn = 2 * k / max(count, 1) - 1, np.pi * (1 + np.sqrt(5)) * k
    level = np.sqrt(1 - down * down)
    outward = np.stack([level * np.cos(turn), down, level * np.sin(turn)], axis=1)
    outward += g.normal(0, JITTER * np.sqrt(4 * np.pi / max(count, 1)), (count, 3)) / np.sqrt(2)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    vertical = np.array([0.0, -1.0, 0.0])
    along = np.cross(outward, vertical) + _SWAY * np.sin(outward @ _WAVES)[:, None] * vertical
    along += _LOOSE * g.normal(0, 1, (count, 3))
    along -= (along * outward).sum(axis=1, keepdims=True) * outward
    return outward, along / np.linalg.norm(along, axis=1, keepdims=True)


def _zoom(camera: Camera) -> float:
    """Zoom of a camera relative to the usual field of view, at least 1."""
    return max(float(camera.K[1, 1]) / (0.5 * camera.height) * tan(0.5 * DEFAULT_FOV_Y), 1.0)


def seen_by_any(means: F64, reaches: F64, cameras: Sequence[Camera]) -> Mask:
    """Mask of the balls, of radius `reaches`, that may show in some camera."""
    seen = np.zeros(len(means), bool)
    for camera in cameras:
        rows = np.flatnonzero(~seen)
        if not rows.size:
            break
        x, y, z = (means[rows] @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]).T
        (fx, cx), (fy, cy) = camera.K[0, [0, 2]], camera.K[1, [1, 2]]
        inside = z > camera.near
        # The four planes through the eye and the sides of the picture.
        for side, focal in ((x * fx + z * cx, fx), (z * (camera.width - cx) - x * fx, fx)):
            inside &= side > -reaches[rows] * np.hypot(focal, max(cx, camera.width - cx))
        for side, focal in ((y * fy + z * cy, fy), (z * (camera.height - cy) - y * fy, fy)):
            inside &= side > -reaches[rows] * np.hypot(focal, max(cy, camera.height - cy))
        seen[rows[inside]] = True
    return seen


def _display_rgb(lab: F64) -> F64:
    """[n, 3] display-encoded colors of OKLab, clipped to 0 to 1."""
    return np.asarray(np.clip(rgb_of_oklab(lab), 0, 1))
