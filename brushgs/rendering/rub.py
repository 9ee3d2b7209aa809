"""Rub soft tones: the effect of a thumb or a stump on masses of charcoal.

Tones are quantized softly to a few values, and the edges between these are blurred by varying amounts. The
amount is a noise in space, so it moves with the surfaces when the camera moves.
"""

from dataclasses import dataclass, replace
from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from brushgs.rendering.effect import positions_of
from brushgs.rendering.relief import canvas_scale
from brushgs.values.arrays import F32, F64, Array, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.surface import Surface

SHARP, SOFT = 0.9, 5.0  # least and largest standard deviation of the blur, px of a 1000 x 750 picture
RISE = 0.5  # width of the edge between two values before blurring, over their difference
GATHERED = 0.8  # share of the quantized tone; the rest is the original one
SOLID = (0.3, 0.7)  # range of coverage across the border of a mass
TOOTH = 0.2  # relative change of unrubbed tone, from the hollows of the paper to its peaks
TRUNCATED = 2.5  # radius of the blur, in standard deviations
STEP = 4  # pixels between samples of the noise; tiles are multiples of it
FINEST = (10.0, 30.0)  # px, wavelengths of the noise at which it is faded out, and at which it is full
# The noise is a sum of six waves: directions, evenly spread over the sphere, and phases.
_GOLDEN = (1 + 5**0.5) / 2
WAVES = np.array(
    [(0, 1, _GOLDEN), (0, -1, _GOLDEN), (1, _GOLDEN, 0), (-1, _GOLDEN, 0), (_GOLDEN, 0, 1), (_GOLDEN, 0, -1)]
) / np.hypot(1, _GOLDEN)
PHASES = np.array([0.3, 1.9, 4.1, 2.8, 5.4, 0.9])


@dataclass(frozen=True, eq=False)
class Rub:
    """Quantize the tones of a coat to values, and rub the edges between them: an `Effect`.

    Attributes:
        paper: RGB without tone.
        black: RGB of full tone; the colors of the coat lie between both.
        values: shares of black, ascending; the first and the last are the limits.
        strength: of the rubbing, 0 to 1.
        wave: wavelength of the noise, world units, > 0.
        is_room: whether the scene fills the picture; small holes in it then take the tones around them.
    """

    paper: tuple[float, float, float]
    black: tuple[float, float, float]
    values: tuple[float, ...]
    strength: float
    wave: float
    is_room: bool = False

    @property
    def traits(self) -> str:
        """See `Effect`."""
        return "rubbed tones"

    def __call__(
        self, painted: Frame, camera: Camera, surface: "Surface | None", part: Part | None = None
    ) -> Frame:
        """See `Effect`. Coverage never grows, except where holes of a room are filled."""
        if self.is_room:
            painted = _closed(painted, camera)
        dtype, pixel = painted.rgb.dtype, canvas_scale(camera.width, camera.height)
        paper = np.asarray(self.paper, dtype)
        tint = np.asarray(self.black, dtype) - paper
        pull = (tint / max(float(tint @ tint), 1e-12)).astype(dtype)
        alpha = painted.alpha
        shares = painted.rgb @ pull - alpha * (paper @ pull)
        shares /= np.maximum(alpha, np.finfo(dtype).tiny)
        low, high = SOLID
        solid: Array = smoothstep((alpha - low) / (high - low)).astype(dtype)
        toned: Array = solid * self._gathered(shares)
        assert painted.depth is not None, "effects are painted with depth"
        noise = self._noise(painted.depth, camera, part).astype(dtype)
        solid, toned = (_rubbed(plane, noise, pixel) for plane in (solid, toned))
        if surface is not None:
            toned *= 1 + TOOTH * (1 - noise) * (2 * surface.grain.astype(dtype) - 1)
        taken = np.minimum(solid, alpha)
        toned *= np.divide(taken, solid, out=np.zeros_like(solid), where=solid > 0)
        return replace(painted, rgb=taken[..., None] * paper + toned[..., None] * tint, alpha=taken)

    def reach(self, camera: Camera) -> int | None:
        """See `Effect`: radius of the widest blur; None in a room, whose holes have no least size."""
        if self.is_room:
            return None
        return ceil(TRUNCATED * SOFT * canvas_scale(camera.width, camera.height)) + 1

    def areas(self, picture: Array) -> None:
        """See `Effect`: none, tones are soft."""

    def stand_in(self, coat: "Coat") -> "Coat":
        """See `Effect`: the strokes themselves."""
        return replace(coat, effect=None)

    def waves(self, origin: F64) -> F64:
        """[6, 4] waves of the noise, relative to an origin [3]: radians per world unit, and phases."""
        directions = WAVES * (2 * np.pi / self.wave)
        return np.column_stack([directions, (PHASES + directions @ origin) % (2 * np.pi)])

    def _gathered(self, shares: Array) -> Array:
        """Shares of black, softly quantized to the values."""
        gathered = np.full_like(shares, self.values[0])
        for low, high in zip(self.values, self.values[1:], strict=False):
            if high > low:
                gathered += (high - low) * smoothstep(
                    (shares - 0.5 * (low + high)) / (RISE * (high - low)) + 0.5
                )
        return np.asarray(GATHERED * gathered + (1 - GATHERED) * shares, shares.dtype)

    def _noise(self, depth: Array, camera: Camera, part: Part | None = None) -> F32:
        """[H, W] amount of rubbing of each pixel, 0 to 1."""
        rows, columns = (np.arange(size)[STEP // 2 :: STEP] for size in depth.shape)
        if not len(rows) or not len(columns):
            return np.zeros(depth.shape, np.float32)
        # A camera whose pixel centers are those of every `STEP`-th pixel.
        shift = 0.5 - (STEP // 2 + 0.5) / STEP
        scale = np.array([[1 / STEP, 0, shift], [0, 1 / STEP, shift], [0, 0, 1]])
        few = depth[STEP // 2 :: STEP, STEP // 2 :: STEP]
        coarse = replace(camera, K=scale @ camera.K, width=len(columns), height=len(rows))
        corner = (0, 0) if part is None else (part.left // STEP, part.top // STEP)
        points = positions_of(few, coarse, corner)
        total = np.zeros(few.shape, np.float32)
        for *direction, phase in self.waves(np.zeros(3)).astype(np.float32):
            total += np.sin(points @ np.array(direction) + phase)
        pixels = self.wave * camera.K[0, 0] / np.maximum(few, 1e-30)
        finest, whole = FINEST
        total *= np.clip((pixels - finest) / (whole - finest), 0, 1)
        noise = self.strength * np.clip(0.5 + total / np.float32(len(WAVES) ** 0.5), 0, 1)
        found = noise.repeat(STEP, axis=0).repeat(STEP, axis=1)
        short = [(0, max(size - grown, 0)) for size, grown in zip(depth.shape, found.shape, strict=True)]
        return np.asarray(np.pad(found, short, mode="edge")[: depth.shape[0], : depth.shape[1]], np.float32)


def _closed(painted: Frame, camera: Camera) -> Frame:
    """The picture of a room without holes. They lie as far away as anything in it, so marks on them show."""
    from brushgs.rendering.depth_test import SOLID as SURFACE
    from brushgs.rendering.wet_layer import ROOM_SOLID, without_holes

    assert painted.depth is not None, "effects are painted with depth"
    diagonal = float(np.hypot(camera.width, camera.height))
    rgb, alpha = without_holes(painted.rgb, painted.alpha, ROOM_SOLID, diagonal)
    solid = np.minimum(ROOM_SOLID, 1 / np.maximum(alpha, np.finfo(alpha.dtype).tiny)).astype(alpha.dtype)
    is_hole = painted.alpha <= SURFACE
    farthest = np.max(painted.depth, where=~is_hole, initial=0)
    depth = np.where(is_hole, np.maximum(painted.depth, farthest), painted.depth)
    return replace(painted, rgb=rgb * solid[..., None], alpha=alpha * solid, depth=depth)


def _rubbed(plane: Array, noise: Array, pixel: float) -> Array:
    """A plane [H, W], blurred from little (noise 0) to most (noise 1)."""
    sharp, soft = (
        ndimage.gaussian_filter(plane, sigma * pixel, mode="nearest", truncate=TRUNCATED)
        for sigma in (SHARP, SOFT)
    )
    return np.asarray(sharp + noise * (soft - sharp))
