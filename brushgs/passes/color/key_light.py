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
from brushgs.passes.color.key_shadow import Blockers, light_through
from brushgs.passes.color.squint import DARKS, LIGHTS, lab_of
from brushgs.values.arrays import F64, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors

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
    ) -> "KeyLight":
        """Prepare strokes.

        Args:
            strokes: k strokes.
            cameras: a few small cameras that see them; see `find_facing`.
            place: where they stand.
            is_inside: whether the scene is seen from inside.
            lit_by: see the attribute.
        """
        facing = find_facing(strokes, cameras)
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
