"""Spherical pictures, of all directions or a half sphere, from the faces of a cube around the camera.

Each face is a perspective picture of 90 degrees and a margin, as media need the surroundings of a pixel.
Faces are resampled to an equirectangular picture: column and row are longitude and latitude. Adjacent faces
are cross-faded within `BAND`. The poles and the seam at longitude 180 degrees lie in the middle of faces.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import atan2, ceil, cos, pi, radians, sin, tan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import side_by_side
from brushgs.options.projection import ProjectionConfig
from brushgs.rendering.light import BLUR, BLUR_MOVING, LEAST_RISE, Lamp, light
from brushgs.rendering.relief import canvas_scale
from brushgs.rendering.space_noise import Anchor, space_noise
from brushgs.rendering.surface import GRAIN, PAPER_COARSE, Surface
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.project import Directions
    from brushgs.rendering.wanted import Wanted


HALF_FACE, MARGIN, BAND = radians(45), radians(2), radians(0.75)  # half angle of view; additions to it
GUIDE_MARGIN = radians(10)  # margin of the views that strokes are made for: media leave borders bare
SHARPNESS = 1.5  # pixels in the middle of a face per pixel of the equator
SAMPLES = 2  # per pixel, along each side
BAND_PIXELS = 1 << 17  # resampled at once
# Axes of a face (right, down, forward) in camera axes.
FRONT = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
RIGHT, LEFT = ((0, 0, -1), (0, 1, 0), (1, 0, 0)), ((0, 0, 1), (0, 1, 0), (-1, 0, 0))
BACK = ((-1, 0, 0), (0, 1, 0), (0, 0, -1))
UP, DOWN = ((1, 0, 0), (0, 0, 1), (0, -1, 0)), ((1, 0, 0), (0, 0, -1), (0, 1, 0))


@dataclass(frozen=True)
class Sphere:
    """The cube faces around a camera, and the equirectangular picture made of them.

    Attributes:
        width: of the picture of one eye, pixels.
        height: of the picture, pixels; 180 degrees.
        span: angle of view of the width, radians: 2 pi or pi.
    """

    width: int
    height: int
    span: float

    @property
    def turns(self) -> tuple[F64, ...]:
        """[3, 3] each, axes of the faces; a half sphere has none behind."""
        faces = (FRONT, RIGHT, LEFT, UP, DOWN) if self.span < 2 * pi else (FRONT, RIGHT, BACK, LEFT, UP, DOWN)
        return tuple(np.array(face, np.float64) for face in faces)

    @property
    def focal(self) -> float:
        """Focal length of the faces, pixels."""
        return SHARPNESS * self.width / self.span

    def faces(self, camera: Camera, margin: float = MARGIN) -> list[Camera]:
        """The cameras of the faces around `camera`, front first; only its pose and `near` are used."""
        side = 2 * ceil(self.focal * tan(HALF_FACE + margin))
        K = np.array([[self.focal, 0, 0.5 * side], [0, self.focal, 0.5 * side], [0, 0, 1]])
        cameras = []
        for turn in self.turns:
            viewmat = np.eye(4)
            viewmat[:3] = turn @ camera.viewmat[:3]
            cameras.append(Camera(viewmat, K, side, side, near=camera.near))
        return cameras

    def frames(
        self, painting: "Painting", camera: Camera, eyes: Sequence[Camera], wanted: "Wanted"
    ) -> list[Frame]:
        """The pictures of eyes near a camera; with several eyes, stroke directions are those of its faces."""
        from brushgs.rendering.rigs import directions_between

        locked: list[Sequence[Directions | None]] = [()] * len(self.turns)
        if len(eyes) > 1:
            locked = [directions_between(painting.coats, face) for face in self.faces(camera)]
        return [self._frame(painting, eye, locked, wanted) for eye in eyes]

    def _frame(
        self,
        painting: "Painting",
        eye: Camera,
        locked: "Sequence[Sequence[Directions | None]]",
        wanted: "Wanted",
    ) -> Frame:
        painted = [
            self._face(painting, face, turn, directions, wanted)
            for face, turn, directions in zip(self.faces(eye), self.turns, locked, strict=True)
        ]
        smooth = _smooth(painted)
        mixed = self._split(smooth, self.resampled(_stacked(smooth)))
        depth = None
        depths = [face.depth for face in painted if face.depth is not None]
        if depths:
            depth = self.nearest([one[..., None] * self._lengths() for one in depths])[..., 0]
        layers: dict[str, Any] = {"paint": mixed["paint"][..., 0]} if "paint" in mixed else {}
        if "depth" in wanted.layers and depth is not None:
            layers["depth"] = depth
        if "normal" in wanted.layers:
            turned = zip(painted, self.turns, strict=True)
            layers["normal"] = self.nearest(
                [np.asarray(face.layers["normal"]) @ turn for face, turn in turned]
            )
        if "unlit" in mixed:
            layers["unlit"] = mixed["unlit"]
        return Frame(mixed["rgb"], mixed["alpha"][..., 0], depth, layers=layers)

    def _face(
        self,
        painting: "Painting",
        face: Camera,
        turn: F64,
        directions: "Sequence[Directions | None]",
        wanted: "Wanted",
    ) -> Frame:
        """Render one face, with light and paper of the sphere."""
        flat = replace(painting, surface=paper_all_around(painting, face), lamp=None)
        frame = flat.frame(face, directions, wanted=wanted)
        if painting.lamp is None or frame.height is None:
            return frame
        rgb = lit_all_around(frame, painting.lamp, face, turn[:, 1], is_moving=painting.is_moving)
        return replace(frame, rgb=rgb)

    def _lengths(self) -> Array:
        """[side, side, 1] distance along the ray of each pixel of a face, over its depth."""
        side = 2 * ceil(self.focal * tan(HALF_FACE + MARGIN))
        across = ((np.arange(side) + 0.5 - 0.5 * side) / self.focal).astype(np.float32) ** 2
        return np.asarray(np.sqrt(1 + across[:, None] + across)[..., None])

    def resampled(self, faces: Sequence[Array]) -> F32:
        """Resample faces [side, side, C] to [height, width, C]: bilinear, mean of `SAMPLES`^2 samples."""
        side, channels = faces[0].shape[1:]
        picture = np.empty((self.height, self.width, channels), np.float32)
        pixels = [np.ascontiguousarray(face, np.float32).reshape(-1, channels) for face in faces]

        def fill(rows: slice) -> None:
            rays = self.rays(rows, SAMPLES)
            mixed, total = np.zeros((len(rays), channels), np.float32), np.zeros((len(rays), 1), np.float32)
            for face, turn in zip(pixels, self.turns, strict=True):
                places, x, y, weights = self._seen(rays, turn, side)
                mixed[places] += weights * _between(face, x, y, side)
                total[places] += weights
            mixed /= total
            shape = rows.stop - rows.start, SAMPLES, self.width, SAMPLES, channels
            picture[rows] = mixed.reshape(shape).mean(axis=(1, 3))

        side_by_side(fill, list(self._bands()))
        return picture

    def nearest(self, faces: Sequence[Array]) -> F32:
        """Resample faces to [height, width, C] by the nearest pixel, for depths and normals."""
        side, channels = faces[0].shape[1:]
        picture = np.empty((self.height, self.width, channels), np.float32)
        for rows in self._bands():
            rays = self.rays(rows, 1)
            found, most = np.zeros((len(rays), channels), np.float32), np.zeros(len(rays), np.float32)
            for face, turn in zip(faces, self.turns, strict=True):
                places, x, y, weights = self._seen(rays, turn, side)
                is_best = weights[:, 0] > most[places]
                places, x, y = (
                    places[is_best],
                    np.rint(x[is_best]).astype(int),
                    np.rint(y[is_best]).astype(int),
                )
                most[places], found[places] = weights[is_best, 0], face[y, x]
            picture[rows] = found.reshape(-1, self.width, channels)
        return picture

    def rays(self, rows: slice, samples: int) -> F32:
        """[h * samples * width * samples, 3] directions of the samples in these rows, camera axes."""
        down = (np.arange(rows.start * samples, rows.stop * samples) + 0.5) / (samples * self.height)
        across = (np.arange(self.width * samples) + 0.5) / (samples * self.width)
        latitude, longitude = (0.5 - down)[:, None] * pi, (across - 0.5) * self.span
        rays = np.empty((len(down), len(across), 3), np.float32)
        rays[..., 0] = np.cos(latitude) * np.sin(longitude)
        rays[..., 1] = -np.sin(latitude)
        rays[..., 2] = np.cos(latitude) * np.cos(longitude)
        return rays.reshape(-1, 3)

    def _seen(self, rays: F32, turn: F64, side: int) -> tuple[NDArray[np.intp], F32, F32, F32]:
        """Indices of the rays that hit a face, their x and y in it, and cross-fade weights [n, 1]."""
        x, y, z = (rays @ axis.astype(np.float32) for axis in turn)
        off = np.maximum(np.abs(x), np.abs(y))
        places = np.flatnonzero(off < z * tan(HALF_FACE + BAND))
        x, y, z, off = (one[places] for one in (x, y, z, off))
        share = np.clip(0.5 - (np.arctan2(off, z) - HALF_FACE) / (2 * BAND), 1e-5, 1)
        weights = share * share * (3 - 2 * share)
        middle = 0.5 * side - 0.5
        return places, x / z * self.focal + middle, y / z * self.focal + middle, weights[:, None]

    def _bands(self) -> Iterator[slice]:
        step = max(BAND_PIXELS // self.width, 1)
        for start in range(0, self.height, step):
            yield slice(start, min(start + step, self.height))

    def _split(self, parts: dict[str, list[Array]], mixed: F32) -> dict[str, F32]:
        """Undo `_stacked`: the channels of `mixed` by name."""
        ends = np.cumsum([planes[0].shape[2] for planes in parts.values()])
        return dict(zip(parts, np.split(mixed, ends[:-1], axis=2), strict=True))


def sphere_of(projection: ProjectionConfig, camera: Camera) -> Sphere:
    """The sphere whose picture has the size of the camera's."""
    return Sphere(camera.width, camera.height, pi if projection.stereo == "vr180" else 2 * pi)


def _smooth(painted: Sequence[Frame]) -> dict[str, list[Array]]:
    """The planes [side, side, C] of faces that are resampled smoothly, by name."""
    smooth: dict[str, list[Array]] = {
        "rgb": [face.rgb for face in painted],
        "alpha": [face.alpha[..., None] for face in painted],
    }
    for name in ("unlit", "paint"):
        if name in painted[0].layers:
            planes = [np.asarray(face.layers[name]) for face in painted]
            smooth[name] = [plane.reshape(*plane.shape[:2], -1) for plane in planes]
    return smooth


def _stacked(parts: dict[str, list[Array]]) -> list[Array]:
    """Concatenate the channels of each face."""
    return [np.concatenate(face, axis=2) for face in zip(*parts.values(), strict=True)]


def _between(face: F32, x: F32, y: F32, side: int) -> F32:
    """[n, C] bilinear interpolation of the pixels [side * side, C] of a face."""
    column, row = x.astype(np.int32), y.astype(np.int32)
    right, below = (x - column)[:, None], (y - row)[:, None]
    first = row * side + column
    upper, lower = (
        face.take(at, axis=0) * (1 - right) + face.take(at + 1, axis=0) * right
        for at in (first, first + side)
    )
    return np.asarray(upper * (1 - below) + lower * below)


# Light and paper of spherical pictures, continuous across the faces of the cube.
#
# A lamp and a canvas fixed to each face would show seams.


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
