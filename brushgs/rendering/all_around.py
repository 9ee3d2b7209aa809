"""Light and paper of spherical pictures, continuous across the faces of the cube.

A lamp and a canvas fixed to each face would show seams.
"""

from dataclasses import replace
from math import atan2, cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from brushgs.rendering.light import BLUR, BLUR_MOVING, LEAST_RISE, Lamp, light
from brushgs.rendering.relief import canvas_scale
from brushgs.rendering.space_noise import Anchor, space_noise
from brushgs.rendering.surface import GRAIN, PAPER_COARSE, Surface
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting

NUM_LAMPS = 8  # lamp directions around the canvas between which light is interpolated
GRAIN_OCTAVES = 2  # of the paper: coarse and fine bumps


def lit_all_around(frame: Frame, lamp: Lamp, face: Camera, down: F64, *, is_moving: bool) -> Array:
    """Light a face of a cube by a lamp whose direction on the canvas varies over the sphere.

    A lamp fixed to the canvas keeps its angle to the local down direction; a lamp in the scene keeps its
    direction in space. Shading is nearly linear in the slope of the light, so it is interpolated between a
    few lamps.

    Args:
        frame: the face, with height.
        lamp: of the painting.
        face: its camera.
        down: [3] direction to the nadir, axes of the face.
        is_moving: see `Painting`.
    """
    blur, height = BLUR_MOVING if is_moving else BLUR, frame.height
    assert height is not None, "paint with relief"

    def lit(one: Lamp) -> Array:
        return light(frame.rgb, height, one, alpha=frame.alpha, blur=blur)

    slopes = _slopes(lamp, face, down)
    if np.ptp(slopes, axis=(0, 1)).max() < 1e-9:
        slope_x, slope_y = slopes[0, 0]
        return lit(_lamp_of(lamp, float(slope_x), float(slope_y)))
    step, length = 2 * pi / NUM_LAMPS, np.linalg.norm(slopes, axis=2)
    radius = max(float(length.max()), 1e-9) / cos(step / 2)
    turn = np.arctan2(slopes[..., 1], slopes[..., 0]) % (2 * pi)
    sector, within = np.divmod(turn, step)
    shares = length / (radius * sin(step))
    first, second = shares * np.sin(step - within), shares * np.sin(within)
    mixed = (1 - first - second)[..., None] * lit(_lamp_of(lamp, 0.0, 0.0))
    for number in range(NUM_LAMPS):
        weight = np.where(sector % NUM_LAMPS == number, first, 0)
        weight += np.where((sector + 1) % NUM_LAMPS == number, second, 0)
        if weight.any():
            around = step * number
            mixed += weight[..., None] * lit(_lamp_of(lamp, radius * cos(around), radius * sin(around)))
    return np.asarray(mixed, frame.rgb.dtype)


def _slopes(lamp: Lamp, face: Camera, down: F64) -> F64:
    """[H, W, 2] slope of the light at each pixel: horizontal direction to the lamp over its height."""
    x, y = _places(face)
    towards = down if lamp.towards is None else face.viewmat[:3, :3] @ np.asarray(lamp.towards)
    right, below = towards[0] - x * towards[2], towards[1] - y * towards[2]
    azimuth = np.arctan2(below, right)
    if lamp.towards is None:
        azimuth += lamp.azimuth - 0.5 * pi
        flatness = np.full(azimuth.shape, cos(lamp.elevation) / sin(lamp.elevation))
    else:
        ahead = (towards[0] * x + towards[1] * y + towards[2]) / np.sqrt(1 + x**2 + y**2)
        flatness = np.sqrt(np.maximum(1 - ahead**2, 0)) / np.maximum(-ahead, LEAST_RISE)
    return np.stack([flatness * np.cos(azimuth), flatness * np.sin(azimuth)], axis=2)


def _lamp_of(lamp: Lamp, slope_x: float, slope_y: float) -> Lamp:
    """The lamp, fixed to the canvas in the direction of a slope."""
    length = float(np.hypot(slope_x, slope_y))
    return replace(lamp, azimuth=atan2(slope_y, slope_x), elevation=atan2(1, length), towards=None)


def paper_all_around(painting: "Painting", face: Camera) -> Surface | None:
    """The ground of a face: its color, and paper grain as noise on the sphere, without weave."""
    surface = painting.surface
    if surface is None:
        return None
    shape = face.height, face.width
    color = surface.rgb.reshape(-1, 3).mean(axis=0) if surface.recipe is None else surface.recipe.color
    rgb = np.broadcast_to(np.asarray(color, np.float32), (*shape, 3))
    grain = np.ones(shape, np.float32)
    if any(coat.dry or coat.effect is not None for coat in painting.coats):
        x, y = _places(face)
        place = tuple(map(float, face.position))
        anchor = Anchor(center=place, scale=1.0, focus=place, reach=1.0)  # type: ignore[arg-type]
        finest = 2 * PAPER_COARSE * canvas_scale(face.width, face.height) / np.hypot(*shape)
        depth = (1 / np.sqrt(1 + x**2 + y**2)).astype(np.float32)
        noise = space_noise(depth, face, anchor, finest=float(finest), octaves=GRAIN_OCTAVES)
        grain = np.clip(0.5 + GRAIN * noise[..., 0], 0, 1).astype(np.float32)
    return Surface(rgb, np.zeros(shape, np.float32), grain)


def _places(face: Camera) -> tuple[F64, F64]:
    """X [1, W] and y [H, 1] of the pixel centers of a camera at depth 1."""
    x = (np.arange(face.width) + 0.5 - face.K[0, 2]) / face.K[0, 0]
    y = (np.arange(face.height) + 0.5 - face.K[1, 2]) / face.K[1, 1]
    return x[None], y[:, None]
