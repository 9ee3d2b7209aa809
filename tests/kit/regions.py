"""Regions of the still life, which body each Gaussian is of, and how well what is found agrees with that."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.rendering.render import render
from brushgs.still_life import NUM_GAUSSIANS
from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import cast_of, joined
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

SIZE = (640, 480)
TARGET, DISTANCE, FOV_Y = (0.12, -1.42, 0.2), 10.6, np.radians(34.0)
ARC, ELEVATIONS = np.radians(75.0), np.radians((14.0, 38.0))  # to each side; of views in turn
EDGE = 2  # pixels
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
# Numbers of their bodies, as `bodies` yields them.
REGIONS = {
    "cloth": range(2, 3),
    "jug": range(3, 5),
    "bottle": range(5, 6),
    "bowl": range(6, 7),
    "oranges": range(7, 11),
    "pear": range(13, 15),
    "all but wall and table": range(2, 100),
}


def owners(num_gaussians: int = NUM_GAUSSIANS, seed: int = 0):
    """[N] the number of the body that each Gaussian of the still life was made for."""
    rng = np.random.default_rng(seed)
    cast = joined(
        [cast_of(body, number, rng) for number, body in enumerate(list(bodies(num_gaussians, rng)))]
    )
    return cast.surface.bodies[cast.opacities > 1 / 255]


def cameras(num: int, *, between: bool = False, size: tuple[int, int] = SIZE) -> list[Camera]:
    """Views along the arc; those `between` stand where those of masks do not."""
    places = (np.arange(num) + 0.5) / num if between or num == 1 else np.linspace(0, 1, num)
    found = []
    for number, place in enumerate(places):
        azimuth, elevation = (2 * place - 1) * ARC, ELEVATIONS[(number + between) % 2]
        away = np.cos(elevation) * np.sin(azimuth), -np.sin(elevation), -np.cos(elevation) * np.cos(azimuth)
        eye = np.array(TARGET) + DISTANCE * np.array(away)
        width, height = size
        found.append(Camera.look_at(eye, TARGET, width=width, height=height, fov_y=float(FOV_Y)))
    return found


def in_two_colors(gaussians: Gaussians, inside, one=RED, other=BLUE) -> Gaussians:
    """Gaussians in one color inside, and another outside."""
    colors = np.where(inside[:, None], one, other)
    return replace(gaussians, sh=((colors - 0.5) / C0)[:, None].astype(gaussians.sh.dtype))


def mask_of(gaussians: Gaussians, inside, camera: Camera):
    """[H, W] 1 where a region makes up half of a pixel or more."""
    frame = render(in_two_colors(gaussians, inside), camera, "gaussian")
    return (frame.rgb[..., 0] >= 0.5).astype(np.float32)


def iou(found, truth, weights=None) -> float:
    """Intersection over union of two masks of Gaussians or pixels, 0 to 1."""
    weights = np.ones(truth.shape) if weights is None else weights
    return float(weights[found & truth].sum() / weights[found | truth].sum())


def leakage(gaussians: Gaussians, found, truth, views: Sequence[Camera]) -> float:
    """Alpha of the wrong color over that of both, away from outlines, 0 to 1."""
    from scipy.ndimage import binary_dilation, binary_erosion

    wrong, total = 0.0, 0.0
    for camera in views:
        mask = mask_of(gaussians, truth, camera) > 0
        rgb = render(in_two_colors(gaussians, found), camera, "gaussian").rgb
        inner = binary_erosion(mask, iterations=EDGE, border_value=1)
        outer = ~binary_dilation(mask, iterations=EDGE)
        wrong += float(rgb[inner, 2].sum() + rgb[outer, 0].sum())
        total += float(rgb[inner].sum() + rgb[outer].sum())
    return wrong / total
