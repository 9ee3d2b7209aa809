"""Watercolour: convert the picture of strokes to washes of pigment on wet paper.

Strokes only place pigment. Densities (-ln of the transmitted light) add up: each of three washes of growing
detail provides a share of the target density. A wash is smoothed with edges preserved, less so where the
paper is wet; its pigment gathers at rims, flows with noise anchored in space, and settles in the valleys of
the paper. Lights are the bare paper.
Source: Bousseau et al. 2006 (density of pigment); Gastal and Oliveira 2011 (edge-preserving smoothing).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.effect import OfWhole, heights_of
from brushgs.rendering.space_noise import Anchor, space_noise
from brushgs.values.arrays import F64, Array, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.surface import Surface

ROUNDS = 3  # of smoothing
LEAST_COLOR = 0.02  # pigments are never blacker; as in the core
GRAIN_DEVIATION = 0.24  # of the grain of paper, as in the core
VEIL = 0.1  # share of the paper that stays where an outline is lost, or the far side shows; as in the core
ROOM = 0.06  # how far pigment runs beyond the strokes, over the diagonal
SPILL = 4.0  # inverse of the coverage by strokes from which washes have full strength
RIM = 0.005  # width over which pigment gathers at the rim of a wash, over the diagonal
LOSS = 0.024  # width over which a lost outline fades, over the diagonal
PAPER = 0.4, 0.5  # coverage by strokes from which paper hides what lies below, and the range of that
# A lost outline fades over about a third of what is as thick there, in one of some widths: a part is as thick
# as a width where coverage blurred by it comes near to 1 (`CORE`, its range) at some of the places about it
# (`NEAR_CORE`: share of the paint, and range).
WIDTHS = 1.0, 0.5, 0.25  # of `LOSS`
CORE, NEAR_CORE = (0.86, 0.08), (0.03, 0.1)
OPENED = 1.4  # how much of such a width is lost as a whole
LIT = 0.9  # of parts thinner than all widths the side of the lamp is lost alone: base of its share
STEEP = 2.83  # slope of blurred coverage over two pixels by what is missing to 0 or 1, times the width
# Where a subject stands it keeps its outline: by how much the side of the lamp counts less on the ground, and
# the height up to which, over that of the subject.
CONTACT = 1.0, 0.2
FROM_ABOVE = -0.57, -0.57  # direction to the lamp in pictures, where none is known
ROOM_SOLID = 12.0  # see `Key`: a room has no holes, windows are strokes of little opacity
# Holes in the paint of a room: reach of the colors that fill them, over the diagonal, and the share of paint
# within it up to which a hole is open and stays bare, and from which it is closed.
HOLE, OPEN, CLOSED = 0.02, 0.2, 0.5
# The wash of a shadow: coverage by its strokes at its edge, variation of that by the noise, range of coverage
# over which it fades; and its least density.
SHADOW_EDGE, SHADOW_WANDER, SHADOW_SOFTNESS, SHADOW_LEAST = 0.20, 0.04, 0.12, 0.5


@dataclass(frozen=True)
class Key:
    """Tone curve of a watercolour: maps a range of luma to the range from the darkest tone to paper.

    Attributes:
        low: luma that becomes `darkest`.
        high: luma that becomes white.
        darkest: luma of the darkest tone.
        gamma: exponent of the tones between.
        chroma: factor on the differences of densities between the channels.
        solid: inverse of the coverage by strokes from which colors have full strength.
    """

    low: float
    high: float
    darkest: float = 0.13
    gamma: float = 0.85
    chroma: float = 1.3
    solid: float = 2.0

    def colors(self, rgb: Array, alpha: Array) -> Array:
        """[H, W, 3] colors of a premultiplied picture on white, mapped by the curve."""
        rgb, keyed = np.ascontiguousarray(rgb), np.empty_like(rgb)
        numbers = {one.name: getattr(self, one.name) for one in fields(self)}
        threads = num_threads_or_default(None)
        _core.key_colors(
            rgb=rgb, alpha=np.ascontiguousarray(alpha), **numbers, num_threads=threads, keyed=keyed
        )
        return keyed

    def base_colors(self, strokes: Gaussians) -> F64:
        """[N, 3] base colors of strokes, mapped by the curve."""
        colors = base_colors(strokes.sh)[None]
        return np.asarray(self.colors(colors, np.ones(colors.shape[:2]))[0])


@dataclass(frozen=True)
class Wash:
    """Edge-preserving smoothing of the picture for a wash.

    Attributes:
        width: standard deviation of the smoothing on flat paint, in diagonals of the picture.
        edge: step of color, summed over the channels, that counts as an edge.
        wet: how much weaker edges are on wet paper.
        loose: how much weaker edges are away from the focus.
    """

    width: float
    edge: float
    wet: float
    loose: float


WASHES = (Wash(0.030, 0.50, 1.2, 1.0), Wash(0.012, 0.22, 0.9, 1.6), Wash(0.004, 0.13, 0.45, 1.5))


@dataclass(frozen=True)
class Washes:
    """Numbers of the washes, as `WashNumbers` of the core; formulas: tests/rendering/wet_reference.py."""

    shares: tuple[float, ...] = (0.62, 0.90, 1.10)
    steps: tuple[float, ...] = (0.34, 0.30)
    hardness: tuple[float, ...] = (4.0, 3.0)
    masses: tuple[float, ...] = (0.75, 0.45)
    wander: float = 0.22
    at_focus: float = 0.6
    rims: tuple[float, ...] = (2.0, 2.6, 1.8)
    flows: tuple[float, ...] = (0.17, 0.14)
    dips: tuple[float, ...] = (0.20, 0.55, 0.22)
    crests: tuple[float, ...] = (0.30, 0.25, 0.07)
    grain: float = 0.15
    light: tuple[float, ...] = (0.12, 0.07)
    light_noise: tuple[float, ...] = (0.012, 0.02)
    lost: tuple[float, ...] = (0.0, 0.12, 0.15, 0.25, 0.5, 0.45)
    most: float = 2.9

    def numbers(self) -> F64:
        """All numbers in order."""
        return np.concatenate([np.atleast_1d(getattr(self, one.name)) for one in fields(self)]).astype(
            np.float64
        )


class _Running(OfWhole):
    """Base class of effects whose washes run through the picture of a coat."""

    @property
    def traits(self) -> str:
        """See `Effect`."""
        return "washes that run and gather"

    def areas(self, picture: Array) -> None:
        """See `Effect`: none, washes run."""


@dataclass(frozen=True)
class WetLayer(_Running):
    """An `Effect` of three washes; all its parameters are constant over a job.

    Attributes:
        key: tone curve.
        anchor: of the noise and the focus.
        is_room: whether the scene fills the picture, which then has no lost outlines.
        washes: parameters of mixing.
        smoothing: of the three washes.
        towards: unit vector toward the lamp, world axes; None if not known.
        ground: the ground that the subject stands on: its height above that at (x, y, z, 1), world axes, over
            its own, is the product with these four; None if not known.
        losing: how far a lost outline is lost, 0 to 1.
        has_border: whether what reaches the edge of the sheet ends in a ragged border before it.
    """

    key: Key
    anchor: Anchor
    is_room: bool = False
    washes: Washes = field(default=Washes())
    smoothing: tuple[Wash, Wash, Wash] = WASHES
    towards: tuple[float, ...] | None = None
    ground: tuple[float, ...] | None = None
    losing: float = 1.0
    has_border: bool = True

    def __call__(self, painted: Frame, camera: Camera, surface: "Surface | None", part: Any = None) -> Frame:
        """The wet layer as covering paint: its paper hides the layers below the strokes."""
        return _on_part(self._laid, painted, camera, surface)

    def wet(self, painted: Frame, camera: Camera) -> "Wet":
        """All that a picture of strokes, with depth, is mixed from, on white, its outlines wholly lost."""
        assert painted.depth is not None, "effects have a depth"
        height, width = painted.alpha.shape
        all_of = slice(0, height), slice(0, width)
        return self._wet(_Part(painted.rgb, painted.alpha, painted.depth, *all_of, camera, surface=None))

    def scores(self, wet: "Wet") -> Array:
        """[H, W] what lets an outline be lost from a number on: light, noise, no focus, a lamp beside it."""
        _, _, by_noise, by_focus, by_side, by_tone = self.washes.lost
        scores = by_noise * wet.noise[..., 1] - by_focus * wet.noise[..., 2] - by_tone * wet.parted[2]
        return np.asarray(scores if (soft := wet.alphas[1]) is None else scores + by_side * soft[..., 1])

    def lost(self, wet: "Wet") -> Array:
        """[H, W] how far outlines are lost, 0 to 1."""
        soft, (first, over, *_) = wet.losing(self.losing).alphas[1], self.washes.lost
        scores = self.scores(wet)
        if soft is None:
            return np.zeros_like(scores)
        return np.asarray(smoothstep((scores - first) / over) * (1 - smoothstep(2 * soft[..., 0] - 1)))

    def stand_in(self, coat: "Coat") -> "Coat":
        """See `Effect`: the strokes in colors mapped by the tone curve."""
        keyed = in_colors(coat.strokes, self.key.base_colors(coat.strokes))
        return replace(coat, strokes=keyed, effect=None)

    def _laid(self, part: "_Part") -> tuple[Array, Array]:
        """Colors and alpha of a part of a picture."""
        return self._wet(part).losing(self.losing).mixed(self.washes)

    def _wet(self, part: "_Part") -> "Wet":
        alpha, dtype = part.alpha, part.rgb.dtype
        noise, parted = self._parts(part)
        blurred = smooth(parted[1].copy(), RIM * part.diagonal)
        soft = None if self.is_room else self._outlines(part)
        border = part.border(has_one=self.has_border)
        if not self.is_room:  # washes do not run beyond painted pixels
            border = border * smoothstep(SPILL * alpha).astype(dtype)
        return Wet(parted, blurred, noise, (alpha, soft), (part.grain, border, part.paper))

    def _outlines(self, part: "_Part") -> Array:
        """See `_outlines`; on the ground as if their side were farther from that of the lamp."""
        found = _outlines(part.alpha, LOSS * part.diagonal, self._lamp_in(part.camera))
        if self.ground is not None:
            corner = int(part.columns.start), int(part.rows.start)
            heights = heights_of(part.depth, part.camera, self.ground, corner)
            found[..., 1] -= CONTACT[0] * (1 - smoothstep(heights / CONTACT[1]))
        return found

    def _lamp_in(self, camera: Camera) -> tuple[float, float]:
        """The direction (x, y) to the lamp in a picture, shorter where it lies along the view."""
        if self.towards is None:
            return FROM_ABOVE
        right, down, _ = (camera.viewmat[:3, :3] @ np.array(self.towards)).tolist()
        return right, down

    def _parts(self, part: "_Part") -> tuple[Array, tuple[Array, Array, Array]]:
        """Noise with the focus [h, w, 3], and the washes, see `_parted`."""
        noise = part.noise(self.anchor)
        focus = np.where(part.alpha > 0, in_focus(noise[..., 2]), 0).astype(part.rgb.dtype)
        noise[..., 2] = focus
        rgb, alpha = part.rgb, part.alpha
        if self.is_room:
            rgb, alpha = without_holes(rgb, alpha, self.key.solid, part.diagonal)
        colors = self.key.colors(rgb, alpha)
        wetness = np.clip(0.5 * noise[..., 1] + 0.45, 0, 1) * (1 - 0.85 * focus)
        smoothed = [self._smoothed(colors, one, part.diagonal, wetness, focus) for one in self.smoothing]
        return noise, _parted(smoothed, noise, self.washes)

    def _smoothed(self, colors: Array, wash: Wash, diagonal: float, wetness: Array, focus: Array) -> Array:
        """The colors smoothed for one wash."""
        sigma = wash.width * diagonal
        loose = (1 + wash.loose * (1 - focus)) * (wash.edge / sigma)
        hold = (1 - 0.92 * np.minimum(wash.wet * wetness, 1)) / loose
        return smooth(colors.copy(), sigma, guide=colors, hold=hold.astype(colors.dtype))


def without_holes(rgb: Array, alpha: Array, solid: float, diagonal: float) -> tuple[Array, Array]:
    """Premultiplied colors and coverage of a room, its holes in the colors of the paint around them.

    The night behind a window is often no paint at all, which would be chips of bare paper between dark panes.
    What no paint surrounds stays bare.
    """
    laid = np.minimum(solid * alpha, 1)
    colors = rgb / np.maximum(alpha, np.finfo(rgb.dtype).tiny)[..., None] * laid[..., None]
    around, near = (smooth(plane, HOLE * diagonal) for plane in (colors, laid[..., None].copy()))
    missing = np.maximum(1 / solid - alpha, 0) * smoothstep((near[..., 0] - OPEN) / (CLOSED - OPEN))
    lift = missing.astype(rgb.dtype)
    filled = rgb + lift[..., None] * around / np.maximum(near, np.finfo(rgb.dtype).tiny)
    return filled, alpha + lift


def _outlines(alpha: Array, loss: float, lamp: tuple[float, float]) -> Array:
    """[h, w, 2] 0.5 at outlines to 1 where none is near; how far their side is that of a lamp, -1 to 1."""
    solid = smoothstep((alpha - PAPER[0]) / PAPER[1]).astype(alpha.dtype)
    fades, sides, weights = np.zeros_like(solid), np.zeros_like(solid), np.full_like(solid, 1e-6)
    for share in WIDTHS:
        width = share * loss
        soft = smooth(solid[..., None].copy(), width)[..., 0]
        beside = np.pad(soft, 1, mode="edge")
        slope = lamp[0] * (beside[1:-1, 2:] - beside[1:-1, :-2])
        slope += lamp[1] * (beside[2:, 1:-1] - beside[:-2, 1:-1])
        side = -np.clip(width * slope / (STEEP * np.minimum(soft, 1 - soft) + 1e-6), -1, 1)
        if share == WIDTHS[-1]:
            may_be = smoothstep(LIT + side)
        else:
            core = smoothstep((soft - CORE[0]) / CORE[1]).astype(alpha.dtype)
            near = smooth(core[..., None], width)[..., 0] / np.maximum(soft, 1e-6)
            may_be = smoothstep((near - NEAR_CORE[0]) / NEAR_CORE[1])
        fade = may_be * np.minimum(OPENED * (1 - soft), 0.5)
        sides += fade * fade * side
        weights += fade * fade
        fades = np.maximum(fades, fade)
    return np.stack([1 - fades, sides / weights], axis=-1).astype(alpha.dtype)


class Wet(NamedTuple):
    """What a layer is mixed from, see `mix_washes` in tests/rendering/wet_reference.py."""

    parted: tuple[Array, Array, Array]
    blurred: Array
    noise: Array
    alphas: tuple[Array, Array | None]
    sheet: tuple[Array | None, Array | None, Array | None]

    def losing(self, share: float) -> "Wet":
        """The same with a share of what it loses of lost outlines."""
        alpha, soft = self.alphas
        if soft is None or share == 1:
            return self
        fades = 1 - share * (1 - soft[..., 0])
        return self._replace(alphas=(alpha, np.stack([fades, soft[..., 1]], axis=-1)))

    def mixed(self, washes: Washes) -> tuple[Array, Array]:
        """Colors [H, W, 3] and alpha [H, W] of covering paint."""
        return _mixed(self.parted, self.blurred, self.noise, self.alphas, self.sheet, washes)


@dataclass(frozen=True)
class ShadowWash(_Running):
    """An `Effect` of one wash in the color of its strokes, over the area that they cover; for glazes.

    Attributes:
        anchor: of the noise.
        washes: parameters, of which those of the first wash are used.
        has_border: see `WetLayer`.
    """

    anchor: Anchor
    washes: Washes = field(default=Washes())
    has_border: bool = True

    def __call__(self, painted: Frame, camera: Camera, surface: "Surface | None", part: Any = None) -> Frame:
        """The tint of the wash."""
        darker = _on_part(self._laid, painted, camera, surface)
        return replace(darker, rgb=darker.rgb + (1 - darker.alpha)[..., None])

    def stand_in(self, coat: "Coat") -> "Coat":
        """See `Effect`: the strokes themselves."""
        return replace(coat, effect=None)

    def _laid(self, part: "_Part") -> tuple[Array, Array]:
        """Colors and alpha of a part of a picture: a covering layer, which over white gives the tint."""
        rgb, alpha, (height, width) = part.rgb, part.alpha, part.alpha.shape
        noise = part.noise(self.anchor)
        noise[..., 2] = 0
        inside = smoothstep((alpha - SHADOW_EDGE + SHADOW_WANDER * noise[..., 0]) / SHADOW_SOFTNESS)
        thick = inside * (SHADOW_LEAST + (1 - SHADOW_LEAST) * alpha)
        colors = np.divide(rgb, alpha[..., None], out=np.ones_like(rgb), where=alpha[..., None] > 0)
        densities = np.zeros((height, width, 9), rgb.dtype)
        densities[..., :3] = -np.log(np.clip(colors, 0.02, 1)) * thick[..., None]
        means = np.zeros_like(rgb)
        means[..., 0] = densities[..., :3].mean(axis=-1)
        blurred = smooth(means.copy(), RIM * part.diagonal)
        parted = densities, means, np.ones_like(alpha)
        nothing, border = (np.zeros_like(alpha), None), part.border(has_one=self.has_border)
        return _mixed(parted, blurred, noise, nothing, (part.grain, border, None), self.washes)


@dataclass(frozen=True, eq=False)
class _Part:
    """The part of a picture that strokes cover, with a margin.

    Attributes:
        rgb: [h, w, 3] premultiplied.
        alpha: [h, w].
        depth: [h, w].
        rows: of the part in the picture.
        columns: of the part in the picture.
        camera: the view of the picture.
        surface: the paper; None for none.
    """

    rgb: Array
    alpha: Array
    depth: Array
    rows: slice
    columns: slice
    camera: Camera
    surface: "Surface | None"

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture."""
        return self.camera.height, self.camera.width

    @property
    def diagonal(self) -> float:
        """Diagonal of the picture, pixels."""
        return float(np.hypot(*self.shape))

    @property
    def grain(self) -> Array | None:
        """[h, w] grain of the paper; None without paper."""
        return None if self.surface is None else self.cut(self.surface.grain)

    @property
    def paper(self) -> Array | None:
        """[h, w, 3] color of the paper; None without paper."""
        return None if self.surface is None else self.cut(self.surface.rgb)

    def cut(self, plane: Array) -> Array:
        """Cut the part out of a plane of the picture."""
        return np.ascontiguousarray(plane[self.rows, self.columns], self.rgb.dtype)

    def border(self, *, has_one: bool) -> Array:
        """[h, w] strength of washes, see `ragged_border`; 1 without one."""
        if not has_one:
            return np.ones_like(self.alpha)
        return self.cut(ragged_border(*self.shape, self.rgb.dtype.name))

    def noise(self, anchor: Anchor) -> Array:
        """[h, w, 3] see `space_noise`."""
        corner = int(self.columns.start), int(self.rows.start)
        return space_noise(self.depth, self.camera, anchor, corner=corner)


def _on_part(
    lay: Callable[[_Part], tuple[Array, Array]], painted: Frame, camera: Camera, surface: "Surface | None"
) -> Frame:
    """Apply `lay` to the painted part of a frame only, to save time."""
    assert painted.depth is not None, "effects have a depth"
    rgb, alpha = np.zeros_like(painted.rgb), np.zeros_like(painted.alpha)
    found = painted.alpha > 0
    rows, columns = (np.flatnonzero(found.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        return replace(painted, rgb=rgb, alpha=alpha)
    room = int(np.ceil(ROOM * float(np.hypot(*alpha.shape))))
    part_rows, part_columns = (
        slice(max(int(at[0]) - room, 0), min(int(at[-1]) + 1 + room, size))
        for at, size in zip((rows, columns), alpha.shape, strict=True)
    )
    place = part_rows, part_columns
    own, own_alpha, depth = (
        np.ascontiguousarray(plane[place]) for plane in (painted.rgb, painted.alpha, painted.depth)
    )
    rgb[place], alpha[place] = lay(_Part(own, own_alpha, depth, *place, camera, surface))
    return replace(painted, rgb=rgb, alpha=alpha)


def in_focus(distances: Array) -> Array:
    """Focus, 0.15 to 1, by the distance from its center, in units of its reach."""
    return np.asarray(np.clip(0.15 + 0.95 * np.exp(-(distances**2)), 0, 1))


def smooth(
    planes: Array,
    sigma: float,
    *,
    guide: Array | None = None,
    hold: Array | None = None,
    rounds: int = ROUNDS,
) -> Array:
    """Smooth planes [H, W, 1 or 3] in place, preserving the edges of a guide; returns them.

    Args:
        planes: contiguous.
        sigma: standard deviation, pixels.
        guide: [H, W, 3] picture whose edges are preserved; None for plain smoothing.
        hold: [H, W] with a guide: distance in pixels that a step of 1 adds, summed over the channels.
        rounds: passes over the rows and columns.
    """
    threads = num_threads_or_default(None)
    _core.smooth_planes(
        planes=planes, guide=guide, hold=hold, sigma=sigma, rounds=rounds, num_threads=threads
    )
    return planes


def _parted(smoothed: list[Array], noise: Array, washes: Washes) -> tuple[Array, Array, Array]:
    """Densities [H, W, 9] of the washes, their means [H, W, 3], and the tone [H, W] of the second."""
    coarse, middle, fine = smoothed
    height, width, _ = coarse.shape
    densities, means = np.empty((height, width, 9), coarse.dtype), np.empty_like(coarse)
    tones = np.empty((height, width), coarse.dtype)
    _core.part_washes(
        coarse=coarse,
        middle=middle,
        fine=fine,
        noise=noise,
        numbers=washes.numbers(),
        num_threads=num_threads_or_default(None),
        densities=densities,
        means=means,
        tones=tones,
    )
    return densities, means, tones


def _mixed(
    parted: tuple[Array, Array, Array],
    blurred: Array,
    noise: Array,
    alphas: tuple[Array, Array | None],
    sheet: tuple[Array | None, Array | None, Array | None],
    washes: Washes,
) -> tuple[Array, Array]:
    """Colors [H, W, 3] and alpha [H, W] of covering paint; arguments as in its definition."""
    densities, means, tones = parted
    alpha, soft = alphas
    grain, border, paper = sheet
    rgb, covered = np.empty_like(means), np.empty_like(alpha)
    _core.mix_washes(
        densities=densities,
        means=means,
        blurred=blurred,
        tones=tones,
        noise=noise,
        alpha=alpha,
        soft=soft,
        grain=grain,
        border=border,
        paper=paper,
        numbers=washes.numbers(),
        num_threads=num_threads_or_default(None),
        rgb=rgb,
        covered=covered,
    )
    return rgb, covered


@lru_cache(maxsize=2)
def ragged_border(height: int, width: int, dtype: str) -> Array:
    """[H, W] strength of the washes of a picture, 0 outside its ragged border; read-only."""
    diagonal = float(np.hypot(height, width))
    flat: Any = np.array([[diagonal, 0, width / 2], [0, diagonal, height / 2], [0, 0, 1]])
    camera = Camera(np.eye(4), flat, width=width, height=height)
    sheet = Anchor((0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0), 1.0)
    noise = space_noise(np.ones((height, width), dtype), camera, sheet)[..., 0]
    rows, columns = (np.minimum(at := np.arange(size) + 0.5, size - at) for size in (height, width))
    inside = np.minimum(rows[:, None], columns) / diagonal
    border = smoothstep((inside - 0.025 - 0.007 * noise) / 0.004).astype(dtype)
    border.flags.writeable = False
    return border
