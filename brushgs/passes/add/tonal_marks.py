"""Hatching or dots on the surfaces that the views of a job show, as strokes fixed in space.

Marks are placed in the picture of each view, evenly spaced by tone, first coarsely and then in between, and
lifted to the surface. Later views keep the marks that they see as dense as they need, and fill in where they
see more than earlier ones: so the marks of all views are nested, see `brushgs.rendering.nested`.
Source: Jobard and Lefer 1997; for dots, dart throwing with a falling radius (McCool and Fiume 1992).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.line_fit import fit, strokes_of
from brushgs.passes.add.line_lift import DEPTH_REACH, Chains
from brushgs.passes.add.tonal_view import FLATTEST, TonalView
from brushgs.rendering.nested import Nested
from brushgs.values.along import Along
from brushgs.values.arrays import F32, F64, Mask, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

LEVELS = np.array([4.0, 2.0, 1.0])  # spacings of the nested levels, relative to the spacing for the tone
STEP = 1.5  # px between the points of a line
END = 0.55  # share of the spacing at which a line ends beside another
OVERLAP = 0.1  # widths by which each end of a piece overlaps the next: more would show as beads
SEEN = 0.5  # share of a mark that a view must show for the mark to count
CLOSE = 0.7  # minimum scale of an earlier view, relative to this one, at which its marks are enough
STRIDE = 2  # px between the pixels that are compared with earlier views
LINE_SEEDS, DOT_SEEDS = 0.06, 1.0  # tries in each px of a picture of `PIXELS`; most lines start beside others
TILTED = (0.8, 1.25)  # limits of the depth of the plane half a gap beside a mark, relative to the mark


@dataclass(frozen=True)
class Manner:
    """How tone becomes marks. Lengths are px in a picture of `PIXELS`.

    Attributes:
        darkest: tone at and below which marks are closest.
        lightest: tone above which there are none.
        spacing: of marks in the darkest and in the lightest tone.
        width: the same of marks.
        length: shortest and longest line; (0, 0) for dots.
        turn: radians from the direction of the surface to the lines.
        power: of the tone between darkest and lightest in the spacing: above 1 marks stay close for longer.
    """

    darkest: float
    lightest: float
    spacing: tuple[float, float]
    width: tuple[float, float]
    length: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    power: float = 1.0

    @property
    def is_round(self) -> bool:
        """Whether marks are dots."""
        return self.length[1] == 0

    def spacings(self, tones: F64 | F32) -> F64:
        """Spacing in each tone, px."""
        return self._between(self.spacing, tones)

    def widths(self, tones: F64 | F32) -> F64:
        """Width in each tone, px."""
        return self._between(self.width, tones)

    def _between(self, ends: tuple[float, float], tones: F64 | F32) -> F64:
        share = np.clip((tones - self.darkest) / (self.lightest - self.darkest), 0, 1) ** self.power
        return np.asarray(ends[0] + (ends[1] - ends[0]) * share)


@dataclass(frozen=True, eq=False)
class Marks:
    """Marks on surfaces, as N strokes.

    Attributes:
        strokes: black; the longest axis of a piece runs along its line.
        chains: [N] the line that each is a piece of, ascending, its pieces in order; dots have their own.
        nested: see `Nested`.
        tones: [N] of the surface there.
    """

    strokes: Gaussians
    chains: Rows
    nested: Nested
    tones: F64

    def __len__(self) -> int:
        return len(self.strokes)


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of marks in space, P, mark after mark.

    Attributes:
        points: [P, 3] world units.
        gaps: [P, 3] see `Nested`.
        tones: [P] of the surface.
        pixels: [P] world units of a pixel of a picture of `PIXELS`.
        chains: [P] mark of each, ascending from 0.
    """

    points: F64
    gaps: F64
    tones: F64
    pixels: F64
    chains: Rows

    @classmethod
    def joined(cls, parts: "Sequence[_Points]") -> "_Points":
        counts = [int(part.chains[-1]) + 1 if len(part.chains) else 0 for part in parts]
        firsts = np.cumsum([0, *counts[:-1]])
        columns = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)}
        columns["chains"] = columns["chains"] + np.repeat(firsts, [len(part.chains) for part in parts])
        return cls(**columns)


def tonal_marks(
    views: Sequence[TonalView],
    manner: Manner,
    like: Gaussians,
    *,
    num_sigmas: float,
    is_left_out: Sequence[Mask] | None = None,
    seed: int = 0,
) -> Marks:
    """Draw marks on the surfaces that some views show.

    Args:
        views: at least one; the first is the picture.
        manner: how tone becomes marks.
        like: for the dtype.
        num_sigmas: half length of a box in standard deviations that the strokes will be drawn with.
        is_left_out: [H, W] of each view, mask of pixels without marks; None for `seen_as_well`.
        seed: of the starting points of marks.
    """
    parts: list[_Points] = []
    masks = seen_as_well(views) if is_left_out is None else is_left_out
    for number, (view, mask) in enumerate(zip(views, masks, strict=True)):
        spacing = _spacing(view, manner, mask)
        parts.append(_marks_in(view, spacing, manner, parts, np.random.default_rng([seed, number])))
    make = _dots if manner.is_round else _lines
    return make(_Points.joined(parts), manner, like, num_sigmas)


def seen_as_well(views: Sequence[TonalView]) -> list[Mask]:
    """[H, W] of each view: pixels whose surface an earlier one shows about as large.

    The marks of that one are enough there.
    """
    return [_is_seen_as_well(view, views[:number]) for number, view in enumerate(views)]


def _spacing(view: TonalView, manner: Manner, is_left_out: Mask) -> F32:
    """[H, W] px of the view; 0 where there are no marks."""
    tones = view.tones
    is_drawn = (tones.fine < manner.lightest) & np.isfinite(view.depth) & ~tones.is_jump & ~is_left_out
    return np.where(is_drawn, tones.scale * manner.spacings(tones.fine), 0).astype(np.float32)


def _is_seen_as_well(view: TonalView, earlier: Sequence[TonalView]) -> Mask:
    shape = view.depth.shape
    depth = view.depth[::STRIDE, ::STRIDE]
    places = np.nonzero(np.isfinite(depth))
    if not earlier or not len(places[0]):
        return np.zeros(shape, bool)
    pixels = np.asarray(STRIDE * np.stack(places[::-1], axis=1) + 0.5, np.float64)
    points = view.lifted(pixels, depth[places].astype(np.float64))
    normals = view.normals[::STRIDE, ::STRIDE][places] @ view.camera.viewmat[:3, :3]
    least = CLOSE * view.sizes(points, normals)
    is_seen = np.zeros(len(points), bool)
    for other in earlier:
        rest = np.flatnonzero(~is_seen)
        shown = rest[other.at(points[rest])[1]]
        is_seen[shown] = other.sizes(points[shown], normals[shown]) > least[shown]
    coarse = np.zeros(depth.shape, bool)
    coarse[places] = is_seen
    return np.asarray(coarse.repeat(STRIDE, axis=0).repeat(STRIDE, axis=1)[: shape[0], : shape[1]])


def _marks_in(
    view: TonalView, spacing: F32, manner: Manner, earlier: list[_Points], g: np.random.Generator
) -> _Points:
    """The marks that a view adds."""
    scale, width = view.tones.scale, spacing.shape[1]
    rows = np.flatnonzero(spacing.ravel() > 0)
    count = int(np.ceil((DOT_SEEDS if manner.is_round else LINE_SEEDS) * len(rows) / scale**2))
    rows = g.permutation(rows)[:count] if count <= len(rows) else g.choice(rows, count)
    seeds = np.stack([rows % width, rows // width], axis=1) + g.random((len(rows), 2))
    shortest, longest = manner.length
    points, begins, levels = _core.trace_lines(
        _turned(view.directions, manner.turn),
        np.ascontiguousarray(spacing),
        _taken(view, manner, earlier),
        seeds,
        LEVELS,
        step=0.0 if manner.is_round else STEP * scale,
        shortest=shortest * scale,
        longest=longest * scale,
        end=END,
    )
    chains = np.repeat(np.arange(len(levels)), np.diff(begins))
    return _lifted(view, manner, points.reshape(-1, 2), chains, LEVELS[levels][chains])


def _turned(directions: F32, turn: float) -> F32:
    if turn == 0:
        return directions
    cos, sin = np.cos(2 * turn), np.sin(2 * turn)
    c, s = directions[..., 0], directions[..., 1]
    return np.stack([c * cos - s * sin, s * cos + c * sin], axis=2).astype(np.float32)


def _taken(view: TonalView, manner: Manner, earlier: list[_Points]) -> F64:
    """[P, 2] pixels of the points of earlier marks that the view shows whole enough."""
    found = [np.zeros((0, 2))]
    for part in earlier:
        pixels, is_seen = view.at(part.points)
        rows = np.flatnonzero(is_seen)
        angles = np.zeros(len(rows))
        if not manner.is_round:
            along = _along(pixels, Along.of(part.chains))[rows]
            angles = np.arctan2(along[:, 1], along[:, 0])
        nested = Nested(part.gaps, manner.spacings(part.tones), np.zeros(0), manner.is_round)
        found.append(pixels[rows[nested.shares(part.points[rows], rows, angles, view.camera) > SEEN]])
    return np.concatenate(found)


def _along(points: F64, chains: Along) -> F64:
    """[P, 2] from the point before each to the one after it."""
    return np.asarray(points[chains.near(1)] - points[chains.near(-1)])


def _lifted(view: TonalView, manner: Manner, pixels: F64, chains: Rows, factors: F64) -> _Points:
    """Points of the picture [P, 2], of marks of levels with factors [P], on its surfaces."""
    camera, along = view.camera, Along.of(chains)
    columns, rows = np.clip(pixels.T.astype(np.intp), 0, [[camera.width - 1], [camera.height - 1]])
    depths = view.depth[rows, columns].astype(np.float64)
    if len(depths) and not manner.is_round:
        depths = 1 / along.even_mean(along.even_mean(1 / depths, DEPTH_REACH), DEPTH_REACH)
    tones = view.tones.fine[rows, columns].astype(np.float64)
    normals = view.normals[rows, columns].astype(np.float64)
    reach = view.tones.scale * factors * manner.spacings(tones)
    if manner.is_round:
        rays = view.rays(pixels)
        cosines = np.abs((rays * normals).sum(axis=1)) / np.linalg.norm(rays, axis=1)
        lengths = reach * depths / view.focal / np.sqrt(np.maximum(cosines, FLATTEST))
        gaps = normals * lengths[:, None]
    else:
        way = _along(pixels, along)
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        across = 0.5 * reach[:, None] * np.stack([-way[:, 1], way[:, 0]], axis=1)
        one, other = (_on_plane(view, pixels, pixels + side * across, depths, normals) for side in (1, -1))
        gaps = one - other
    scale = depths * view.tones.scale / view.focal
    return _Points(view.lifted(pixels, depths), gaps @ camera.viewmat[:3, :3], tones, scale, chains)


def _on_plane(view: TonalView, centers: F64, pixels: F64, depths: F64, normals: F64) -> F64:
    """[P, 3] camera axes: where rays through pixels meet the planes at `centers`."""
    rays, toward = view.rays(pixels), (view.rays(centers) * normals).sum(axis=1)
    slopes = (rays * normals).sum(axis=1)
    shares = np.clip(toward / np.where(np.abs(slopes) > 1e-6, slopes, 1e-6), *TILTED)
    return np.asarray(rays * (depths * shares)[:, None])


def _lines(found: _Points, manner: Manner, like: Gaussians, num_sigmas: float) -> Marks:
    """Lines as rows of nearly straight pieces."""
    none, pixels = np.zeros(len(found.points)), found.pixels
    chains = Chains(
        points=found.points,
        normals=found.gaps,
        strengths=found.tones,
        steps=none,
        importances=none,
        pixels=pixels,
        sizes=pixels,
        chains=found.chains,
        views=none.astype(np.intp),
    )
    pieces = fit(chains, manner.widths(found.tones) * pixels, OVERLAP)
    strokes = strokes_of(pieces, (0.0, 0.0, 0.0), 1.0, num_sigmas, like)
    tones, gaps = pieces.strengths, pieces.normals.astype(like.means.dtype)
    widths = pieces.widths / Along.of(found.chains).means(pixels)[pieces.chains]
    return Marks(strokes, pieces.chains, Nested(gaps, manner.spacings(tones), widths), tones)


def _dots(found: _Points, manner: Manner, like: Gaussians, num_sigmas: float) -> Marks:
    """Dots as round strokes."""
    widths, count, dtype = manner.widths(found.tones), len(found.points), like.means.dtype
    scales = np.repeat((0.5 * widths * found.pixels / num_sigmas)[:, None], 3, axis=1)
    quats, sh = np.tile([1.0, 0, 0, 0], (count, 1)), np.full((count, 1, 3), -0.5 / C0)
    columns = found.points, quats, scales, np.ones(count), sh
    strokes = Gaussians(*(column.astype(dtype) for column in columns))
    nested = Nested(found.gaps.astype(dtype), manner.spacings(found.tones), widths, is_round=True)
    return Marks(strokes, found.chains, nested, found.tones)
