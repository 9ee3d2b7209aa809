"""Strokes lit by a lamp in the scene: warm and light where it shines, cool in the shade.

Light is a key, which depends on the angle and is blocked by strokes, and a fill, which comes from above and
is reflected by the table. Colors of strokes are changed in OKLab by the ratio of this light to their present
light. That is unknown in a capture: then the mean of the new light is used, so the scene keeps its overall
lightness, and the share of the lamp that is already in its colors is subtracted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.add.stage_place import Place
from brushgs.passes.color.color_space import in_gamut
from brushgs.passes.color.key_normals import Facing, find_facing, paint_shares
from brushgs.passes.color.squint import DARKS, LIGHTS, lab_of
from brushgs.values.arrays import F32, F64, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors, shift_base_colors

# The share of a lamp's light that reaches each stroke.
#
# Paint between a stroke and the lamp is counted in cells along the direction of the lamp. Every stroke is
# spread over a few points, and these over the cells around them, so small motions of lamp or scene cause no
# jumps. The light of a stroke is read above its surface, so that it does not shade itself. Source: Kim and
# Neumann 2001, Opacity shadow maps.


SIDE = 96  # cells per side, each 1/37 of the subject's radius; 128 take three times as long
REACH = 1.3  # half a side, in radii; paint beyond casts no shadow
FADES = 0.3  # radii within REACH over which shadows fade out
DENSITY = 1.5  # optical depth of paint that covers a cell once, as for the shadow on a table
LEAST_SEEN = 0.15  # minimum visible share of a stroke's area, seen edge-on
OFF_SURFACE, TOWARD_LAMP = 2.0, 2.0  # cells above a stroke where its light is read; less is speckled
ROUNDS = 2  # of blurs (1/4, 1/2, 1/4) across the lamp: penumbra, and no gaps between points
LARGEST = 0.5  # radii; points of larger strokes would be far apart
# Three points along each axis of a stroke, standard deviations, with the moments of a Gaussian (Gauss and
# Hermite), and their weights.
_POINTS, _SHARES = np.array([-(3**0.5), 0.0, 3**0.5]), np.array([1 / 6, 2 / 3, 1 / 6])
_PAIR = np.arange(2)


@dataclass(frozen=True, eq=False)
class Blockers:
    """n points that block light, in radii from the middle of a subject.

    Attributes:
        points: [n, 3] local axes, of which the second is up.
        paint: [n] opacity times area, radii squared.
        normals: [n, 3] of their surfaces.
    """

    points: F64
    paint: F64
    normals: F64

    @classmethod
    def of(cls, strokes: Gaussians, centers: F64, axes: F64, radius: float, normals: F64) -> "Blockers":
        """The points of strokes.

        Args:
            strokes: k strokes.
            centers: [k, 3] their positions, local, in radii.
            axes: [3, 3] rows are the local axes.
            radius: world units.
            normals: [k, 3] local.
        """
        order = np.argsort(strokes.scales, axis=1)[:, 1:]
        scales = np.take_along_axis(strokes.scales, order, axis=1).astype(np.float64)
        scales = np.minimum(scales / radius, LARGEST)
        turned = axes @ rotation_matrices(strokes.quats)
        along = np.take_along_axis(turned, order[:, None, :], axis=2) * scales[:, None, :]
        steps = np.stack(np.meshgrid(_POINTS, _POINTS, indexing="ij"), axis=2).reshape(-1, 2)
        shares = np.outer(_SHARES, _SHARES).ravel()
        points = (centers[:, None] + np.einsum("kij,pj->kpi", along, steps)).reshape(-1, 3)
        away = np.linalg.norm(points, axis=1)
        near = 1 - smoothstep((away - (REACH - FADES)) / FADES)
        area = 2 * np.pi * scales[:, 0] * scales[:, 1] * strokes.opacities
        paint = (area[:, None] * shares).ravel() * near
        rows = np.flatnonzero(paint > 0)
        return cls(points[rows], paint[rows], np.repeat(normals, len(shares), axis=0)[rows])


def lamp_axes(lamp: F64) -> F64:
    """[3, 3] rows: two directions across a unit vector, and itself, by the shortest rotation from upright."""
    x, y, z = lamp
    rise = 1 / max(1 + y, 1e-6)
    return np.array([[1 - x * x * rise, -x, -x * z * rise], [-x * z * rise, -z, 1 - z * z * rise], lamp])


def light_through(blockers: Blockers, lamp: F64, centers: F64, normals: F64, *, is_inside: bool) -> F64:
    """[k] share of the light of a lamp, 0 to 1, that reaches strokes.

    Args:
        blockers: block light.
        lamp: [3] unit vector toward it, local.
        centers: [k, 3] positions of strokes, local, in radii.
        normals: [k, 3] local.
        is_inside: whether the light comes in from outside: then surfaces that face away from the lamp, such
            as walls and ceiling of a room, block none.
    """
    if len(blockers.points) == 0 or len(centers) == 0:
        return np.ones(len(centers))
    cell, axes = 2 * REACH / SIDE, lamp_axes(lamp)
    facing = blockers.normals @ lamp
    paint = blockers.paint * (LEAST_SEEN + (1 - LEAST_SEEN) * np.abs(facing))
    if is_inside:
        paint = paint * smoothstep(2 * facing)
    cells, weights = _corners(_cells(blockers.points @ axes.T))
    sums = np.bincount(cells.ravel(), (weights * paint[:, None]).ravel(), SIDE**3)
    depths = _blurred((DENSITY / cell**2 * sums).astype(np.float32).reshape(SIDE, SIDE, SIDE))
    # Paint above the middle of a cell.
    above = np.cumsum(depths[:, :, ::-1], axis=2)[:, :, ::-1] - 0.5 * depths
    offset = centers + cell * (OFF_SURFACE * normals + TOWARD_LAMP * lamp)
    cells, weights = _corners(_cells(offset @ axes.T))
    return np.asarray(np.einsum("kc,kc->k", weights, np.exp(-above.ravel()[cells])))


def _cells(points: F64) -> F64:
    """[n, 3] fractional cells, counted from the middle of the first, clamped to the border."""
    return np.clip((points / REACH + 1) * (SIDE / 2) - 0.5, 0, SIDE - 1 - 1e-9)


def _corners(at: F64) -> tuple[NDArray[np.int64], F64]:
    """[n, 8] the cells around each fractional cell [n, 3], and their weights, which add up to 1."""
    low = at.astype(np.int64)
    share = at - low
    both = np.stack([1 - share, share], axis=2)
    weights = both[:, 0, :, None, None] * both[:, 1, None, :, None] * both[:, 2, None, None, :]
    first = (low[:, 0] * SIDE + low[:, 1]) * SIDE + low[:, 2]
    steps = (_PAIR[:, None, None] * SIDE + _PAIR[None, :, None]) * SIDE + _PAIR
    return first[:, None] + steps.ravel(), weights.reshape(-1, 8)


def _blurred(volume: F32) -> F32:
    """A volume softened across its first two axes, in place."""
    for _ in range(ROUNDS):
        for ends in (volume, volume.transpose(1, 0, 2)):
            mean = ends * np.float32(0.5)
            mean[1:] += 0.25 * ends[:-1]
            mean[:-1] += 0.25 * ends[1:]
            ends[:] = mean
    return volume


# The light. Beside a key of 1:
FILL = 0.3  # in a capture, for legible shade
KNOWN_FILL = 0.06  # for a known lamp of a scene; 0.04 in the still life
FROM_BELOW, FROM_TABLE = 0.45, 0.4  # fill facing down, relative to up; and the addition near the table
BELOW_ENDS = 0.9  # radii above the table where its reflection ends
# Cosine by which light wraps around: for a plane, and additionally where neighbors disagree; and the latter
# for a known lamp.
WRAP, ROUGH_WRAP, KNOWN_ROUGH_WRAP = 0.1, 0.5, 0.3
SOFT = 0.05  # cosine over which the light ends
DETAIL = 0.65  # share of a plane's own light, against that of the mass around it; 1 makes fur mottled

# The colors, OKLab.
KNOWN_SLOPE = 0.3  # of log L by log light; linear light has 1/3, displays compress it
TONED = 0.7  # exponent of L of its change in a capture: dark objects show form too
TOP, BOTTOM = 0.985, 0.06  # limits of L for lights and darks
LEAST_GROWN, MOST_GROWN = 0.8, 1.12  # limits of the growth of chroma with lightness in a capture
MOST_KNOWN_GROWN = 2.0  # the same where the lamp is known
WARM = np.array([0.005, 0.018])  # a and b between middle and full light
TURNS = 0.35  # logarithm of the light over which the temperature changes
FULL_WARMTH = 0.45  # L above which colors take all of it
COOL = 0.6  # share of it if lights are cool: shade in warm colors is soon muddy
WARM_ENOUGH = 12.0  # CIELAB b* of lights over darks above which no warmth is added: few paintings have more
CLEAR = 0.25  # minimum correlation of L and b that is clear; measured: koala -0.59, skull 0.31

# Estimate of the present light from colors.
FIRST_PAIR, PAIR_STEP = 2, 2  # among the neighbors of a stroke, for comparison
LIKE = 0.03  # distance of a and b at which neighbors are the same paint
LEAST_SPREAD = 0.01  # mean square difference of log light between neighbors that counts half
LEAST_EXPLAINED = -0.2  # minimum explained share of a light

FARTHEST = 1e6  # radii; positions further away are clamped to it
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class KeyLight:
    """Strokes prepared for a lamp: all data that do not depend on its position.

    Attributes:
        strokes: k strokes.
        place: where they stand.
        facing: their normals, local axes of the place.
        centers: [k, 3] their positions, local, in radii from the middle of the subject.
        blockers: block light.
        is_inside: whether the light comes in from outside: then walls and ceiling block none.
        lit_by: [3] unit vector toward the lamp that lit the scene, world axes; None if unknown.

    Example:
        >>> light = KeyLight.of(strokes, cameras, place)
        >>> light.lit(lamp, 0.5)
        Gaussians(6000, SH 0)
    """

    strokes: Gaussians
    place: Place
    facing: Facing
    centers: F64
    blockers: Blockers
    is_inside: bool = False
    lit_by: F64 | None = None

    @classmethod
    def of(
        cls,
        strokes: Gaussians,
        cameras: Sequence[Camera],
        place: Place,
        *,
        is_inside: bool = False,
        lit_by: F64 | None = None,
        facing: Facing | None = None,
    ) -> "KeyLight":
        """Prepare strokes.

        Args:
            strokes: k strokes.
            cameras: a few small cameras that see them; see `find_facing`.
            place: where they stand.
            is_inside: whether the scene is seen from inside.
            lit_by: see the attribute.
            facing: from `find_facing` with these strokes and cameras; None finds them.
        """
        facing = find_facing(strokes, cameras) if facing is None else facing
        facing = replace(facing, normals=facing.normals @ place.axes.T)
        middle = np.array([0.0, 0.5 * place.height, 0.0])
        centers = np.clip((place.local(strokes.means) - middle) / place.radius, -FARTHEST, FARTHEST)
        blockers = Blockers.of(strokes, centers, place.axes, place.radius, facing.normals)
        return cls(strokes, place, facing, centers, blockers, is_inside, lit_by)

    def colors(self, lamp: F64, strength: float = 1.0) -> F64:
        """[k, 3] display-encoded colors of the strokes without their view-dependent part, 0 to 1.

        Args:
            lamp: [3] unit vector toward the light, world axes. A small turn changes colors little.
            strength: 0 (unchanged) to 1.
        """
        lab = self._lab
        if len(lab) == 0 or strength == 0:
            return base_colors(self.strokes.sh)
        moved = self._seen_lit(lamp) if self.lit_by is None else self._relit(lamp)
        return in_gamut(lab, lab + strength * (moved - lab), rgb_of_oklab)

    def lit(self, lamp: F64, strength: float = 1.0) -> Gaussians:
        """The strokes in the colors of `colors`; the same object if the strength is 0."""
        if len(self.strokes) == 0 or strength == 0:
            return self.strokes
        return shift_base_colors(self.strokes, self.colors(lamp, strength) - base_colors(self.strokes.sh))

    def key(self, lamp: F64) -> F64:
        """[k] light of the lamp that arrives at the strokes, 0 to about 1."""
        toward = self.place.axes @ lamp
        shares, normals = self.facing.shares, self.facing.normals
        wrap = WRAP + ROUGH_WRAP * (1 - shares)
        if self.lit_by is not None:
            wrap = KNOWN_ROUGH_WRAP * (1 - shares)
        angle = normals @ toward + wrap
        angle = 0.5 * (angle + np.sqrt(angle**2 + SOFT**2)) / (1 + wrap)
        through = light_through(self.blockers, toward, self.centers, normals, is_inside=self.is_inside)
        return angle * self.facing.near.means(through)

    @cached_property
    def fill(self) -> F64:
        """[k] light that arrives from all around, 1 for surfaces facing up."""
        up = self.facing.normals[:, 1]
        above = self.centers[:, 1] + 0.5 * self.place.height / self.place.radius
        near = 1 - smoothstep(above / BELOW_ENDS)
        below = 0.5 - 0.5 * up
        return 1 - below * (1 - (FROM_BELOW + FROM_TABLE * near))

    @property
    def pairs(self) -> NDArray[np.int64]:
        """[k, n] rows of neighbors for comparison with each stroke."""
        return self.facing.wide.rows[:, FIRST_PAIR::PAIR_STEP]

    @cached_property
    def _lab(self) -> F64:
        return oklab_of(base_colors(self.strokes.sh))

    @cached_property
    def _paint(self) -> F64:
        paint = paint_shares(self.strokes)
        return np.asarray(paint / paint.sum())

    def _mean(self, values: F64) -> F64:
        """Mean of values, weighted by the paint of strokes."""
        return np.asarray(self._paint @ values)

    # A capture, whose light is unknown.

    def _seen_lit(self, lamp: F64) -> F64:
        """[k, 3] OKLab colors in a light whose mean is that of the scene."""
        lab, light = self._lab, np.log(FILL * self.fill + self.key(lamp))
        share = DETAIL * self.facing.shares**3  # fur and leaves are lit as a mass
        light = share * light + (1 - share) * self.facing.wide.means(light)
        light -= self._mean(light)
        light *= 1 - self.explained(light)
        before = np.maximum(lab[:, 0], 0)
        step = np.expm1(light / 3) * before**TONED
        lightness = _within(lab[:, 0], step - self._mean(step))
        lightness -= self._mean(lightness - lab[:, 0])
        lightness = np.clip(lightness, np.minimum(lab[:, 0], BOTTOM), np.maximum(lab[:, 0], TOP))
        warmth = np.tanh(light / TURNS) * np.minimum(before / FULL_WARMTH, 1)
        warmth -= self._mean(warmth)
        grown = np.clip((lightness + 0.1) / (before + 0.1), LEAST_GROWN, MOST_GROWN)
        ab = lab[:, 1:] * grown[:, None] + self.temperature * warmth[:, None] * WARM
        return np.concatenate([lightness[:, None], ab], axis=1)

    def explained(self, light: F64) -> float:
        """Share of a light, 0 to 1, that is already in the colors of the strokes."""
        weights, steps, tones = self._compared(light / 3)
        own = (weights * steps**2).sum() + weights.sum() * LEAST_SPREAD / 9
        return float(np.clip((weights * steps * tones).sum() / max(own, _TINY), LEAST_EXPLAINED, 1))

    @cached_property
    def temperature(self) -> float:
        """Warmth to add to lights: 1, less if they are warm already, below 0 if clearly cool."""
        lab, rows = self._lab, self.pairs
        if rows.shape[1] == 0:
            return 1.0
        steps, yellow = (lab[:, c, None] - lab[rows, c] for c in (0, 2))
        weights = self._paint[:, None] * np.ones(rows.shape[1])
        norm = np.sqrt((weights * steps**2).sum() * (weights * yellow**2).sum())
        found = (weights * steps * yellow).sum() / norm if norm > 1e-12 else 0.0
        return -COOL if found < -CLEAR else float(np.clip((WARM_ENOUGH - self.warmth) / WARM_ENOUGH, 0, 1))

    @cached_property
    def warmth(self) -> float:
        """Difference of CIELAB b* between the visible lights and darks of the strokes."""
        lab = lab_of(base_colors(self.strokes.sh))
        order = np.argsort(self.facing.wide.means(lab[:, 0]), kind="stable")
        areas, yellow = (self.facing.shown if self.facing.shown.any() else self._paint)[order], lab[order, 2]
        shares = np.cumsum(areas) / areas.sum()
        darks, lights = areas * (shares <= DARKS / 100), areas * (shares > LIGHTS / 100)
        return float(yellow @ lights / max(lights.sum(), _TINY) - yellow @ darks / max(darks.sum(), _TINY))

    def _compared(self, light: F64) -> tuple[F64, F64, F64]:
        """Weights of pairs of similar paint, and differences of light and of log lightness, [k, n] each."""
        lab, rows = self._lab, self.pairs
        tone = np.log(np.maximum(lab[:, 0], 0) + 0.05)
        apart = ((lab[:, None, 1:] - lab[rows, 1:]) ** 2).sum(axis=2)
        weights = np.exp(-0.5 * apart / LIKE**2) * self._paint[:, None]
        return weights, light[:, None] - light[rows], tone[:, None] - tone[rows]

    # A scene whose light is known.

    def _relit(self, lamp: F64) -> F64:
        """[k, 3] OKLab colors in the light of a lamp instead of the one that lit the scene."""
        lab = self._lab
        step = np.log(KNOWN_FILL * self.fill + self.key(lamp)) - np.log(
            KNOWN_FILL * self.fill + self._known_key
        )
        ratio = np.exp(KNOWN_SLOPE * step)[:, None]
        lightness = _within(lab[:, :1], lab[:, :1] * (ratio - 1))
        grown = lightness / np.maximum(lab[:, :1], 1e-6)
        return np.concatenate([lightness, lab[:, 1:] * np.clip(grown, 0, MOST_KNOWN_GROWN)], axis=1)

    @cached_property
    def _known_key(self) -> F64:
        assert self.lit_by is not None
        return self.key(self.lit_by)


def _within(lightness: F64, steps: F64) -> F64:
    """Lightness moved by steps, which shrink toward white and black and never reach past them."""
    room = np.where(steps > 0, np.maximum(TOP - lightness, 0), np.maximum(lightness - BOTTOM, 0))
    size = np.abs(steps)
    return np.asarray(lightness + np.sign(steps) * room * -np.expm1(-size / np.maximum(room, 1e-9)))
